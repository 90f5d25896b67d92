"""The outcome of one step of a match, or of one decision of an official."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from msgspec import Struct, structs

from vrg.bus.messages import Call, Stage, shortened
from vrg.types import Pose, Uncertainty


@dataclass(frozen=True)
class Effects:
    """The effects of a step: calls, stages and requests to the world. It is false if `calls`, `stages` and `place` are
    empty.

    Args:
        calls: the calls to announce, in order.
        stages: the stages that were entered, in order.
        place: where the world must put virtual robots and passive bodies, by name.
        once_placed: the call that is announced when the world has done so; None if there is none.
        placed: where a person has put physical robots, by player.
        recover: the players whose robots must clear the faults that they have latched.
        by: the official who has decided it, or `referee`.
    """

    calls: Sequence[Call] = field(default_factory=tuple)
    stages: Sequence[Stage] = field(default_factory=tuple)
    place: Mapping[str, Pose] = field(default_factory=dict)
    once_placed: Call | None = None
    placed: Mapping[str, Pose] = field(default_factory=dict)
    recover: Sequence[str] = field(default_factory=tuple)
    by: str = "referee"

    def __bool__(self) -> bool:
        return bool(self.calls or self.stages or self.place)


class Answer(Struct, frozen=True, kw_only=True):
    """An answer of the world, of which a call is made with these fields."""

    rule: str
    text: str
    players: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()
    answers: str | None = None
    why: str = ""
    cause: str = ""


def numbered(outcomes: Sequence[Effects], before: int, clock: float, known: Mapping[str, Uncertainty]) -> list[Call]:
    """The calls of some outcomes as they are announced and written to the journal.

    Args:
        before: the number of the last call before them. clock: the time of play in the round, s.
        known: how well the poses of players are known, of those for which that is known.
    """
    calls = [call for outcome in outcomes for call in outcome.calls]
    return [
        structs.replace(
            call,
            number=number,
            # A text that is too long for the message could not be read from the journal again.
            text=shortened(call.text),
            players=tuple(call.players),
            poses=tuple(call.poses),
            clock=clock,
            uncertainty={name: known[name] for name in call.players[: len(call.poses)] if name in known},
            why=shortened(call.why),
        )
        for number, call in enumerate(calls, before + 1)
    ]
