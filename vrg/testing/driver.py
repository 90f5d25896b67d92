"""The contract of every driver. A driver's test subclasses DriverContract and gives it a DriverBench."""

import math
from abc import ABC, abstractmethod

import pytest

from vrg.errors import RobotError, StaleDataError
from vrg.hal.driver import COMMAND_TIMEOUT, Driver
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.odometry import Odometry
from vrg.types import STILL, Twist

STANDSTILL_SPEED = 0.02
"""m/s below which a robot counts as stopped."""
COMMAND_PERIOD = 0.1
ARMING = 5.0
"""The time in s within which a robot must be armed after it was asked to be."""
"""s between the commands of the one who drives."""
FORWARD = Twist(0.3, 0.0)


class DriverBench(ABC):
    """A robot on a stand, with free ground ahead. `driver` is constructed and not connected."""

    driver: Driver

    @abstractmethod
    def advance(self, seconds: float) -> None:
        """Let time pass without commands."""

    @abstractmethod
    def cut(self) -> None:
        """The robot stops to send readings, while time goes on."""

    def estop(self, engaged: bool) -> None:
        """Engage or release the emergency stop of the match."""
        if engaged:
            self.driver.emergency_stop()
        else:
            self.driver.release()

    def run(self, twist: Twist, seconds: float) -> None:
        """Drive for a while, with a fresh command every COMMAND_PERIOD."""
        for _ in range(round(seconds / COMMAND_PERIOD)):
            self.driver.drive(twist)
            self.advance(COMMAND_PERIOD)

    @property
    def odometry(self) -> Odometry:
        """The newest odometry; every driver measures it, or the world does."""
        sample = self.driver.read().latest(Odometry)
        assert sample is not None, "expected a sample of the odometry"
        return sample.value

    @property
    def speed(self) -> float:
        """m/s ahead."""
        return self.odometry.twist.v


class DriverContract:
    """Subclasses provide the fixture `bench`."""

    def test_features_are_readable_before_connecting(self, bench: DriverBench) -> None:
        assert bench.driver.features.v_max > 0
        assert bench.driver.features.drivetrain.axes

    def test_it_measures_only_sensors_that_its_model_has(self, bench: DriverBench) -> None:
        assert bench.driver.measures <= {spec.kind for spec in bench.driver.features.sensors}

    def test_a_reading_before_the_first_one_is_an_error_not_zeros(self, bench: DriverBench) -> None:
        with pytest.raises(StaleDataError):
            bench.driver.read()

    def test_connecting_does_not_arm(self, bench: DriverBench) -> None:
        bench.driver.connect()
        bench.advance(0.2)
        assert not bench.driver.read().armed
        with pytest.raises(RobotError, match="arm"):
            bench.driver.drive(FORWARD)
        bench.advance(0.3)
        assert abs(bench.speed) < STANDSTILL_SPEED

    def test_arming_needs_a_connection(self, bench: DriverBench) -> None:
        with pytest.raises(RobotError, match="connect"):
            bench.driver.arm()

    def test_it_drives_where_it_is_told(self, bench: DriverBench) -> None:
        armed(bench)
        before, turned = bench.odometry.pose, bench.driver.read().latest(Encoders)
        bench.run(Twist(0.2, 0.0), 2.0)
        after = bench.odometry
        assert bench.driver.read().armed
        assert after.twist.v == pytest.approx(0.2, rel=0.15)
        assert math.hypot(after.pose.x - before.x, after.pose.y - before.y) > 0.1
        now_turned = bench.driver.read().latest(Encoders)
        if turned is not None and now_turned is not None:
            # Every axis that drives ahead has counted on.
            rates = bench.driver.features.drivetrain.rates
            counts = zip(rates, turned.value.counts, now_turned.value.counts, strict=True)
            assert all(now > before for (ahead, _, _), before, now in counts if ahead > 0.0)

    def test_it_turns_to_the_side_that_it_is_told(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(Twist(0.0, 0.5), 1.0)
        assert bench.odometry.twist.w == pytest.approx(0.5, rel=0.25)

    def test_it_uses_the_actuators_that_it_names_and_no_others(self, bench: DriverBench) -> None:
        driver = bench.driver
        assert driver.uses <= {actuator.name for actuator in driver.features.actuators}
        armed(bench)
        for value in (1.0, 0.0):
            for name in sorted(driver.uses):
                driver.use(name, value)
            bench.run(FORWARD, 0.3)
        with pytest.raises(RobotError):
            driver.use("no such actuator", 1.0)
        assert driver.read().armed

    def test_arming_one_that_is_armed_changes_nothing(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        before = bench.speed
        assert before > 0.1
        bench.driver.arm()
        bench.advance(0.05)
        assert bench.speed == pytest.approx(before, rel=0.3)

    def test_stop_stops_and_stays_armed(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        for _ in range(8):
            bench.driver.stop()
            bench.advance(COMMAND_PERIOD)
        assert abs(bench.speed) < STANDSTILL_SPEED
        assert bench.driver.read().armed
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1

    def test_the_watchdog_stops_it_when_commands_cease(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(Twist(bench.driver.features.v_max, 0.0), 1.0)
        assert bench.speed > 0.3
        bench.advance(COMMAND_TIMEOUT + 0.35)
        assert abs(bench.speed) < STANDSTILL_SPEED
        if not bench.driver.read().armed:
            # Where the watchdog is the drive's own, it has switched the motors off.
            arm(bench)
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1, "a fresh command moves it again"

    def test_readings_carry_their_age(self, bench: DriverBench) -> None:
        bench.driver.connect()
        bench.advance(0.5)
        fresh = bench.driver.read()
        assert 0.0 <= fresh.age < 0.15
        sample = fresh.latest(Odometry)
        assert sample is not None
        assert 0.0 <= sample.age < 0.15
        bench.cut()
        bench.advance(1.0)
        stale = bench.driver.read()
        assert stale.age > 0.8
        assert stale.stamp <= fresh.stamp + 0.1
        old = stale.latest(Odometry)
        assert old is not None
        assert old.age > 0.8
        assert old.stamp <= sample.stamp + 0.1

    def test_only_sensors_of_the_model_have_samples(self, bench: DriverBench) -> None:
        bench.driver.connect()
        bench.advance(1.5)
        kinds = {spec.kind for spec in bench.driver.features.sensors}
        assert {sample.value.kind for sample in bench.driver.read().samples} <= kinds

    def test_disarm_stops_it_until_armed_again(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.driver.disarm()
        bench.driver.disarm()
        bench.advance(0.5)
        assert abs(bench.speed) < STANDSTILL_SPEED
        assert not bench.driver.read().armed
        with pytest.raises(RobotError, match="arm"):
            bench.driver.drive(FORWARD)
        arm(bench)
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1

    def test_the_emergency_stop_stops_it(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.estop(True)
        bench.advance(0.3)
        assert abs(bench.speed) < STANDSTILL_SPEED
        with pytest.raises(RobotError, match="arm"):
            bench.driver.drive(FORWARD)
        bench.advance(0.5)
        assert abs(bench.speed) < STANDSTILL_SPEED

    def test_nothing_moves_after_a_release_until_armed_again(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.estop(True)
        bench.advance(0.3)
        # The player sees it at its next tick.
        bench.driver.read()
        bench.advance(0.1)
        bench.estop(False)
        bench.advance(0.3)
        assert not bench.driver.read().estop
        with pytest.raises(RobotError, match="arm"):
            bench.driver.drive(FORWARD)
        bench.advance(0.3)
        assert abs(bench.speed) < STANDSTILL_SPEED
        arm(bench)
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1

    def test_recovering_leaves_it_disarmed(self, bench: DriverBench) -> None:
        armed(bench)
        bench.driver.disarm()
        bench.driver.recover()
        bench.advance(0.7)
        assert not bench.driver.read().armed
        arm(bench)
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1

    def test_close_disarms_and_can_be_called_twice(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.driver.close()
        bench.driver.close()
        bench.advance(0.5)
        with pytest.raises(RobotError):
            bench.driver.drive(FORWARD)

    def test_it_can_be_connected_again_and_is_then_disarmed_and_at_rest(self, bench: DriverBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.driver.close()
        bench.advance(0.5)
        bench.driver.connect()
        bench.driver.connect()
        bench.advance(0.2)
        assert abs(bench.speed) < STANDSTILL_SPEED
        assert not bench.driver.read().armed
        arm(bench)
        bench.run(FORWARD, 1.0)
        assert bench.speed > 0.1

    def test_a_context_manager_connects_and_closes(self, bench: DriverBench) -> None:
        with bench.driver:
            bench.advance(0.1)
            arm(bench)
        with pytest.raises(RobotError):
            bench.driver.drive(STILL)


def armed(bench: DriverBench) -> None:
    """Connect and arm."""
    bench.driver.connect()
    bench.advance(0.1)
    arm(bench)


def arm(bench: DriverBench) -> None:
    """Arm at every tick, as a player does, until the readings tell that the motors accept commands."""
    for _ in range(round(ARMING / COMMAND_PERIOD)):
        bench.driver.arm()
        bench.advance(COMMAND_PERIOD)
        if bench.driver.read().armed:
            return
    raise AssertionError(f"expected an armed robot within {ARMING:g} s, got {bench.driver.read()}")
