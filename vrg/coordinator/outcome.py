"""What one step of a match, or one decision of an official, has changed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import Call
from vrg.types import Pose


@dataclass(frozen=True)
class Outcome:
    """What is to be journalled, called and done. It is false where nothing is to be journalled or called.

    Args:
        calls: to announce, in order.
        stages: entered, in order.
        place: where the world is to put robots of virtual players.
        placed: where a person has put the robots of physical players.
        recover: players whose robots are to clear the fault that they have latched.
        by: the official who has decided so.
    """

    calls: Sequence[Call] = field(default_factory=tuple)
    stages: Sequence[Stage] = field(default_factory=tuple)
    place: Mapping[str, Pose] = field(default_factory=dict)
    placed: Mapping[str, Pose] = field(default_factory=dict)
    recover: Sequence[str] = field(default_factory=tuple)
    by: str = "referee"

    def __bool__(self) -> bool:
        return bool(self.calls or self.stages or self.place)


def announce(rule: str, text: str, answers: str | None = None) -> Outcome:
    """One call that is about no player in particular."""
    return Outcome([Call(rule=rule, text=text, answers=answers)])
