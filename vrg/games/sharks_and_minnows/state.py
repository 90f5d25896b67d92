"""What the referee of Sharks and Minnows remembers."""

from collections.abc import Iterable

from msgspec import structs

from vrg.coordinator.rulebook import GameState
from vrg.games.sharks_and_minnows import ACTIVE
from vrg.types import Pose


class State(GameState, frozen=True, kw_only=True):
    """Everything that the referee of this game remembers; a round is a pass.

    Args:
        roles, states: by player.
        goal: the end that the minnows cross to in this pass.
        marks: where each player is to line up.
        caught: minnows taken out so far. crossed: safe crossings so far.
    """

    roles: dict[str, str]
    states: dict[str, str]
    goal: str
    marks: dict[str, Pose]
    caught: int = 0
    crossed: int = 0

    def with_state(self, names: Iterable[str], state: str) -> "State":
        """The same with the players of these names in `state`."""
        return structs.replace(self, states={**self.states, **dict.fromkeys(names, state)})

    def active(self, role: str) -> list[str]:
        """Names of the active players of a role."""
        return [n for n, r in self.roles.items() if r == role and self.states[n] == ACTIVE]


def opposite(end: str) -> str:
    """The other end of the field."""
    return "high" if end == "low" else "low"
