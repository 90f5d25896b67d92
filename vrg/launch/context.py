"""What the node of a process is made from."""

import os
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vrg.bus.node import Node
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.launch.process import Process
from vrg.runs.run_folder import RunFolder

if TYPE_CHECKING:
    from vrg.bus.session import Session  # a match in one process has none, and does not load zenoh
    from vrg.bus.stopping import Stop

DISPLAY_PERIOD = 1 / 30
"""The real time in s between two looks at what a person does."""


class Made(NamedTuple):
    """A node, and what the runner of its kind is given besides."""

    node: Node
    options: Mapping[str, Any] = {}


@dataclass(frozen=True)
class NodeContext:
    """The process that a node is made in.

    Args:
        process: its process. setup: of the match.
        folder: the run folder, or just where files may be written.
        session: with the match's router; None in a match in one process, which has no bus.
        stop: what stops the process.
        official: whether its seat may decide. own: whether it is one of the match's own processes: any number of others
            may be opened beside them.
        begun: what its kind has begun before the process had a thread; see `vrg.kinds.Kind.begins`.
        secret: the line that the launcher has given to this process alone; empty for none.
        stack: what is entered here is left when the process ends.
    """

    process: Process
    setup: MatchSetup
    folder: RunFolder
    session: "Session | None"
    stop: "Stop"
    official: bool
    own: bool
    secret: str
    begun: Any = None
    stack: ExitStack = field(default_factory=ExitStack)

    @property
    def name(self) -> str:
        """The name of its player, source, team or window, or the address where it serves."""
        return self.process.node

    @property
    def run(self) -> Path | None:
        """The run folder; None if it is not known."""
        return self.folder.path if self.process.run else None

    def named(self, usual: str) -> str:
        """The name of its node: the usual one, or one that nobody else has where several may run."""
        return usual if self.own else f"{usual}-{os.getpid()}"

    def join(self, router: str = "") -> "Session":
        """A session with another router, or with the match's for an empty endpoint.

        Raises:
            LaunchError: the match has no bus.
        """
        from vrg.bus.session import joined  # noqa: PLC0415 - as above

        if router:
            return self.stack.enter_context(joined(router, self.stop))
        if self.session is None:
            raise LaunchError("this needs the bus, which a match in one process does not have")
        return self.session
