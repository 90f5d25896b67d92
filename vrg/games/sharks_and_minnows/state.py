"""The state of a match of Sharks and Minnows."""

from vrg.coordinator.rulebook import GameState
from vrg.games.sharks_and_minnows import ACTIVE
from vrg.types import Pose


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. A round is a pass.

    The sharks have a point for each minnow taken out, and the minnows one for each safe crossing.

    Args:
        roles: the role of each player.
        goal: the end that the minnows cross to in this pass, `low` or `high`.
        marks: the pose where each player lines up.
    """

    roles: dict[str, str]
    goal: str
    marks: dict[str, Pose]

    def active(self, role: str) -> list[str]:
        """The names of the active players of a role."""
        return [n for n, r in self.roles.items() if r == role and self.states[n] == ACTIVE]


def opposite(end: str) -> str:
    """The other end of the field."""
    return "high" if end == "low" else "low"
