"""The state of a match of Sharks and Minnows."""

from collections.abc import Collection

from msgspec import structs

from vrg.coordinator.rulebook import GameState
from vrg.games.sharks_and_minnows import ACTIVE
from vrg.types import Pose


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. A round is a pass.

    Args:
        roles, states: the role and the state of each player.
        goal: the end that the minnows cross to in this pass, `low` or `high`.
        marks: the pose where each player lines up.
        caught: the number of minnows taken out so far. crossed: the number of safe crossings so far.
    """

    roles: dict[str, str]
    states: dict[str, str]
    goal: str
    marks: dict[str, Pose]
    caught: int = 0
    crossed: int = 0

    def with_state(self, names: Collection[str], state: str) -> "State":
        """Return the same state, but with the players of these names in state `state`."""
        if all(self.states[name] == state for name in names):
            return self
        return structs.replace(self, states={**self.states, **dict.fromkeys(names, state)})

    def active(self, role: str) -> list[str]:
        """The names of the active players of a role."""
        return [n for n, r in self.roles.items() if r == role and self.states[n] == ACTIVE]


def opposite(end: str) -> str:
    """The other end of the field."""
    return "high" if end == "low" else "low"
