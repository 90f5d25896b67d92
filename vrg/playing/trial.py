"""Checks that strategies can be imported and made, in sealed processes of their own.

Their code may be anybody's, and may do anything when it is imported: to check it first must not be to run it first.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.games import has_name
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.sandbox.seal import missing
from vrg.launch.strategy_class import strategy_class, strategy_of
from vrg.playing import strategy_process
from vrg.playing.apart import SubprocessStrategy
from vrg.runs.run_folder import RunFolder, scratch_folder
from vrg.system import POSIX


def untried() -> str | None:
    """Why strategies of files are not tried on this machine, in words; None if they are.

    A Linux that cannot seal does not import them. On macOS they are imported, in processes of their own; on Windows
    these could not answer.
    """
    lacking = missing() if sys.platform == "linux" or not POSIX else None
    return None if lacking is None else f"the strategies of files were not imported: {lacking}"


@dataclass(frozen=True)
class Trial:
    """Tries strategies in processes of their own, sealed where this machine can seal.

    Args:
        server: forks the processes. run: a folder for what they write.
    """

    server: ForkServer
    run: RunFolder

    def make(self, setup: MatchSetup, name: str) -> None:
        """Import and make the strategy of a player. One with a name, which comes with an installed package, is trusted.

        Raises:
            ConfigError: there is no such player, or its strategy cannot be imported or made.
        """
        if has_name(setup.player(name).strategy):
            strategy_of(setup, name)
        else:
            self._try(setup, name, make=True)

    def find(self, target: str, base: Path) -> None:
        """Import the class of a strategy.

        Args:
            target: `module:Class`, `file.py:Class`, `policy.npz`, or the name of one that a package has registered.
            base: the folder that a relative path starts from.

        Raises:
            ConfigError: there is none, it cannot be imported, or it is no strategy.
        """
        if has_name(target):
            strategy_class(target, base)
        else:
            setup = load_match(match_path("practice"), base=base)
            name = setup.players[0].name
            self._try(setup.substituted(name, target), name, make=False)

    def _try(self, setup: MatchSetup, name: str, *, make: bool) -> None:
        if untried() is None:
            SubprocessStrategy(self.server, setup, name, self.run, sealed=missing() is None, make=make).made().close()


def once_each(make: Callable[[MatchSetup, str], None]) -> Callable[[MatchSetup, str], None]:
    """The same trial of a player, made once for all players of one strategy and one model of robot."""
    known: dict[tuple[str, str], ConfigError | None] = {}

    def tried(setup: MatchSetup, name: str) -> None:
        player = setup.player(name)
        kind = player.strategy, player.model
        if kind not in known:
            known[kind] = None
            try:
                make(setup, name)
            except ConfigError as error:
                known[kind] = error
        if (problem := known[kind]) is not None:
            raise problem

    return tried


@contextmanager
def trial(server: ForkServer | None = None) -> Iterator[Trial]:
    """A Trial for as long as the context lasts.

    Args:
        server: forks its processes; None starts one for it.
    """
    with ExitStack() as stack:
        place = stack.enter_context(scratch_folder())
        server = server or stack.enter_context(fork_server(preload=[strategy_process.__name__]))
        yield Trial(server, RunFolder(place))
