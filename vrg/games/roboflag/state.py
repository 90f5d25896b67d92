"""The state of a match of RoboFlag."""

from collections.abc import Iterable

from msgspec import structs

from vrg.bus.messages import FieldObject
from vrg.coordinator.rulebook import GameState
from vrg.games.roboflag import flag_of


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. The flags are among its `objects`.

    Args:
        states: the state of each player.
        captures: the number of flags that each team has captured.
    """

    states: dict[str, str]
    captures: dict[str, int]

    def with_state(self, names: Iterable[str], state: str) -> "State":
        """The same, but with these players in state `state`."""
        return structs.replace(self, states={**self.states, **dict.fromkeys(names, state)})

    def flag(self, team: str) -> FieldObject:
        """The flag of a team."""
        return next(thing for thing in self.objects if thing.name == flag_of(team))

    def with_carrier(self, team: str, carrier: str | None) -> "State":
        """The same, but with this player as the carrier of the team's flag; None puts the flag back to its place."""
        changed = structs.replace(self.flag(team), carrier=carrier)
        return structs.replace(self, objects=[changed if t.name == changed.name else t for t in self.objects])

    def with_captures(self, team: str, captures: int) -> "State":
        """The same, but with this number of flags that a team has captured."""
        return structs.replace(self, captures={**self.captures, team: captures})
