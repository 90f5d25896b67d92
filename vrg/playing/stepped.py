"""A player in a match in steps: after a failure it goes on with a fresh strategy, until it has failed too often."""

import logging
import math
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vrg.agents.player import Player
from vrg.agents.radio import Radio
from vrg.agents.strategy import Strategy
from vrg.blame import DecisionTimeoutError, failure_of
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.errors import ConfigError, GivenUpError, StrategyError
from vrg.launch.process_log import ProcessLog
from vrg.launch.strikes import Strikes
from vrg.launch.vacancies import disqualification

log = logging.getLogger(__name__)

_TRIM = 10.0
"""The match time in s between two looks at how long the log is."""


@dataclass(frozen=True)
class Failure:
    """A failure in the code of a player, in words, with its match time."""

    player: str
    text: str


class SteppedPlayer(Node):
    """See the module.

    Args:
        player: the player. keys: the keys of the match.
        make: makes its strategy anew.
        log: the file for the traces of its failures; None keeps none.
        disqualify: True disqualifies it when it has failed too often; False ends the match.
        bank: the real time in s that it may take beyond the match time, from `bank_from` on, s of match time.
        spent: makes the strategy that follows.
        clock: returns the real time, s.

    Attributes:
        failures: what has failed so far. thinking: the real time that it has taken, s.
    """

    kind = "player"

    def __init__(
        self,
        player: Player,
        keys: Keys,
        make: Callable[[], Strategy],
        log: Path | None,
        *,
        disqualify: bool,
        bank: float = math.inf,
        bank_from: float = 0.0,
        spent: Callable[[], Strategy] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(player.name, player.mailbox, player.period)
        self.failures: list[Failure] = []
        self.thinking = 0.0
        self._bank, self._bank_from, self._spent, self._clock = bank, bank_from, spent, clock
        self._player = player
        self._keys = keys
        self._make = make
        self._disqualify = disqualify
        self._strikes = Strikes()
        self._out = False
        self._log = None if log is None else ProcessLog(log)
        self._trim_at = 0.0

    def start(self) -> None:
        """Connect to its robot."""
        self._player.start()

    def begin(self, tick: Tick) -> None:
        """Let the player look, if its strategy decides in a process of its own."""
        if not self._out:
            self._player.begin(tick)

    def tick(self, tick: Tick) -> None:
        """Let the player look, decide, drive and report; a player that is out does nothing any more.

        Raises:
            GivenUpError: it has failed too often, and that ends the match.
        """
        if self._out:
            return
        began = self._clock()
        self._tick(tick)
        self.thinking += self._clock() - began if tick.time >= self._bank_from else 0.0
        spent = self.thinking > self._bank + max(0.0, tick.time - self._bank_from)
        if self._spent is not None and not self._out and spent:
            took = f"its code has taken {self.thinking:.0f} s of real time"
            why = f"{took}, so that its bank of {self._bank:g} s is spent: it forfeits its decisions"
            self._note_failure(StrategyError(why), tick)
            self._player.play_by(self._spent())
            self._spent = None
        if self._log is not None and tick.time >= self._trim_at:
            self._trim_at = tick.time + _TRIM
            self._log.grow(tick.time)

    def _tick(self, tick: Tick) -> None:
        try:
            self._player.tick(tick)
        except StrategyError as error:
            self._fail(error, tick, again=self._strikes.failure(tick.time) and not error.final)
        except DecisionTimeoutError as error:
            self._fail(failure_of(error), tick, again=self._strikes.hang(tick.time))

    @property
    def radio(self) -> Radio:
        """The radio to its team."""
        return self._player.radio

    def play_by(self, make: Callable[[], Strategy]) -> None:
        """Let another strategy decide from now on, and be made anew after it has failed.

        Raises:
            ConfigError: it cannot be made.
        """
        self._make = make
        self._strikes = Strikes()
        self._player.play_by(self._make())

    def counted(self) -> dict[str, Any]:
        """The counts of the player."""
        return self._player.counted()

    def stop(self) -> None:
        """Stop its robot."""
        self._player.stop()

    def _fail(self, error: StrategyError, tick: Tick, *, again: bool) -> None:
        """Its robot stands; it gets a fresh strategy, or is out."""
        self._note_failure(error, tick)
        self._player.give_way(str(error))
        why = str(error)
        if again:
            try:
                self._player.play_by(self._make())
                return
            except ConfigError as problem:
                why = str(problem)
        elif not error.final:
            why = f"it fails too often: {why}"
        if not self._disqualify:
            raise GivenUpError(why, self.name)
        self._out = True
        self.mailbox.publish(self._keys.official, disqualification(self.name, why))

    def _note_failure(self, error: StrategyError, tick: Tick) -> None:
        self.failures.append(Failure(self.name, f"{error} (at {tick.time:.1f} s)"))
        self._note(f"{tick.time:.1f} s: {error}\n{_trace(error)}")
        log.warning("%s: %s", self.name, error)

    def _note(self, text: str) -> None:
        if self._log is not None:
            with self._log.open() as log:
                log.write(text.encode("utf-8", "backslashreplace"))


def _trace(error: StrategyError) -> str:
    """The traceback of a strategy's exception; empty if the strategy has raised nothing."""
    return "".join(traceback.format_exception(error.__cause__)) if error.__cause__ is not None else ""
