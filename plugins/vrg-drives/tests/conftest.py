"""The fixtures of a robot on a simulated bus, and of matches: they are those of VRG's own tests."""

from tests.hal.can.conftest import bench, drives, going, lab, protocol, simulated, watchdog
from tests.system.conftest import arena, start
from tests.system.test_can_tools import node

__all__ = ["arena", "bench", "drives", "going", "lab", "node", "protocol", "simulated", "start", "watchdog"]
