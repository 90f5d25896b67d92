"""The strategies of robots that a person drives, or a ROS node."""

from vrg.agents.strategy import Strategy, View
from vrg.types import STILL, Twist


class Waiting(Strategy):
    """Stands still, so that a person drives it: TAB and the arrow keys in the window."""

    mode = "Waiting"

    def act(self, view: View) -> Twist:
        """Stand still."""
        return STILL


class RosDriven(Waiting):
    """Stands still, but for what `vrg show ros` passes on from its topic `cmd_vel`, as if a person drove it."""

    mode = "ROS"
