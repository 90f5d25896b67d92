"""Players of a match that is played again: what they have missed is missed again, however fast this computer is."""

import contextlib
from collections.abc import Callable, Iterable, Mapping

from vrg.agents.strategy import Action, ForfeitError, RemoteStrategy, Strategy, View
from vrg.errors import StrategyError
from vrg.launch.step_log import Line, Missed
from vrg.types import Twist

_Past = Mapping[float, Missed]


class RepeatedStrategy(RemoteStrategy):
    """A strategy that misses the steps that it has missed when the match was played before.

    Args:
        strategy: that strategy. past: what it has missed, by the match time in s. write: notes that again.
    """

    def __init__(self, strategy: Strategy, past: _Past, write: Callable[[Missed], None]) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.priorities = strategy.priorities  # type: ignore[misc]
        self.planner = strategy.planner
        self._strategy, self._past, self._write = strategy, past, write

    @property
    def mode(self) -> str:
        """The mode of the strategy, in its own words."""
        return str(self._strategy.mode)

    def send(self, view: View) -> None:
        """Send it a view, if it was asked."""
        missed = self._missed(view)
        if isinstance(self._strategy, RemoteStrategy) and (missed is None or (missed.asked and not missed.failure)):
            self._strategy.send(view)

    def act(self, view: View) -> Twist | Action:
        """Return the decision of the strategy.

        Raises:
            ForfeitError: it has not answered in time then.
            StrategyError, DecisionTimeoutError: its process has ended then, or was given up.
        """
        missed = self._missed(view)
        if missed is None:
            return self._strategy.act(view)
        self._write(missed)
        if missed.failure:
            self.close()
            raise missed.error
        if missed.asked:
            # Of what it decided too late nothing was heard, also not that it failed, which is another line.
            with contextlib.suppress(BaseException):
                self._strategy.act(view)
        raise ForfeitError

    def complaint(self, what: str) -> StrategyError:
        """See `Strategy.complaint`."""
        return self._strategy.complaint(what)

    def close(self) -> None:
        """End it, if it decides elsewhere. Idempotent."""
        if isinstance(self._strategy, RemoteStrategy):
            self._strategy.close()

    def _missed(self, view: View) -> Missed | None:
        return self._past.get(round(view.time, 6))


def past_of(lines: Iterable[Line], player: str) -> _Past:
    """The steps that a player has missed, by the match time in s."""
    return {line.time: line for line in lines if isinstance(line, Missed) and line.player == player}
