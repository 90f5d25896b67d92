"""The hook through which a program of another package may change how all players of a match drive."""

from abc import ABC, abstractmethod

from vrg.agents.strategy import View
from vrg.hal.models import RobotModel
from vrg.types import Twist


class Planner(ABC):
    """Changes the motions of one player, such as to lead it around obstacles, whatever its strategy is.

    It is asked for every motion that a strategy or a human wants, but for none of the referee's. What it returns goes
    to the robot's device, which limits it.

    Args:
        name: the player's name. robot: the description of its robot.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        self.name = name
        self.robot = robot

    @abstractmethod
    def plan(self, view: View, twist: Twist) -> Twist:
        """Return the motion to drive with until the next tick, in place of the wanted one."""
