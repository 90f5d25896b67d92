"""A player in a match in steps: after a failure it goes on with a fresh strategy, until it has failed too often."""

import contextlib
import io
import logging
import math
import sys
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
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.stopping import Stop, StopSignal
from vrg.bus.topics import Keys
from vrg.errors import ConfigError, GivenUpError, StrategyError
from vrg.launch.process_log import ProcessLog
from vrg.launch.sandbox.bounds import BoundedOutput
from vrg.launch.strikes import Strikes
from vrg.launch.vacancies import disqualification
from vrg.portable.scalars import total
from vrg.system import in_main_thread

log = logging.getLogger(__name__)

_TRIM = 10.0
"""The match time in s between two looks at how long the log is."""


@dataclass(frozen=True)
class Failure:
    """A failure in the code of a player, in words, with its match time."""

    player: str
    text: str


class InlineCode:
    """What surrounds code of a file that decides in this process; a context manager that is used again and again.

    What it prints goes to the log of its player, within bounds. Once the match is to stop, Ctrl-C interrupts it. In
    another thread than the main one neither holds.

    Args:
        log: the log; None lets it print. stop: what tells that the match is to stop. now: returns the match time, s.
    """

    def __init__(self, log: ProcessLog | None, stop: StopSignal | None, now: Callable[[], float]) -> None:
        self._log, self._stop, self._now = log, stop if isinstance(stop, Stop) else None, now
        self._stream: BoundedOutput | None = None
        self._before = sys.stdout, sys.stderr

    def __enter__(self) -> None:
        if not in_main_thread():
            return
        if self._stop is not None:
            self._stop.interrupts = True
        if self._log is not None:
            if self._stream is None:
                text = io.TextIOWrapper(self._log.open(), "utf-8", "backslashreplace", write_through=True)
                self._stream = BoundedOutput(text, self._now)
            self._before = sys.stdout, sys.stderr
            sys.stdout = sys.stderr = self._stream

    def __exit__(self, *_: object) -> None:
        if self._stop is not None:
            self._stop.interrupts = False
        if self._stream is not None and sys.stdout is self._stream:
            sys.stdout, sys.stderr = self._before

    def close(self) -> None:
        """It decides no more. Idempotent."""
        if self._stream is not None:
            self._stream.close()


class SteppedPlayer(Node):
    """A player that goes on with a fresh strategy after a failure, until it has failed too often.

    Args:
        player: the player. keys: the keys of the match.
        make: makes its strategy again.
        log: the file for the traces of its failures, and for what it prints if it is `inline`; None keeps none.
        inline: True if it is code of a file that decides in this process. stop: see `InlineCode`.
        disqualify: True disqualifies it when it has failed too often; False ends the match.
        bank: the real time in s that it may take beyond the match time, from `bank_from` on, s of match time.
        spent: makes the strategy that follows.
        clock: returns the real time, s.

    Attributes:
        failures: what has failed so far.
        thinking: the real time that it has taken, s, without that of the world, which makes readings when it is read.
    """

    kind = "player"

    def __init__(
        self,
        player: Player,
        keys: Keys,
        make: Callable[[], Strategy],
        log: Path | None,
        *,
        inline: bool,
        stop: StopSignal | None = None,
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
        self._around = InlineCode(self._log, stop, lambda: self.mailbox.now)
        self._inline = inline
        self._trim_at = 0.0
        self._others: list[Mailbox] | None = None
        """Those whose deferred messages it reads."""

    def start(self) -> None:
        """Connect to its robot."""
        self._player.start()

    def begin(self, tick: Tick) -> None:
        """Let the player look, if its strategy decides in its own process."""
        if not self._out:
            self._player.begin(tick)

    def tick(self, tick: Tick) -> None:
        """Let the player look, decide, drive and report; a player that is out does nothing any more.

        Raises:
            GivenUpError: it has failed too often, and that ends the match.
        """
        if self._out:
            return
        began = self._clock() - self._making()
        self._tick(tick)
        self.thinking += self._clock() - self._making() - began if tick.time >= self._bank_from else 0.0
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

    def _making(self) -> float:
        """The real time that it has taken to make what others have deferred, s."""
        if self._others is None and self.mailbox.now > 0.0:  # it is known who they are after the first tick
            self._others = list({id(own.source): own.source for own in self.mailbox.inlets if own.source}.values())
        return total(other.making for other in self._others or ())

    def _tick(self, tick: Tick) -> None:
        try:
            with self._around if self._inline else contextlib.nullcontext():
                self._player.tick(tick)
        except StrategyError as error:
            self._fail(error, tick, again=self._strikes.failure(tick.time) and not error.final)
        except DecisionTimeoutError as error:
            self._fail(failure_of(error), tick, again=self._strikes.hang(tick.time))

    @property
    def radio(self) -> Radio:
        """The radio to its team."""
        return self._player.radio

    def play_by(self, make: Callable[[], Strategy], *, inline: bool) -> None:
        """Let another strategy decide from now on, and be made again after it has failed.

        Args:
            inline: True if it is code of a file that decides in this process.

        Raises:
            ConfigError: it cannot be made.
        """
        self._make, self._inline = make, inline
        self._strikes = Strikes()
        self._player.play_by(self._make())

    def counted(self) -> dict[str, Any]:
        """The counts of the player."""
        return self._player.counted()

    def stop(self) -> None:
        """Stop its robot."""
        self._player.stop()
        self._around.close()

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
