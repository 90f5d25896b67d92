"""The strategy of a player that a ROS node drives."""

from vrg.agents.strategy import Strategy, View
from vrg.types import STILL, Twist


class RosDriven(Strategy):
    """Stands still, until `vrg show ros` passes on what comes on the player's topic `cmd_vel`, as if a person drove it."""

    mode = "ROS"

    def act(self, view: View) -> Twist:
        """Stand still."""
        return STILL
