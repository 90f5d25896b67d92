"""The ways in which other packages calibrate a robot."""

from collections.abc import Callable
from typing import Final

from vrg.registry import Registry

CALIBRATIONS: Final[Registry[Callable[..., None]]] = Registry("way to calibrate", "vrg.calibrations", {})
"""The ways to calibrate a robot with motors on a CAN bus without a tape measure, with the parameters of
`vrg can calibrate`: its player, the match file, the file to write, speed, way, seconds, in_process."""
