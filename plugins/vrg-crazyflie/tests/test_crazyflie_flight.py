"""The state machine of a flight, of numbers alone: no cflib, no clock, no thread."""

import math
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrg.errors import RobotError
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.types import STILL, Pose, Twist
from vrg_crazyflie.flight import LEAD, LOWEST, Arming, Command, Flight, Hover, Land, Order, Phase
from vrg_crazyflie.report import Info, Motion, Status, Way, motion_of, status_of

READY = Info.ARMED | Info.AUTO_ARM | Info.CAN_FLY
HEIGHT = 0.4
STEP = 0.04
AHEAD = Twist(0.3, 0.1, -0.2)


class Air:
    """A flight, and reports of a body that does at once what it is told."""

    def __init__(self, ceiling: float | None = None) -> None:
        self.flight = Flight("cf", HEIGHT, ceiling, 3.3)
        self.now, self.ground = 0.0, 0.0
        self.motion = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.status = Status(0.0, READY, 4.0, 0, 0.9, 36000.0)
        self.sent: list[Command] = []
        self.lands = self.asks = False

    def step(self, *, heard: bool = True) -> list[Command]:
        """Let STEP pass; return what is sent."""
        self.now += STEP
        self.asks = self.asks and not self.flight.armed
        if self.asks:
            self.flight.arm(self.now)
        if heard:
            self.motion = replace(self.motion, heard=self.now)
            self.flight.hear(self.motion)
            self.flight.hear_status(replace(self.status, heard=self.now))
        found = self.flight.step(self.now)
        for command in found:
            self.lands = isinstance(command, Land) or command is Order.YIELD
            if isinstance(command, Hover):
                self.motion = replace(self.motion, z=max(self.ground, command.height), vx=command.twist.v)
        if self.lands:
            self.motion = replace(self.motion, z=max(self.ground, self.motion.z - 0.2 * STEP))
        self.sent += found
        return found

    def steps(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            self.step()

    def fly(self) -> None:
        self.step()
        self.ask()
        self.steps(3.0)
        assert self.flight.armed

    def ask(self) -> None:
        """Ask it to take off, from now on at each step."""
        self.flight.arm(self.now)
        self.asks = True


@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(0.1, 2.0)), max_size=8))
@settings(deadline=None, max_examples=50)
def test_it_climbs_and_sinks_between_its_bounds_and_is_never_led_far_from_where_it_is(
    ways: list[tuple[float, float]],
) -> None:
    air = Air(ceiling=1.2)
    air.fly()
    for climb, seconds in ways:
        for _ in range(round(seconds / STEP)):
            before = air.motion.z
            air.flight.drive(Twist(0.0, 0.0, climb=climb), air.now)
            hovers = [command for command in air.step() if isinstance(command, Hover)]
            assert all(LOWEST <= command.height <= 1.2 for command in hovers)
            assert all(abs(command.height - before) <= LEAD + 1e-9 for command in hovers)
    kept = air.motion.z
    air.flight.drive(STILL, air.now)
    air.steps(1.0)
    assert air.motion.z == pytest.approx(kept, abs=1e-9), "it keeps the height that it has reached"
    assert air.flight.armed
    assert not air.flight.fault(air.now)


def test_one_without_a_ceiling_keeps_its_height_and_one_that_cannot_climb_does_not_count_as_sinking() -> None:
    level = Air()
    level.fly()
    level.flight.drive(Twist(0.0, 0.0, climb=0.5), level.now)
    level.steps(0.4)
    assert level.motion.z == HEIGHT
    heavy = Air(ceiling=1.2)
    heavy.fly()
    for _ in range(50):
        heavy.flight.drive(Twist(0.0, 0.0, climb=0.5), heavy.now)
        heavy.step()
        heavy.motion = replace(heavy.motion, z=HEIGHT)
    assert heavy.flight.armed
    assert not heavy.flight.fault(heavy.now)
    for number in range(50):
        heavy.flight.drive(Twist(0.0, 0.0, climb=0.5), heavy.now)
        heavy.step()
        heavy.motion = replace(heavy.motion, z=max(0.1, HEIGHT - 0.01 * number))
        if not heavy.flight.armed:
            break
    assert (
        heavy.flight.latched
        == "it sinks though its thrust is up: is a propeller damaged, or the load too heavy?; it lands"
    )


def test_a_take_off_that_is_broken_off_knows_nothing_of_the_flight_before() -> None:
    air = Air(ceiling=1.8)
    air.fly()
    for _ in range(100):
        air.flight.drive(Twist(0.0, 0.0, climb=0.5), air.now)
        air.step()
    assert air.motion.z == pytest.approx(1.8)
    air.flight.disarm(air.now)
    air.steps(15.0)
    assert not air.flight.aloft
    air.motion = replace(air.motion, z=0.0)
    air.steps(1.0)
    air.ask()
    while not air.flight.aloft or air.motion.z < 0.13:
        air.step()
    air.motion = replace(air.motion, x=3.0)
    air.sent.clear()
    air.asks = False
    air.steps(4.0)
    assert "its estimator has diverged" in air.flight.latched
    assert max(command.height for command in air.sent if isinstance(command, Hover)) < 0.3


def test_nothing_is_sent_before_it_reports_and_before_it_is_armed() -> None:
    air = Air()
    assert air.flight.step(0.0) == []
    assert air.flight.fault(0.0) == "it has not reported yet"
    air.steps(1.0)
    assert air.sent == []


def test_it_climbs_by_set_points_at_its_speed_from_where_the_estimator_has_the_ground() -> None:
    air = Air()
    air.ground = 0.25
    air.motion = replace(air.motion, z=0.25)
    air.fly()
    heights = [command.height for command in air.sent if isinstance(command, Hover)]
    assert {type(command) for command in air.sent} == {Arming, Hover}
    assert heights == sorted(heights)
    assert (heights[0], heights[-1]) == pytest.approx((0.25, 0.65))
    assert max(b - a for a, b in pairwise(heights)) <= 0.4 * STEP + 1e-9


def test_a_report_from_before_it_was_disarmed_is_no_permission() -> None:
    air = Air()
    air.fly()
    air.flight.disarm(air.now)
    while Arming(False) not in air.sent:
        air.step()
    air.ask()
    air.sent.clear()
    air.step()
    air.status = replace(air.status, info=Info.CAN_BE_ARMED)
    air.steps(0.4)
    assert {*air.sent} == {Arming(True)}
    assert air.flight.latched == ""


def test_arming_is_asked_for_until_it_is_granted() -> None:
    air = Air()
    air.status = replace(air.status, info=Info.CAN_BE_ARMED)
    air.step()
    air.ask()
    air.steps(1.0)
    assert air.sent == [Arming(True)] * 3, "every 0.3 s, after a step of waiting"
    air.status = replace(air.status, info=READY)
    air.steps(2.0)
    assert air.flight.armed


def test_a_command_holds_for_its_time_and_not_longer() -> None:
    air = Air()
    air.fly()
    air.flight.drive(AHEAD, air.now)
    began = air.now
    while air.now < began + 1.0:
        (command,) = air.step()
        is_fresh = air.now - began <= COMMAND_TIMEOUT
        assert command == Hover(AHEAD if is_fresh else STILL, HEIGHT)


def test_it_hovers_when_it_is_not_heard_and_lands_when_that_lasts() -> None:
    air = Air()
    air.fly()
    silent = air.now
    while air.flight.phase is Phase.FLYING:
        air.flight.drive(AHEAD, air.now)
        found = air.step(heard=False)
        if air.now - silent > 0.5 and air.flight.phase is Phase.FLYING:
            assert found == [Hover(STILL, HEIGHT)]
        assert air.now - silent < 2.0
    assert air.now - silent > 1.4
    for _ in range(round(8.0 / STEP)):
        air.step(heard=False)
    assert [command for command in air.sent if not isinstance(command, Hover)][-2:] == [Order.OFF, Arming(False)]
    assert air.flight.latched == "it has not reported for 1.5 s; it lands"


def test_it_brakes_lands_and_then_its_motors_are_off() -> None:
    air = Air()
    air.fly()
    air.flight.drive(AHEAD, air.now)
    air.step()
    air.flight.disarm(air.now)
    air.sent.clear()
    air.steps(4.0)
    assert [type(command) for command in air.sent[:2]] == [Hover, Land]
    assert air.sent[1:3] == [Land(HEIGHT / 0.2, 0.0), Order.YIELD], "it is planned, and a step later flown"
    assert {*air.sent[3:-2]} == {air.sent[1], Order.YIELD}
    assert air.sent[-2:] == [Order.OFF, Arming(False)]
    assert not air.flight.aloft
    air.sent.clear()
    air.steps(2.0)
    assert air.sent == [], "it stays on the ground"


def test_arming_while_it_lands_takes_off_again_after_it_has_landed() -> None:
    air = Air()
    air.fly()
    air.flight.disarm(air.now)
    air.step()
    air.ask()
    air.sent.clear()
    air.steps(6.0)
    assert Order.OFF in air.sent
    assert air.flight.armed


def test_the_emergency_stop_is_sent_until_the_firmware_says_that_it_is_locked() -> None:
    air = Air()
    air.fly()
    air.flight.engage()
    air.sent.clear()
    air.steps(0.2)
    assert air.sent == [Order.CUT] * 5
    with pytest.raises(RobotError, match="emergency stop"):
        air.ask()
    air.status = replace(air.status, info=Info.LOCKED)
    air.steps(0.2)
    assert len(air.sent) == 5
    assert "locked" in air.flight.fault(air.now)


def test_a_voltage_that_drops_for_a_moment_is_no_low_battery() -> None:
    air = Air()
    air.fly()
    for volts in (3.0, 3.5, 3.0, 3.5):
        air.status = replace(air.status, volts=volts)
        air.steps(1.8)
    assert air.flight.armed
    air.status = replace(air.status, volts=3.2)
    air.steps(2.2)
    assert not air.flight.armed
    assert air.flight.latched == "its battery is low, 3.20 V: charge it; it lands"


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.1, 3.1), st.integers(1, 50))
def test_motion_that_a_body_can_do_is_no_jump(vx: float, vy: float, w: float, ticks: int) -> None:
    air = Air()
    air.fly()
    for _ in range(ticks):
        own = air.motion
        yaw = math.remainder(own.yaw + w * STEP, math.tau)
        air.motion = replace(own, x=own.x + vx * STEP, y=own.y + vy * STEP, yaw=yaw)
        air.step()
    assert air.flight.latched == ""


CALLS = {
    "arm": lambda air: air.flight.arm(air.now),
    "disarm": lambda air: air.flight.disarm(air.now),
    "drive": lambda air: air.flight.drive(AHEAD, air.now),
    "stop": lambda air: air.flight.stop(),
    "cut": lambda air: air.flight.engage(),
    "release": lambda air: air.flight.release(),
    "lose": lambda air: air.flight.lose("it is broken"),
    "wait": lambda air: air.steps(1.0),
}


@settings(max_examples=100)
@given(st.lists(st.sampled_from([*CALLS])))
def test_whatever_is_called_nothing_flies_that_was_not_armed_or_is_cut(calls: list[str]) -> None:
    air = Air()
    air.step()
    wanted = False
    for call in calls:
        wanted = (wanted or call == "arm") and call not in ("cut", "lose")
        with suppress(RobotError):
            CALLS[call](air)
        for _ in range(10):
            sent = air.step()
            flies = [command for command in sent if isinstance(command, Hover | Land)]
            assert wanted or not flies
            assert air.flight.engaged == (sent == [Order.CUT])
            assert not (air.flight.engaged and air.flight.armed)


def test_log_blocks_become_reports_in_the_units_of_vrg() -> None:
    names = ("x", "y", "z", "vx", "vy", "yaw")
    values = {f"stateEstimate.{name}": float(n) for n, name in enumerate(names)}
    motion = motion_of({**values, "stateEstimate.yaw": 90.0, "stateEstimateZ.rateYaw": 500}, 7.0)
    assert (motion.heard, motion.x, motion.y, motion.z, motion.w) == (7.0, 0.0, 1.0, 2.0, 0.5)
    assert motion.yaw == pytest.approx(math.pi / 2)
    assert (motion.twist.v, motion.twist.side) == pytest.approx((4.0, -3.0))
    told = {"supervisor.info": 0x24, "pm.vbat": 3.9, "pm.state": 3, "pm.batteryLevel": 250, "stabilizer.thrust": 1.0}
    assert status_of(told, 7.0) == Status(7.0, Info.AUTO_ARM | Info.TUMBLED, 3.9, 3, 1.0, 1.0)


@given(st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30))
def test_a_heading_is_unwrapped(turns: list[float]) -> None:
    way, yaw = Way(), 1.0
    start = Motion(0.0, 1.0, 2.0, 0.0, 0.0, 0.0, yaw, 0.0)
    way.move(start)
    assert way.pose == Pose(0.0, 0.0, 0.0)
    for turn in turns:
        yaw += turn
        way.move(replace(start, yaw=math.remainder(yaw, math.tau)))
    assert way.pose.theta == pytest.approx(yaw - 1.0)
