"""Robot models. Each is described once, from its data sheet, and used by every backend."""

from vrg.hal.models.description import RobotModel
from vrg.registry import Registry

__all__ = ["MODELS", "RobotModel", "robot_model"]

MODELS: Registry[RobotModel] = Registry(
    "robot model",
    "vrg.models",
    {
        "P2AT": "vrg.hal.models.pioneer:P2AT",
        "ATRV-Jr": "vrg.hal.models.atrv_jr:ATRV_JR",
        "TurtleBot3": "vrg.hal.models.turtlebot:TURTLEBOT3",
        "Crazyflie": "vrg.hal.models.crazyflie:CRAZYFLIE",
    },
    lambda found: None if isinstance(found, RobotModel) else "expected a RobotModel",
)
"""Every robot model by name."""


def robot_model(name: str) -> RobotModel:
    """Return the robot model of this name.

    Raises:
        ConfigError: there is no such model; the message lists the names that exist.
    """
    return MODELS.get(name)
