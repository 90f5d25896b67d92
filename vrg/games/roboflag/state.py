"""The state of a match of RoboFlag."""

from collections.abc import Mapping

from msgspec import structs

from vrg.bus.messages import FieldObject
from vrg.coordinator.rulebook import GameState
from vrg.games.roboflag import flag_of
from vrg.types import Pose


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. The flags are among its `objects`.

    A team has a point for each flag that it has captured.

    Args:
        marks: where each player lines up for this round: at one of the starts of its team.
    """

    marks: Mapping[str, Pose]

    def flag(self, team: str) -> FieldObject:
        """The flag of a team."""
        return next(thing for thing in self.objects if thing.name == flag_of(team))

    def with_carrier(self, team: str, carrier: str | None) -> "State":
        """The same, but with this player as the carrier of the team's flag; None puts the flag back to its place."""
        changed = structs.replace(self.flag(team), carrier=carrier)
        return structs.replace(self, objects=tuple(changed if t.name == changed.name else t for t in self.objects))
