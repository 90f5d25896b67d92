"""The backend `crazyflie` on an emulated one: the contract of drivers, and what only it does."""

import logging
import math
from collections.abc import Iterator

import pytest
from crazyflie_bench import NAME, CrazyflieBench

from vrg.errors import RobotError
from vrg.hal.driver import COMMAND_TIMEOUT, DriverContext
from vrg.hal.models.crazyflie import CRAZYFLIE
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.ins import Ins
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.driver import STANDSTILL_SPEED, DriverContract
from vrg.testing.loading import loaded
from vrg.types import Twist
from vrg_crazyflie.driver import CrazyflieDriver
from vrg_crazyflie.emulated import firmware, wire
from vrg_crazyflie.flight import LEAD

FIRM = 0.07
"""The time constant in s of the velocity of a Crazyflie that brakes as soon as the contract wants robots to: within
0.35 s. One with the gains of the firmware takes longer; see `test_how_soon_it_stands`."""
LOW = 0.25
"""The height in m from which it falls within the 0.3 s in which the contract wants a robot to stand after an emergency
stop."""


class TestCrazyflie(DriverContract):
    @pytest.fixture
    def bench(self) -> Iterator[CrazyflieBench]:
        with CrazyflieBench(response=FIRM, height=LOW) as made:
            yield made


class TestOneThatMustBeArmed(DriverContract):
    """As those with brushless motors, which do not arm themselves."""

    @pytest.fixture
    def bench(self) -> Iterator[CrazyflieBench]:
        with CrazyflieBench(response=FIRM, height=LOW, auto_arm=False) as made:
            yield made


def test_how_soon_it_stands(bench: CrazyflieBench) -> None:
    """From top speed, with the gains of the firmware, after the last command."""
    bench.fly()
    bench.run(Twist(CRAZYFLIE.v_max, 0.0), 3.0)
    began, from_x = bench.now, bench.body.x
    bench.time_until(lambda: bench.body.vx < STANDSTILL_SPEED)
    assert COMMAND_TIMEOUT < bench.now - began <= 1.1
    assert bench.body.x - from_x <= 0.35
    assert bench.driver.read().armed, "it hovers"


def test_it_climbs_to_its_ceiling_and_sinks_by_command_and_lands_from_there() -> None:
    with CrazyflieBench(height=0.4, ceiling=1.5) as bench:
        bench.fly()
        bench.run(Twist(0.2, 0.0, climb=0.1), 3.0)
        assert bench.body.z == pytest.approx(0.7, abs=0.1)
        before = bench.body.z
        bench.run(Twist(0.0, 0.0, climb=0.5), 2.0)
        assert 0.4 < bench.body.z - before < 2.0 * 2.0 * LEAD
        bench.run(Twist(0.0, 0.0, climb=0.5), 4.0)
        assert bench.body.z == pytest.approx(1.5, abs=0.05)
        bench.run(Twist(0.0, 0.0, climb=-0.5), 2.0)
        bench.run(Twist(0.3, 0.0), 2.0)
        assert bench.body.z == pytest.approx(1.0, abs=0.2)
        there = bench.body.z
        bench.run(Twist(0.3, 0.0), 3.0)
        assert bench.body.z == pytest.approx(there, abs=0.05), "it keeps that height"
        assert not bench.fault
        bench.driver.disarm()
        bench.time_until(lambda: bench.body.z < 0.01)


def test_it_takes_off_to_its_height_and_is_armed_there() -> None:
    with CrazyflieBench(height=0.8) as bench:
        bench.driver.connect()
        bench.advance(0.2)
        while bench.body.z <= 0.2:
            bench.driver.arm()
            bench.advance(0.1)
        assert not bench.driver.read().armed
        with pytest.raises(RobotError, match="until it hovers"):
            bench.driver.drive(Twist(0.1, 0.0))
        bench.fly()
        assert bench.body.z == pytest.approx(0.8, abs=0.08)
        bench.run(Twist(0.2, 0.5, 0.1), 5.0)
        assert bench.body.z == pytest.approx(0.8, abs=0.02)


def test_it_flies_to_any_side_in_the_frame_of_its_body(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.run(Twist(0.0, 0.0, 0.3), 2.0)
    assert (bench.body.vx, bench.body.vy) == pytest.approx((0.0, 0.3), abs=0.01)
    assert (bench.odometry.twist.v, bench.odometry.twist.side) == pytest.approx((0.0, 0.3), abs=0.02)
    bench.run(Twist(0.0, math.pi / 4), 2.0)
    bench.run(Twist(0.2, 0.0), 2.0)
    assert bench.body.yaw == pytest.approx(math.pi / 2, abs=0.05)
    assert (bench.body.vx, bench.body.vy) == pytest.approx((0.0, 0.2), abs=0.02)
    assert bench.odometry.twist.v == pytest.approx(0.2, abs=0.01)
    bench.run(Twist(0.0, math.pi / 2), 5.0)
    assert bench.odometry.pose.theta > math.pi, "the heading grows on"


def test_it_lands_without_turning(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.run(Twist(0.0, 1.0), 2.0)
    bench.driver.disarm()
    bench.time_until(lambda: bench.body.z == 0.0 and bench.body.thrust == 0.0, 5.0)
    assert bench.body.yaw == pytest.approx(2.0, abs=0.3)


def test_closing_lands_it_before_the_link_is_closed(bench: CrazyflieBench) -> None:
    """cflib sends a set-point without thrust as it closes a link."""
    bench.fly()
    bench.run(Twist(0.3, 0.0), 1.0)
    sunk: list[float] = []
    closing = bench.driver._radio.close
    bench.driver._radio.close = lambda: (sunk.append(bench.body.z), closing())[1]  # type: ignore[method-assign]
    bench.driver.close()
    assert sunk == [pytest.approx(0.0, abs=0.03)]


def test_the_way_begins_where_it_was_first_heard(bench: CrazyflieBench) -> None:
    bench.body.x, bench.body.y, bench.body.yaw = 3.0, -2.0, math.pi / 2
    bench.fly()
    assert bench.odometry.pose.x == pytest.approx(0.0, abs=1e-6)
    bench.run(Twist(0.3, 0.0), 2.0)
    assert bench.body.y > -1.6
    assert bench.odometry.pose.x == pytest.approx(bench.body.y + 2.0, abs=0.03)
    assert bench.driver.read().latest(Ins) is None


def test_an_estimator_in_the_frame_of_the_map_is_an_inertial_navigation_system() -> None:
    with CrazyflieBench(pose="map") as bench:
        bench.body.x, bench.body.y = 3.0, -2.0
        bench.driver.connect()
        bench.advance(0.2)
        sample = bench.driver.read().latest(Ins)
        assert sample is not None
        assert (sample.value.pose.x, sample.value.pose.y) == pytest.approx((3.0, -2.0))
        assert "ins" in bench.driver.measures


def test_the_battery_is_measured_and_empties(bench: CrazyflieBench) -> None:
    bench.fly()

    def charge() -> float:
        sample = bench.driver.read().latest(Battery)
        assert sample is not None
        return sample.value.charge

    before = charge()
    bench.advance(20.0)
    assert 0.02 <= before - charge() <= 0.08, "it hovers for seven minutes"


def test_one_that_is_not_there_is_an_error_that_says_what_to_do() -> None:
    clock = SimulatedClock()
    context = DriverContext(
        name="ann", model=CRAZYFLIE, options={"robots": {"ann": {"uri": "udp://127.0.0.1:1"}}}, now=clock.now
    )
    driver = CrazyflieDriver(context, clock)
    driver._radio.uri = "nonsense://ann"  # what no link of cflib takes
    with pytest.raises(RobotError, match=r"ann: cannot connect to nonsense://ann: No driver found.*is it switched on"):
        driver.connect()
    with pytest.raises(RobotError, match="connect"):
        driver.arm()
    driver.close()


def test_an_old_firmware_is_refused(bench: CrazyflieBench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire, "VERSION", 10)
    with pytest.raises(RobotError, match=r"expected protocol version 12 or later.*got version 10"):
        bench.driver.connect()


def test_a_firmware_that_lacks_a_variable_is_refused(bench: CrazyflieBench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(firmware.LOGGED, "pm.state")
    bench.craft.firmware = firmware.Firmware(bench.body)
    with pytest.raises(RobotError, match=r"its firmware cannot report .*pm.state.*update it by cfclient"):
        bench.driver.connect()


def test_a_failure_of_the_thread_is_logged_and_named(
    bench: CrazyflieBench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench.fly()
    bench.driver.emergency_stop()
    bench.advance(0.3)
    monkeypatch.setattr(bench.driver._radio, "restart", lambda _: 1 / 0)
    with caplog.at_level(logging.ERROR):
        bench.driver.release()
        bench.advance(0.3)
    assert "could not be recovered" in caplog.text
    assert "division by zero" in bench.fault
    assert NAME in caplog.text


def test_match_files_are_checked_and_drivers_are_made_without_cflib() -> None:
    code = "from vrg_crazyflie.driver import CrazyflieDriver\nfrom vrg.hal.models.crazyflie import CRAZYFLIE\n"
    code += "from vrg.hal.driver import DriverContext\n"
    code += "CrazyflieDriver(DriverContext(name='ann', model=CRAZYFLIE, options={'emulate': True}))"
    assert loaded(code, ("cflib", "usb", "scipy")) == []
