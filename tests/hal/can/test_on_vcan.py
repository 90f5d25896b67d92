"""A drive with every protocol on a CAN bus of the kernel, in real time; all else is tested on simulated time."""

from collections.abc import Callable
from contextlib import suppress

import pytest

from vrg.errors import RobotError
from vrg.hal.can.driver import CanDriver
from vrg.hal.clock import REAL_CLOCK
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.hal.sensors.odometry import Odometry
from vrg.testing.can.bench import NODES, settings
from vrg.testing.can.live import PATIENCE, LiveDrives
from vrg.testing.can.vcan import VCAN
from vrg.types import Twist

pytestmark = pytest.mark.vcan


@pytest.mark.parametrize("protocol", sorted(NODES))
def test_it_is_met_armed_driven_and_stopped_by_its_watchdogs(protocol: str) -> None:
    left, right = NODES[protocol]
    with LiveDrives(protocol, [*left, *right], VCAN) as drives:
        options = settings(protocol, left, right, VCAN)
        driver = CanDriver(DriverContext(name="r", model=robot_model("P2AT"), options=options))
        try:
            driver.connect()
            go_until(driver, lambda: min(abs(drive.motor.velocity) for drive in drives.drives) > 20.0)
            readings = driver.read()
            assert readings.latest(Odometry) is not None
            assert readings.latest(Odometry).value.pose.x > 0.0
            assert readings.fault is None
            # Nobody commands it any more: the drives stop by themselves, and say so.
            assert REAL_CLOCK.wait(lambda: all(abs(drive.motor.velocity) < 0.5 for drive in drives.drives), PATIENCE)
            assert REAL_CLOCK.wait(lambda: not driver.read().armed, PATIENCE)
            assert driver.read().fault is None, "a late commander is no fault of the robot"
        finally:
            driver.close()


def go_until(driver: CanDriver, condition: Callable[[], bool]) -> None:
    """Drive as a player does: a machine that is busy makes some commands late, and then it arms again."""
    deadline = REAL_CLOCK.now() + PATIENCE
    while not condition():
        assert REAL_CLOCK.now() < deadline, f"it does not drive: {driver.read()}"
        with suppress(RobotError):
            readings = driver.read()
            if readings.latched:
                driver.recover()  # the drives, which have no processor of their own, were heard too late
            elif readings.armed:
                driver.drive(Twist(0.33, 0.0))
            else:
                driver.arm()
        REAL_CLOCK.sleep(0.05)
