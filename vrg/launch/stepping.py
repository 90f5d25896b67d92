"""Players in lockstep: one that does not answer in time forfeits the step, and holds up nothing.

What a player has missed is written to the log of steps, by which `vrg.launch.repeating` misses it again.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from vrg.agents.strategy import Action, ForfeitError, RemoteStrategy, View
from vrg.blame import DecisionTimeoutError
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError, StrategyError
from vrg.launch.apart import StrategyApart
from vrg.launch.bounds import BUDGET
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.strategy import strategy_of
from vrg.launch.remote.strategies import RemoteStarter
from vrg.launch.trial import LOADING_TIMEOUT
from vrg.runs.run_folder import RunFolder, scratch_folder
from vrg.runs.step_log import Missed

DEADLINE: Final = 1.0
"""The real time in s after which a player that does not answer forfeits a step."""


class SteppedStrategy(RemoteStrategy):
    """A strategy in a process of its own that forfeits each step in which it does not answer in time.

    Args:
        strategy: that strategy. deadline: the real time in s that it has. write: notes what was missed.
        now: returns the real time, s.
    """

    def __init__(
        self,
        strategy: StrategyApart,
        deadline: float,
        write: Callable[[Missed], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.priorities = strategy.priorities  # type: ignore[misc]
        self._strategy, self._deadline = strategy, deadline
        self._write, self._now = write, now
        self._asked = self._late = False
        self._since = 0.0
        self._failed: StrategyError | None = None

    @property
    def mode(self) -> str:
        """The mode of the strategy, in its own words."""
        return self._strategy.mode

    def send(self, view: View) -> None:
        """Send it a view, unless it still decides by an earlier one."""
        if self._late and self._strategy.has_answered(0.0):
            self._late = False
            try:
                self._strategy.skip()
            except StrategyError as error:
                self._failed = error
        self._asked = not self._late and self._failed is None
        if self._asked:
            self._since = self._now()
            self._strategy.send(view)

    def act(self, view: View) -> Action:
        """Return the decision of the strategy.

        Raises:
            ForfeitError: it has not answered in time.
            StrategyError: it has failed, or its process has ended.
            DecisionTimeoutError: it has not answered for BUDGET.
        """
        if self._failed is not None:
            raise self._noted(view, failure=str(self._failed), final=self._failed.final).error
        if self._asked and self._strategy.has_answered(max(0.0, self._since + self._deadline - self._now())):
            try:
                return self._strategy.act(view)
            except StrategyError as error:
                # Its own code, or somebody's signal: only the former would come again by itself.
                self._noted(view, failure=str(error), final=error.final)
                raise
            except DecisionTimeoutError as error:
                self._noted(view, failure=str(error), hung=True)
                raise
        if self._now() - self._since > BUDGET:
            self._strategy.close()
            why = str(self.complaint(f"a decision may take {BUDGET:g} s"))
            raise self._noted(view, failure=why, hung=True).error
        self._late = True
        self._noted(view)
        raise ForfeitError

    def complaint(self, what: str) -> StrategyError:
        """See `Strategy.complaint`."""
        return self._strategy.complaint(what)

    def close(self) -> None:
        """End its process. Idempotent."""
        self._strategy.close()

    def _noted(self, view: View, *, failure: str = "", final: bool = False, hung: bool = False) -> Missed:
        time, name = round(view.time, 6), self.name
        missed = Missed(time=time, player=name, asked=self._asked, failure=failure, final=final, hung=hung)
        self._write(missed)
        return missed


@dataclass(frozen=True)
class Apart:
    """The strategies of a match in lockstep that decide in processes of their own.

    Args:
        server: forks their processes.
        every: True for all strategies; False for those alone that are to be sealed in a match with seats.
        strangers: True seals all strategies of files, here, whatever the match file says: it is a stranger's as well.
        deadline: the real time in s after which one forfeits a step; None waits.
    """

    server: ForkServer
    every: bool = False
    strangers: bool = False
    deadline: float | None = None

    def wanted(self, setup: MatchSetup, name: str) -> bool:
        """True if the strategy of a player decides in a process of its own."""
        return self.every or self._is_strangers(setup, name) or setup.sandboxed(name, seats=True)

    def _is_strangers(self, setup: MatchSetup, name: str) -> bool:
        return self.strangers and setup.strategy_file(name) is not None

    def tried(self, setup: MatchSetup, name: str) -> None:
        """Import and make the strategy of a player where it would decide, to find out whether that can be done.

        Raises:
            ConfigError: it cannot.
        """
        if not self.wanted(setup, name):
            strategy_of(setup, name)
            return
        with scratch_folder() as place:
            self.made(setup, name, RunFolder(place), None).close()

    def made(
        self, setup: MatchSetup, name: str, run: RunFolder, write: Callable[[Missed], None] | None
    ) -> RemoteStrategy:
        """Make a strategy in a process of its own.

        Args:
            write: notes what it misses; None waits for it.

        Raises:
            ConfigError: it cannot be made.
        """
        from vrg.launch.serving import is_sealed  # noqa: PLC0415 - it loads the bus, which no other match here needs

        sealed = not self.every or self._is_strangers(setup, name) or is_sealed(setup, name, seats=False)
        machine = HERE if self.strangers else setup.place.get(name, HERE)
        there = RemoteStarter(machine, setup.hosts[machine]) if machine in setup.hosts else self.server
        try:
            strategy = StrategyApart(there, setup, name, run, sealed=sealed, patience=LOADING_TIMEOUT)
        except (LaunchError, OSError) as error:
            raise ConfigError(str(error)) from None
        if self.deadline is None or write is None:
            return strategy
        return SteppedStrategy(strategy, self.deadline, write)
