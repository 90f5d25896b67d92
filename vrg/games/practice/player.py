"""The strategy of robots that a person drives."""

from vrg.agents.strategy import Strategy, View
from vrg.types import STILL, Twist


class Waiting(Strategy):
    """Stands still, so that a person drives it: TAB and the arrow keys in the window."""

    mode = "Waiting"

    def act(self, view: View) -> Twist:
        """Stand still."""
        return STILL
