"""The seats of a match: players whose processes fail for good, and others that are put into their places."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    DISQUALIFIED,
    FAILED,
    REASON_LENGTH,
    Official,
    OfficialAction,
    SeatAnswer,
    SeatRequest,
    Stage,
    shortened,
)
from vrg.bus.topics import Keys
from vrg.launch.child import arguments_of
from vrg.launch.managed import HANDOVER, ManagedProcess
from vrg.launch.process_log import FLOOD, FLOOD_WINDOW

LAUNCHER = "launcher"
"""Who decides that a player has failed, for the journal."""
_GREED = 1.0
"""The real time in s between two looks at what the processes use."""
_LATE = 2.0
"""The real time in s for which a process that has ended may still be heard."""
_SLACK, _OWN = 1.25, 500
"""A process may use this many times the memory that its strategy may use, and so many MB more."""
_AGAIN = 1.0
"""The real time in s after which the referee is told once more, if it has not done it."""


def disqualification(name: str, why: str) -> Official:
    """What tells the referee that a player has failed for good."""
    reason = shortened(why, REASON_LENGTH)
    return Official(action=OfficialAction.DISQUALIFY, by=LAUNCHER, reason=reason, subject=name, value=FAILED)


class Seats:
    """See the module.

    Args:
        mailbox: the supervisor's mailbox. keys: the keys of the match.
        announce: called with a text about each event that a person should know of.
        disqualify: True disqualifies a player that has failed for good; False halts the match.
        memory: the most memory that a player's process may use, MB.

    Attributes:
        disqualify: as given. vacant: the players whose processes have failed for good, each with the reason.
    """

    def __init__(
        self, mailbox: Mailbox, keys: Keys, announce: Callable[[str], None], *, disqualify: bool, memory: int
    ) -> None:
        self.disqualify = disqualify
        self.vacant: dict[str, str] = {}
        self._mailbox = mailbox
        self._keys = keys
        self._announce = announce
        self._memory = memory
        self._referee = mailbox.subscribe(keys.referee_state)
        self._requests = mailbox.subscribe(keys.seat_request)
        self._looked = 0.0
        self._told: dict[str, float] = {}
        self._vacated: dict[str, float] = {}

    def look(self, processes: Sequence[ManagedProcess], now: float) -> list[ManagedProcess]:
        """Find players that use too much, put others into seats where somebody asks for it, and tell the referee.

        Args:
            processes: all processes of the match. now: the monotonic time, s.

        Returns:
            the processes that were ended or replaced.
        """
        changed = []
        if now - self._looked >= _GREED:
            self._looked = now
            changed += [process for process in processes if self._is_greedy(process, now)]
        for request in (received.body for received in self._requests.take()):
            changed += self._substitute(request, processes)
        self._tell(now)
        return changed

    def vacate(self, process: ManagedProcess, why: str) -> None:
        """A player has failed for good: it is not started again, until somebody puts another one into its seat."""
        name = process.spec.name
        process.kill()
        why = why.removeprefix(f"{name}: ")
        self.vacant[name] = why
        self._vacated[name] = time.monotonic()
        self._told.pop(name, None)
        what = "disqualified" if self.disqualify else "the match is halted"
        self._announce(f"{name}: {why}: {what} (log: {process.log.path})")

    def take(self, name: str, now: float) -> None:
        """A sign of life has come of a player whose process has ended: somebody else plays for it by now."""
        # The last sign of the process itself may come late.
        if now - self._vacated.get(name, now) > _LATE:
            self.vacant.pop(name, None)

    def _is_greedy(self, process: ManagedProcess, now: float) -> bool:
        """End a player that uses up memory or writes without end, where the bounds within its process have failed."""
        written = process.log.grow(now) if process.ready else 0
        if not process.spec.seat or process.pid is None:
            return False
        if process.memory > 1_000_000 * (_SLACK * self._memory + _OWN):
            why = f"it uses more than {self._memory} MB of memory"
        elif written > FLOOD:
            why = f"it has written {written // 1_000_000} MB to its log within {FLOOD_WINDOW:g} s"
        else:
            return False
        where = process.where()
        # It works, so it can stop its robot.
        process.terminate()
        process.wait_stopped(now + HANDOVER)
        self.vacate(process, f"{why} ({where})" if where else why)
        return True

    def _substitute(self, request: SeatRequest, processes: Sequence[ManagedProcess]) -> list[ManagedProcess]:
        """Let a player play by another strategy, in a new process."""
        seats = {process.spec.name: process for process in processes if process.spec.seat}
        process = seats.get(request.player)
        if process is None:
            self._answer(request, f"expected a player of this match ({', '.join(seats)}), got {request.player!r}")
            return []
        self._announce(f"{request.player} is replaced: it plays by {request.strategy} (asked by {request.by})")
        kind, router, run, name, *_ = process.spec.arguments
        process.play(arguments_of(kind, router=router, run=Path(run), name=name, strategy=request.strategy))
        self.vacant.pop(request.player, None)
        self._answer(request, None)
        return [process]

    def _answer(self, request: SeatRequest, refused: str | None) -> None:
        told = None if refused is None else shortened(refused, REASON_LENGTH)
        self._mailbox.publish(self._keys.seat_answer, SeatAnswer(id=request.id, refused=told))

    def _tell(self, now: float) -> None:
        """Tell the referee who has failed, until it has done what follows."""
        state = self._referee.latest
        if state is None:
            return
        for name, why in self.vacant.items():
            player = state.body.player(name)
            halted = not self.disqualify and f"{name}: " in (state.body.halted or "")
            over = state.body.stage is Stage.GAME_OVER
            done = player is None or player.state == DISQUALIFIED or halted or over
            first = name not in self._told
            if (first or not done) and now - self._told.get(name, -_AGAIN) >= _AGAIN:
                self._told[name] = now
                self._mailbox.publish(self._keys.official, self._decision(name, why))

    def _decision(self, name: str, why: str) -> Official:
        if self.disqualify:
            return disqualification(name, why)
        return Official(action=OfficialAction.HALT, by=LAUNCHER, reason=shortened(f"{name}: {why}", REASON_LENGTH))
