"""The strategies of a match that decide in processes of their own, and those that decide where their players are."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from vrg.agents.strategy import Strategy
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError, StrategyError
from vrg.launch.fork_server import ForkServer, OwnForks
from vrg.launch.sandbox.seal import check_able
from vrg.launch.strategy_class import strategy_of
from vrg.playing.apart import DEADLINE, Past, SpentStrategy, StrategyHere, SubprocessStrategy, Write
from vrg.runs.run_folder import RunFolder, scratch_folder
from vrg.runs.step_log import Line, Missed, Unmade
from vrg.system import POSIX


def begun(setup: MatchSetup, name: str, run: RunFolder, keys: Path | None) -> SubprocessStrategy | None:
    """The strategy of the player whose process this is, in its own process; None for one that is trusted.

    It is called before this process has a thread, a session, keys or a driver, so that the other one has none of them.

    Raises:
        StrategyError: it cannot be imported or made. LaunchError: no process can be started.
        SandboxError: it is to be sealed, and this machine cannot do it.
    """
    from vrg.launch.process_main import is_sealed  # noqa: PLC0415 - it loads the bus, which a match in one process does not

    sealed = is_sealed(setup, name, seats=keys is not None)
    if not POSIX or not (sealed or setup.strategy_file(name) is not None):
        return None
    if sealed:
        check_able()
    # On macOS a process that has loaded the system's libraries cannot fork safely.
    server = OwnForks() if sys.platform == "linux" else ForkServer()
    try:
        strategy = SubprocessStrategy(
            server, setup, name, run, sealed=sealed, keys=keys, in_player=True, deadline=DEADLINE
        )
        return strategy.made()
    except ConfigError as error:
        raise StrategyError(str(error), final=True) from None
    except OSError as error:
        raise LaunchError(f"its strategy cannot be started: {error}", name) from error


@dataclass(frozen=True)
class Strategies:
    """Makes the strategies of a match, here or in processes of their own. What was missed is missed again.

    Args:
        server: forks these processes; None lets all decide here: whoever says so trusts their code.
        every: True for all strategies; False lets those that come with packages decide here.
        trusted: True lets those of files decide here, too, where the match does not seal them.
        strangers: True seals all strategies of files, here, whatever the match file says: it is a stranger's as well.
        seats: True seals them as in a match with seats.
        deadline: the real time in s after which one forfeits a step, if the match was not played before; None waits.
        run: the run folder; without one none can decide apart.
        past: the log of the match when it was played before. write: adds to the log of steps.
        now: returns the match time in s; None before the first step.
    """

    server: ForkServer | None = None
    every: bool = False
    trusted: bool = False
    strangers: bool = False
    seats: bool = False
    deadline: float | None = None
    run: RunFolder | None = None
    past: Sequence[Line] = ()
    write: Write = lambda _: None
    now: Callable[[], float | None] = lambda: None
    _begun: dict[str, SubprocessStrategy] = field(default_factory=dict, init=False)
    _opened: list[SubprocessStrategy] = field(default_factory=list, init=False)

    def is_apart(self, setup: MatchSetup, name: str) -> bool:
        """True if the strategy of a player decides in its own process."""
        if self.server is None:
            return False
        if self.every or self._is_strangers(setup, name) or setup.sandbox:
            return True
        return not self.trusted and setup.strategy_file(name) is not None

    def is_inline(self, setup: MatchSetup, name: str) -> bool:
        """True if the strategy of a player is a file, and decides in this process anyway."""
        return setup.strategy_file(name) is not None and not self.is_apart(setup, name)

    def _is_strangers(self, setup: MatchSetup, name: str) -> bool:
        return self.strangers and setup.strategy_file(name) is not None

    def tried(self, setup: MatchSetup, name: str) -> None:
        """Import and make the strategy of a player where it would decide, to find out whether that can be done.

        Raises:
            ConfigError: it cannot.
        """
        with scratch_folder() as place:
            trial = replace(self, run=RunFolder(place))
            trial.maker(setup, name)()
            trial.close()

    def maker(self, setup: MatchSetup, name: str) -> Callable[[], Strategy]:
        """A function that makes the strategy of a player, for the first time or again."""
        missed = self._missed(name)
        unmade = {line.time: line.why for line in self.past if isinstance(line, Unmade) and line.player == name}

        def make() -> Strategy:
            now = self.now()
            try:
                if now is not None and (why := unmade.get(round(now, 6))) is not None:
                    raise ConfigError(why)
                return self._made(setup, name, missed)
            except ConfigError as error:
                if now is not None:
                    self.write(Unmade(time=round(now, 6), player=name, why=str(error)))
                raise

        return make

    def begin(self, setup: MatchSetup) -> None:
        """Begin the processes of all that decide apart, beside each other, before the first is waited for.

        Raises:
            ConfigError: one cannot be begun.
        """
        for player in setup.players:
            if self.is_apart(setup, player.name):
                self._begun[player.name] = self._process(setup, player.name)

    def spent(self, setup: MatchSetup, name: str) -> Strategy:
        """The strategy of a player whose bank of real time is spent."""
        return SpentStrategy(name, setup.player(name).robot, {}, self.write)

    def close(self) -> None:
        """End all that decide in processes of their own. Idempotent."""
        for strategy in self._opened:
            strategy.close()

    def _serve(self) -> None:
        """Answer what strategies ask about readings while one of them is waited for."""
        for strategy in self._opened:
            strategy.serve()

    def _missed(self, name: str) -> Past:
        """What a player has missed when the match was played before."""
        return {line.time: line for line in self.past if isinstance(line, Missed) and line.player == name}

    def _made(self, setup: MatchSetup, name: str, missed: Past) -> Strategy:
        """Make a strategy.

        Raises:
            ConfigError: it cannot be made.
        """
        if not self.is_apart(setup, name):
            strategy = strategy_of(setup, name)
            return StrategyHere(strategy, missed, self.write) if missed else strategy
        return (self._begun.pop(name, None) or self._process(setup, name)).made()

    def _process(self, setup: MatchSetup, name: str) -> SubprocessStrategy:
        """Begin a strategy in its own process.

        Raises:
            ConfigError: it cannot be begun.
        """
        if self.server is None or self.run is None:
            raise ValueError(f"{name}: a strategy that decides in a process of its own needs a run folder")
        from vrg.launch.process_main import is_sealed  # noqa: PLC0415 - it loads the bus, which no other match here needs

        sealed = self._is_strangers(setup, name) or is_sealed(setup, name, seats=self.seats)
        try:
            begun = SubprocessStrategy(
                self.server, setup, name, self.run, sealed=sealed, deadline=None if self.past else self.deadline,
                machine=HERE if self.strangers else setup.place.get(name, HERE),
                past=self._missed(name), write=self.write, meanwhile=self._serve,
            )  # fmt: skip
        except (LaunchError, OSError) as error:
            raise ConfigError(str(error)) from None
        self._opened.append(begun)
        return begun
