"""The strategy of players that ROS nodes drive."""

from vrg.games.practice.player import Waiting


class RosDriven(Waiting):
    """Stands still, but for what `vrg show ros` passes on from its topic `cmd_vel`, as if a person drove it."""

    mode = "ROS"
