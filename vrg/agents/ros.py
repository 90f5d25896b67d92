"""The strategy of a player that a ROS node drives."""

from vrg.agents.strategy import Strategy, View
from vrg.types import STILL, Twist


class RosDriven(Strategy):
    """Stands still, but for what `vrg show ros` passes on from its topic `cmd_vel`, as if a person drove it."""

    mode = "ROS"

    def act(self, view: View) -> Twist:
        """Stand still."""
        return STILL
