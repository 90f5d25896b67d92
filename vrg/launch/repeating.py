"""The strategies of a match in steps: what was missed when it was played before is missed again, on any computer."""

import contextlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from vrg.agents.strategy import Action, ForfeitError, RemoteStrategy, Strategy, View, decided, planned
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, StrategyError
from vrg.launch.nodes.strategy import strategy_of
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import Line, Missed, StepLog, Unmade

if TYPE_CHECKING:
    from vrg.launch.stepping import Apart

_Past = Mapping[float, Missed]


class RepeatedStrategy(RemoteStrategy):
    """A strategy that misses the steps that it has missed when the match was played before.

    Args:
        strategy: that strategy. past: what it has missed, by the match time in s. write: notes that again.
    """

    def __init__(self, strategy: Strategy, past: _Past, write: Callable[[Missed], None]) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.priorities = strategy.priorities  # type: ignore[misc]
        self._strategy, self._past, self._write = strategy, past, write
        self._mode = "-"

    @property
    def mode(self) -> str:
        """The mode of the strategy, in its own words."""
        return self._mode

    def send(self, view: View) -> None:
        """Send it a view, if it was asked."""
        missed = self._missed(view)
        if isinstance(self._strategy, RemoteStrategy) and (missed is None or (missed.asked and not missed.failure)):
            self._strategy.send(view)

    def act(self, view: View) -> Action:
        """Return the decision of the strategy.

        Raises:
            ForfeitError: it has not answered in time then.
            StrategyError, DecisionTimeoutError: its process has ended then, or was given up.
        """
        missed = self._missed(view)
        if missed is None:
            return self._decided(view)
        self._write(missed)
        if missed.failure:
            self.close()
            raise missed.error
        if missed.asked:
            # Of what it decided too late nothing was heard, also not that it failed, which is another line.
            with contextlib.suppress(BaseException):
                self._decided(view)
        raise ForfeitError

    def _decided(self, view: View) -> Action:
        """Its decision, after its planner, as a process of its own answers."""
        action, self._mode = decided(self._strategy, view)
        return replace(action, twist=planned(self._strategy, view, action.twist))

    def complaint(self, what: str) -> StrategyError:
        """See `Strategy.complaint`."""
        return self._strategy.complaint(what)

    def close(self) -> None:
        """End it, if it decides elsewhere. Idempotent."""
        if isinstance(self._strategy, RemoteStrategy):
            self._strategy.close()

    def _missed(self, view: View) -> Missed | None:
        return self._past.get(round(view.time, 6))


class Strategies:
    """Makes the strategies of a match, here or in processes of their own, and makes what was missed be missed again.

    Args:
        apart: which decide in processes of their own, if the match has a run folder; None lets all decide here.
        folder: the run folder; None without one.
        steps: the log of steps; None keeps none.
        past: the log of the match when it was played before.
        now: returns the match time in s; None before the first step.
    """

    def __init__(
        self,
        apart: "Apart | None",
        folder: RunFolder | None,
        steps: StepLog | None,
        past: Iterable[Line],
        now: Callable[[], float | None],
    ) -> None:
        self._apart, self._folder, self._steps, self._now = apart, folder, steps, now
        self._past = list(past)
        self._opened: list[RemoteStrategy] = []

    def is_apart(self, setup: MatchSetup, name: str) -> bool:
        """True if the strategy of a player decides in a process of its own."""
        return self._apart is not None and self._folder is not None and self._apart.wanted(setup, name)

    def maker(self, setup: MatchSetup, name: str) -> Callable[[], Strategy]:
        """A function that makes the strategy of a player, for the first time or again."""
        mine = [line for line in self._past if isinstance(line, Missed | Unmade) and line.player == name]
        missed = {line.time: line for line in mine if isinstance(line, Missed)}
        unmade = {line.time: line.why for line in mine if isinstance(line, Unmade)}

        def make() -> Strategy:
            now = self._now()
            try:
                if now is not None and (why := unmade.get(round(now, 6))) is not None:
                    raise ConfigError(why)
                strategy = self._made(setup, name)
            except ConfigError as error:
                if now is not None:
                    self._write(Unmade(time=round(now, 6), player=name, why=str(error)))
                raise
            return RepeatedStrategy(strategy, missed, self._write) if missed else strategy

        return make

    def close(self) -> None:
        """End all that decide in processes of their own. Idempotent."""
        for strategy in self._opened:
            strategy.close()

    def _made(self, setup: MatchSetup, name: str) -> Strategy:
        if self._apart is None or self._folder is None or not self.is_apart(setup, name):
            return strategy_of(setup, name)
        strategy = self._apart.made(setup, name, self._folder, None if self._past else self._write)
        self._opened.append(strategy)
        return strategy

    def _write(self, line: Line) -> None:
        if self._steps is not None:
            self._steps.write(line)
