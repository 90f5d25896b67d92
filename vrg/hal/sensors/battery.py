"""The gauge that measures a battery's charge."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Rate, Recorded, SensorSpec
from vrg.types import Fraction


class Battery(SensorMessage, frozen=True, kw_only=True):
    """The charge that is left.

    Args:
        charge: the fraction of a full battery that is left: 1 is full, 0 is empty.
    """

    kind = "battery"

    charge: Fraction


@dataclass(frozen=True, kw_only=True)
class BatterySpec(SensorSpec):
    """A gauge that measures the charge of the battery of the robot model."""

    message = Battery
    simulation = "vrg.hal.sim.sensors.simple:BatterySimulation"
    recorded = Recorded.NONE

    rate: Rate = 1.0
