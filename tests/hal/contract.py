"""What every robot backend promises. A backend's test subclasses RobotContract and gives it a Bench."""

import itertools
import math
from abc import ABC, abstractmethod

import pytest

from vrg.errors import RobotError, StaleDataError
from vrg.hal.robot import COMMAND_TIMEOUT, Robot

STOPPED = 0.02
"""m/s below which a robot counts as stopped."""


class Bench(ABC):
    """A robot on a stand, with free ground ahead. `robot` is constructed and not connected."""

    robot: Robot

    @abstractmethod
    def advance(self, seconds: float) -> None:
        """Let time pass; nobody drives meanwhile."""

    @abstractmethod
    def estop(self, engaged: bool) -> None:
        """Somebody engages or releases the emergency stop."""

    @abstractmethod
    def cut(self) -> None:
        """The robot stops to send readings, while time goes on."""

    def run(self, left: float, right: float, seconds: float) -> None:
        """Drive for a while, with a fresh command every 0.1 s."""
        for _ in range(round(seconds / 0.1)):
            self.robot.drive(left, right)
            self.advance(0.1)


class RobotContract:
    """Subclasses provide the fixture `bench`."""

    def test_features_are_readable_before_connecting(self, bench: Bench) -> None:
        assert bench.robot.features.wheel_speed_max > 0
        assert bench.robot.features.track > 0

    def test_a_reading_before_the_first_one_is_an_error_not_zeros(self, bench: Bench) -> None:
        with pytest.raises(StaleDataError):
            bench.robot.read()

    def test_connecting_does_not_arm(self, bench: Bench) -> None:
        bench.robot.connect()
        bench.advance(0.2)
        assert not bench.robot.read().armed
        with pytest.raises(RobotError, match="arm"):
            bench.robot.drive(1.0, 1.0)
        bench.advance(0.3)
        assert abs(bench.robot.read().v) < STOPPED

    def test_arming_needs_a_connection(self, bench: Bench) -> None:
        with pytest.raises(RobotError, match="connect"):
            bench.robot.arm()

    def test_it_drives_where_it_is_told(self, bench: Bench) -> None:
        armed(bench)
        before = bench.robot.read()
        bench.run(2.0, 2.0, 2.0)
        after = bench.robot.read()
        assert after.armed
        assert after.v == pytest.approx(2.0 * bench.robot.features.wheel_radius, rel=0.15)
        assert math.hypot(after.odometry.x - before.odometry.x, after.odometry.y - before.odometry.y) > 0.1
        assert after.encoders[0] > before.encoders[0]
        assert after.encoders[1] > before.encoders[1]

    def test_drive_returns_what_is_sent_and_scales_both_sides_alike(self, bench: Bench) -> None:
        armed(bench)
        limit = bench.robot.features.wheel_speed_max
        sent = bench.robot.drive(4 * limit, -2 * limit)
        assert sent.left == pytest.approx(limit)
        assert sent.right == pytest.approx(-limit / 2)
        inside = bench.robot.drive(limit / 3, limit / 4)
        assert (inside.left, inside.right) == (limit / 3, limit / 4)

    def test_top_speed_is_the_models(self, bench: Bench) -> None:
        armed(bench)
        bench.run(1000.0, 1000.0, 2.0)
        assert bench.robot.read().v <= bench.robot.features.v_max * 1.1

    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    def test_speeds_that_are_not_finite_are_refused(self, bench: Bench, bad: float) -> None:
        armed(bench)
        for left, right in itertools.permutations((bad, 1.0)):
            with pytest.raises(RobotError, match="finite"):
                bench.robot.drive(left, right)
        bench.advance(0.3)
        assert abs(bench.robot.read().v) < STOPPED

    def test_stop_stops_and_stays_armed(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        for _ in range(8):
            bench.robot.stop()
            bench.advance(0.1)
        assert abs(bench.robot.read().v) < STOPPED
        assert bench.robot.read().armed
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().v > 0.1

    def test_the_watchdog_stops_it_when_commands_cease(self, bench: Bench) -> None:
        armed(bench)
        bench.run(bench.robot.features.wheel_speed_max, bench.robot.features.wheel_speed_max, 1.0)
        assert bench.robot.read().v > 0.3
        bench.advance(COMMAND_TIMEOUT + 0.25)
        assert abs(bench.robot.read().v) < STOPPED
        if not bench.robot.read().armed:
            # Where the watchdog is the drive's own, it has switched the motors off.
            bench.robot.arm()
            bench.advance(0.1)
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().v > 0.1, "a fresh command moves it again"

    def test_readings_carry_their_age(self, bench: Bench) -> None:
        bench.robot.connect()
        bench.advance(0.5)
        assert 0.0 <= bench.robot.read().age < 0.1
        stamp = bench.robot.read().stamp
        bench.cut()
        bench.advance(1.0)
        stale = bench.robot.read()
        assert stale.age > 0.8
        assert stale.stamp <= stamp + 0.1

    def test_disarm_stops_it_until_armed_again(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.robot.disarm()
        bench.robot.disarm()
        bench.advance(0.5)
        assert abs(bench.robot.read().v) < STOPPED
        assert not bench.robot.read().armed
        with pytest.raises(RobotError, match="arm"):
            bench.robot.drive(1.0, 1.0)
        bench.robot.arm()
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().v > 0.1

    def test_the_emergency_stop_stops_it_and_latches(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.estop(True)
        bench.advance(0.3)
        state = bench.robot.read()
        assert state.estop
        assert abs(state.v) < STOPPED
        with pytest.raises(RobotError, match="emergency"):
            bench.robot.drive(3.0, 3.0)
        with pytest.raises(RobotError, match="emergency"):
            bench.robot.arm()
        bench.advance(0.5)
        assert abs(bench.robot.read().v) < STOPPED

    def test_nothing_moves_after_a_release_until_armed_again(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.estop(True)
        bench.advance(0.3)
        assert bench.robot.read().estop
        bench.advance(0.1)
        bench.estop(False)
        bench.advance(0.3)
        assert not bench.robot.read().estop
        with pytest.raises(RobotError, match="arm"):
            bench.robot.drive(3.0, 3.0)
        bench.advance(0.3)
        assert abs(bench.robot.read().v) < STOPPED
        bench.robot.arm()
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().v > 0.1

    def test_close_disarms_and_can_be_called_twice(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.robot.close()
        bench.robot.close()
        bench.advance(0.5)
        with pytest.raises(RobotError):
            bench.robot.drive(1.0, 1.0)

    def test_it_can_be_connected_again_and_is_then_disarmed_and_at_rest(self, bench: Bench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.robot.close()
        bench.advance(0.5)
        bench.robot.connect()
        bench.robot.connect()
        bench.advance(0.2)
        assert abs(bench.robot.read().v) < STOPPED
        assert not bench.robot.read().armed
        bench.robot.arm()
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().v > 0.1

    def test_a_context_manager_connects_and_closes(self, bench: Bench) -> None:
        with bench.robot as robot:
            bench.advance(0.1)
            robot.arm()
            bench.advance(0.1)
        with pytest.raises(RobotError):
            bench.robot.drive(1.0, 1.0)


def armed(bench: Bench) -> None:
    """Connect and arm."""
    bench.robot.connect()
    bench.advance(0.1)
    bench.robot.arm()
    bench.advance(0.1)
