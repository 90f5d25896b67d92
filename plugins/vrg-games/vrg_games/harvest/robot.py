"""A P2AT with a gripper."""

from dataclasses import replace

from vrg.hal.actuators import Gripper
from vrg.hal.models.pioneer import P2AT

GATHERER = replace(
    P2AT,
    name="Gatherer",
    actuators=(Gripper(reach=0.1, width=0.4, load=2.0),),
    source=f"{P2AT.source} Its gripper is an estimate, with the load of the Pioneer's own (2 kg, not checked).",
)
