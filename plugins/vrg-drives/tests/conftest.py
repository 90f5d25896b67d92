"""The fixtures of a robot on a simulated bus, and of matches: they are those of VRG's own tests."""

from tests.hal.can.conftest import bench, drives, going, lab, protocol, watchdog
from tests.system.conftest import arena, start

__all__ = ["arena", "bench", "drives", "going", "lab", "protocol", "start", "watchdog"]
