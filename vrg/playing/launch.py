"""A match that is to be played, and the contract of what plays it."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple, Protocol

from rich.console import Console
from rich.markup import escape

from vrg.bus.messages import RefereeState, Stage
from vrg.bus.stopping import Stop
from vrg.config.setup import CheckedMatch
from vrg.errors import LaunchError
from vrg.launch.fork_server import ForkServer
from vrg.launch.process import Process
from vrg.playing.apart import DEADLINE
from vrg.playing.strategies import Strategies
from vrg.runs.run_folder import RunFolder
from vrg.system import POSIX
from vrg.types import printable
from vrg.ui.web.admission import Admission


class How(StrEnum):
    """The ways in which a match is played.

    In steps all nodes are in one process, in lockstep: IN_PROCESS, where strategies of files decide in processes of
    their own unless they are trusted, and LOCKSTEP, where each strategy does. PROCESSES have a bus, and the clock of
    the match paces them.
    """

    IN_PROCESS = "in process"
    LOCKSTEP = "lockstep"
    PROCESSES = "processes"


@dataclass(frozen=True, kw_only=True)
class Launch:
    """A match that is to be played, and the way in which it is.

    Args:
        setup: the match. how: the way.
        console: where texts are printed.
        window: True opens the window that the game names. record: True records for Foxglove and the plot.
        page: where browsers see it, and who may do what there; None serves no page.
        views: the processes that serve it to other programs, that of the page too; see `vrg.launch.plan.planned`.
        ready: called with the name of each process that is ready, and the endpoint of the match's router.
        secured: True lets only processes with keys in.
        keys: the folder of the keys of the match's seats; None makes keys for this run alone.
        trusted: IN_PROCESS: strategies of files decide in this process, too, where the match does not seal them. Only
            exceptions are caught there.
        strangers: in LOCKSTEP: the strategies of files alone decide in processes of their own, always sealed.
        limit: the match time after which a match in steps is broken off, s.
        paced: in steps: at the rate of the set-up, and not as fast as possible.
        deadline: in LOCKSTEP: the real time after which a strategy forfeits a step, s.
    """

    setup: CheckedMatch
    how: How
    console: Console
    window: bool = False
    record: bool = True
    page: Admission | None = None
    views: Sequence[Process] = ()
    ready: Callable[[str, str], None] = lambda _process, _endpoint: None
    secured: bool = False
    keys: Path | None = None
    trusted: bool = False
    strangers: bool = False
    limit: float = 3600.0
    paced: bool = False
    deadline: float = DEADLINE

    @property
    def steps(self) -> bool:
        """True if the nodes of the match are in one process, in lockstep."""
        return self.how is not How.PROCESSES

    def strategies(self, server: ForkServer) -> Strategies:
        """Where the strategies of a match in steps decide.

        On Windows, where the process of a strategy could not answer, all of IN_PROCESS decide in this one.
        """
        if self.how is How.IN_PROCESS:
            return Strategies(server if POSIX else None, trusted=self.trusted)
        return Strategies(server, every=not self.strangers, strangers=self.strangers, deadline=self.deadline)

    def announce(self, *texts: str) -> None:
        """Print what happens to the processes, unless the terminal is gone: the match does not depend on it."""
        for text in texts:
            with contextlib.suppress(OSError):
                self.console.print(f"[yellow]{escape(printable(text, lines=True))}[/yellow]", soft_wrap=True)


class Played(NamedTuple):
    """The end of a match.

    Args:
        state: the last state of the referee; None if it was not heard. failure: the error if the match was given up.
        interrupted: True if somebody has broken it off.
    """

    state: RefereeState | None
    failure: LaunchError | None = None
    interrupted: bool = False

    @property
    def over(self) -> bool:
        """True if the game came to its end."""
        return self.state is not None and self.state.stage is Stage.GAME_OVER


class Way(Protocol):
    """What plays a match to its end in one of the ways: in steps, or as processes."""

    def __call__(
        self,
        launch: Launch,
        folder: RunFolder,
        server: ForkServer,
        stop: Stop,
        over: Callable[[RefereeState | None], None],
    ) -> Played:
        """Play it.

        Args:
            folder: the run folder. server: starts its processes. stop: breaks it off.
            over: called with the state when the game is over and a window goes on showing it.

        Raises:
            ConfigError: the keys that were given are not good for this match.
            LaunchError: a machine cannot be used, or the router cannot run anywhere.
        """
