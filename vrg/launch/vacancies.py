"""The seats of a match: players whose processes fail for good, and others that are put into their places."""

from collections.abc import Callable, Sequence
from itertools import count
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
from vrg.errors import LaunchError
from vrg.registry import expected_one_of

LAUNCHER = "launcher"
"""The official by whom a player has failed, for the journal."""
_LATE = 2.0
"""The real time in s for which a process that has ended may still be heard."""
_REPEAT_PERIOD = 1.0
"""The real time in s after which the referee gets the message once more, if it has not done it."""


def disqualification(name: str, why: str) -> Official:
    """The message by which the referee disqualifies a player that has failed for good."""
    reason = shortened(why, REASON_LENGTH)
    return Official(action=OfficialAction.DISQUALIFY, by=LAUNCHER, reason=reason, subject=name, value=FAILED)


class Vacancies:
    """Asks the referee to take players out that have failed for good, and lets others play in their places.

    Args:
        mailbox: the launcher's mailbox. keys: the keys of the match. players: the names of the players.
        replace: puts another player into a seat, given the name and the strategy; raises LaunchError.
        announce: called with a text about each event that a person should know of. logs: the folder of the logs.
        disqualify: True disqualifies a player that has failed for good; False halts the match.

    Attributes:
        vacant: the players whose processes have failed for good, each with the reason.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        keys: Keys,
        players: Sequence[str],
        replace: Callable[[str, str], None],
        announce: Callable[[str], None],
        logs: Path,
        *,
        disqualify: bool,
    ) -> None:
        self.vacant: dict[str, str] = {}
        self._disqualify = disqualify
        self._mailbox = mailbox
        self._keys = keys
        self._replace = replace
        self._announce = announce
        self._logs = logs
        self._referee = mailbox.subscribe(keys.referee_state)
        self._requests = mailbox.subscribe(keys.seat_request)
        self._pulses = {keys.pulse("player", name).key: name for name in players}
        self._beats = mailbox.subscribe(keys.pulse(), only=self._pulses)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._told: dict[str, float] = {}
        self._numbers = count(1)
        self._halts: dict[str, str] = {}
        self._answered: set[str | None] = set()
        self._was_halted = False
        self._vacated: dict[str, float] = {}

    def look(self, now: float) -> None:
        """Replace players on request, and report to the referee those that have failed.

        Args:
            now: the monotonic time, s.
        """
        for pulse in self._beats.take():
            if pulse.key in self._pulses:
                self._take(self._pulses[pulse.key], now)
        for request in (received.body for received in self._requests.take()):
            self._substitute(request)
        self._tell(now)

    def vacate(self, name: str, why: str, now: float) -> None:
        """A player has failed for good: it is not started again, until another one is put into its seat."""
        self.vacant[name] = why
        self._vacated[name] = now
        self._told.pop(name, None)
        self._halts[name] = f"{LAUNCHER}-{next(self._numbers)}"
        what = "disqualified" if self._disqualify else "the match is halted"
        self._announce(f"{name}: {why}: {what} (log: {self._logs / f'{name}.log'})")

    def _take(self, name: str, now: float) -> None:
        """A heartbeat of a player has arrived whose process has ended: another process plays for it by now."""
        # The last sign of the process itself may come late.
        if now - self._vacated.get(name, now) > _LATE:
            self.vacant.pop(name, None)

    def _substitute(self, request: SeatRequest) -> None:
        """Let a player play by another strategy, in a new process."""
        names = list(self._pulses.values())
        if request.player not in names:
            self._answer(request, f"PLAYER: {expected_one_of(names, request.player)}")
            return
        self._announce(f"{request.player} is replaced: it plays with {request.strategy} (asked by {request.by})")
        try:
            self._replace(request.player, request.strategy)
        except LaunchError as error:
            self._answer(request, str(error))
            return
        self.vacant.pop(request.player, None)
        self._answer(request, None)

    def _answer(self, request: SeatRequest, refused: str | None) -> None:
        reason = None if refused is None else shortened(refused, REASON_LENGTH)
        self._mailbox.publish(self._keys.seat_answer, SeatAnswer(id=request.id, refused=reason))

    def _tell(self, now: float) -> None:
        """Tell the referee who has failed, until it has done what follows."""
        state = self._referee.latest
        if state is None:
            return
        self._answered |= {call.body.answers for call in self._calls.take()} & {*self._halts.values()}
        if self._was_halted and state.body.halted is None:
            self._answered.clear()  # play goes on without the player: it is halted once more
        self._was_halted = state.body.halted is not None
        for name, why in self.vacant.items():
            player = state.body.player(name)
            halted = self._halts[name] in self._answered
            over = state.body.stage is Stage.GAME_OVER
            done = player is None or player.state == DISQUALIFIED or halted or over
            first = name not in self._told
            if (first or not done) and now - self._told.get(name, -_REPEAT_PERIOD) >= _REPEAT_PERIOD:
                self._told[name] = now
                self._mailbox.publish(self._keys.official, self._decision(name, why))

    def _decision(self, name: str, why: str) -> Official:
        if self._disqualify:
            return disqualification(name, why)
        reason = shortened(f"{name}: {why}", REASON_LENGTH)
        return Official(action=OfficialAction.HALT, by=LAUNCHER, reason=reason, subject=name, id=self._halts[name])
