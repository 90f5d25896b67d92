"""Setpoint, measured speed and measured position of one motor, compared."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.plausibility import FOLLOWING_TIMEOUT, STALL_TIMEOUT, MotorLimits, Plausibility
from vrg.hal.can.workshop.motor import Motor, MotorModel

BOUNDS = MotorLimits(speed=50.0, change=24.0)
STEP = 0.01


class Rig:
    """A motor, setpoints at 10 Hz, and estimates at 100 Hz that pass through what is wrong with the encoder."""

    def __init__(self, says: Callable[[float, float], tuple[float, float]] = lambda p, v: (p, v)) -> None:
        self.motor = Motor(MotorModel())
        self.says = says
        self.now = 10.0
        self.check = Plausibility(BOUNDS)
        self.alone = False
        self._last: float | None = None
        self._asked = 0.0

    def run(self, setpoint: float, seconds: float, *, on: bool = True) -> str:
        """Let time pass; the first complaint, empty where there is none."""
        end = self.now + seconds
        while self.now < end:
            if self.now >= self._asked + 0.1:
                self._asked = self.now
                self.check.ask(setpoint, self.now)
            self.now += STEP
            if on:
                self.motor.turn(STEP, setpoint)
            else:
                self.motor.coast(STEP)
            problem = self.look(on)
            if problem:
                return problem
        return ""

    def look(self, on: bool = True) -> str | None:
        position, velocity = self.says(self.motor.position, self.motor.velocity)
        way = 0.0 if self._last is None else position - self._last
        self._last = position
        return self.check.judge(velocity, way, self.now, driven=on, alone=self.alone)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(0.1, 2.0)), min_size=1, max_size=8), st.floats(0.01, 0.4))
def test_a_motor_that_obeys_is_never_accused(orders: list[tuple[float, float]], response: float) -> None:
    rig = Rig()
    rig.motor = Motor(MotorModel(response=response))
    for setpoint, seconds in orders:
        assert not rig.run(setpoint, seconds)


@given(
    st.lists(st.tuples(st.floats(-50, 50), st.floats(0.1, 2.0)), min_size=1, max_size=8),
    st.floats(BOUNDS.change, 1000.0),
)
def test_nor_is_a_drive_with_gentle_ramps(orders: list[tuple[float, float]], change: float) -> None:
    check = Plausibility(BOUNDS)
    now, position, velocity = 10.0, 0.0, 0.0
    for setpoint, seconds in orders:
        check.ask(setpoint, now)
        for _ in range(round(seconds / STEP)):
            now += STEP
            before = velocity
            velocity += max(-change * STEP, min(change * STEP, setpoint - velocity))
            way = (before + velocity) / 2 * STEP
            position += way
            assert check.judge(velocity, way, now, driven=True) is None


def complaint(
    says: Callable[[float, float], tuple[float, float]], setpoint: float = 20.0, seconds: float = 5.0
) -> tuple[str, float]:
    """What is said, and how long the motor was on before."""
    rig = Rig(says)
    return rig.run(setpoint, seconds), rig.now - 10.0


@pytest.mark.parametrize("setpoint", [10.0, -10.0, 50.0])
def test_a_reversed_encoder(setpoint: float) -> None:
    words, after = complaint(lambda p, v: (-p, -v), setpoint)
    assert "the wrong way round" in words
    assert f"asked for {setpoint:.3g}" in words
    assert after < FOLLOWING_TIMEOUT + 0.3


@pytest.mark.parametrize(("slowest", "words"), [(2.5, ""), (0.0, "it runs away")])
def test_below_the_least_speed_that_its_drive_regulates_a_motor_at_rest_may_creep(slowest: float, words: str) -> None:
    """A VESC that is asked for nothing brakes below it, so that a robot on a slope rolls slowly."""
    rig = Rig(lambda p, v: (2.0 * rig.now, 2.0))
    rig.check = Plausibility(BOUNDS, slowest)
    assert words in (said := rig.run(0.0, 3.0))
    assert bool(said) == bool(words)


def test_a_motor_that_runs_away() -> None:
    rig = Rig()
    assert not rig.run(10.0, 1.0)
    rig.motor.excess = 3
    assert "it runs away" in rig.run(10.0, 2.0)
    assert rig.now - 11.0 < FOLLOWING_TIMEOUT + 0.3


def test_a_wheel_that_is_blocked_may_be_so_for_a_moment() -> None:
    rig = Rig()
    assert not rig.run(10.0, 1.0)
    rig.motor.blocked = True
    assert not rig.run(10.0, STALL_TIMEOUT - 0.1)
    assert "it stands still, though asked for 10 turn/s" in rig.run(10.0, 1.0)


@pytest.mark.parametrize(("share", "setpoint", "within"), [(0.5, 7.2, 3.0), (0.0, 2.2, 1.2), (2.0, 3.0, 2.0)])
def test_a_way_is_judged_where_a_speed_could_still_be(share: float, setpoint: float, within: float) -> None:
    """Half its speed, a blocked wheel at a crawl, and one that is too fast."""
    rig = Rig()
    assert not rig.run(setpoint, 3.0)
    turn = rig.motor.turn
    rig.motor.turn = lambda dt, velocity: turn(dt, share * velocity)  # type: ignore[method-assign]
    assert f"asked for {setpoint:.3g}" in rig.run(setpoint, within)


def test_a_motor_that_is_to_stand_does_not_creep() -> None:
    rig = Rig()
    assert not rig.run(20.0, 1.0)
    turn = rig.motor.turn
    rig.motor.turn = lambda dt, velocity: turn(dt, velocity or 1.5)  # type: ignore[method-assign]
    assert "it turns at 1.5 turn/s, though it was asked for 0: it runs away" in rig.run(0.0, 4.0)


@pytest.mark.parametrize("period", [STEP, 0.05, 0.2])
def test_an_encoder_that_jumps_to_and_fro(period: float) -> None:
    """Each jump is taken back, and the robot has meanwhile steered by it."""
    rig = Rig(lambda p, v: (p + 4.0 * (rig.now % (2 * period) < period), v))
    assert "its position jumped to and fro 3 times within 10 s" in rig.run(20.0, 3.0)


def test_one_frame_that_is_late_for_once_is_no_jump() -> None:
    rig = Rig()
    assert not rig.run(40.0, 1.0)
    behind = rig.motor.position
    assert not rig.run(40.0, 0.1)
    rig.says = lambda _p, v: (behind, v)
    assert not rig.look()
    rig.says = lambda p, v: (p, v)
    assert not rig.run(40.0, 3.0)


@pytest.mark.parametrize("then", [-20.0, 0.0, 5.0])
def test_a_drive_that_obeys_no_setpoints_any_more(then: float) -> None:
    rig = Rig()
    assert not rig.run(20.0, 1.0)
    turn = rig.motor.turn
    rig.motor.turn = lambda dt, _: turn(dt, 20.0)  # type: ignore[method-assign]
    assert f"it still turns at 20 turn/s, though it was asked for {then:.3g}" in rig.run(then, 2.0)


def test_one_that_trembles_at_rest_stands() -> None:
    rig = Rig(lambda p, v: (p, v + 0.4 * math.sin(100.0 * rig.now)))
    assert not rig.run(0.0, 5.0)


def test_a_wheel_that_stands_alone_turns_the_robot() -> None:
    rig = Rig()
    assert not rig.run(20.0, 1.0)
    rig.motor.blocked = rig.alone = True
    assert not rig.run(20.0, FOLLOWING_TIMEOUT - 0.1)
    assert "it stands still, though asked for 20 turn/s" in rig.run(20.0, 0.2)


def test_a_drive_that_does_not_turn_so_slowly_may_stand() -> None:
    rig = Rig()
    rig.check = Plausibility(BOUNDS, slowest=6.0)
    rig.motor.blocked = True
    assert not rig.run(5.0, 5.0)
    assert not rig.run(-5.0, 5.0)
    assert "it stands still, though asked for 7 turn/s" in rig.run(7.0, 3.0)


def test_a_weak_motor_is_not_the_wrong_way_round() -> None:
    rig = Rig()
    assert not rig.run(40.0, 2.0)
    rig.motor.current_limit *= 0.05
    assert "and is slow to change it: is its current limited" in rig.run(-40.0, 3.0)


@pytest.mark.parametrize(("slip", "setpoint", "metres"), [(0.15, 24.0, 1.0), (0.15, 8.0, 1.0), (0.1, 40.0, 1.5)])
def test_an_encoder_that_slips_a_little_is_found_on_its_way(slip: float, setpoint: float, metres: float) -> None:
    """A metre is 72 turns of this motor."""
    words, after = complaint(lambda p, v: (p * (1.0 - slip), v), setpoint, 20.0)
    assert "the encoder slips" in words
    assert after * setpoint < 72 * metres


def test_a_motor_that_is_off_may_stand_and_be_pushed() -> None:
    rig = Rig()
    assert not rig.run(10.0, 2.0, on=False)
    rig.motor.velocity = 20.0
    rig.motor.model = MotorModel(braking=100.0)
    assert not rig.run(0.0, 2.0, on=False)


def test_a_motor_that_coasts_when_it_is_started_is_given_time() -> None:
    rig = Rig()
    rig.motor.velocity = -40.0
    assert not rig.run(40.0, 3.0)


@pytest.mark.parametrize(("scale", "words"), [(60.0, "runs away, or the drive's units"), (1 / 60, "other units than")])
def test_a_drive_whose_speed_has_other_units(scale: float, words: str) -> None:
    assert words in complaint(lambda p, v: (p, v * scale), 5.0)[0]


@pytest.mark.parametrize("scale", [0.5, 2.0, -1.0, 0.0])
def test_a_position_that_does_not_follow_the_speed(scale: float) -> None:
    words, after = complaint(lambda p, v: (p * scale, v), 40.0)
    assert "than its speed says" in words
    assert after < 2.0


@pytest.mark.parametrize("turns", [3.0, -3.0, 8.0])
@pytest.mark.parametrize("speed", [0.0, 22.0, -22.0, 40.0])
@pytest.mark.parametrize("on", [True, False])
def test_a_jump_that_nothing_takes_back(turns: float, speed: float, on: bool) -> None:
    rig = Rig()
    assert not rig.run(speed, 2.0)
    rig.says = lambda p, v: (p + turns, v)
    assert f"its position jumped by {turns:+.3g} turns: is its encoder loose" in rig.run(speed, 2.0, on=on)


@pytest.mark.parametrize(
    ("speed", "turns", "seconds"),
    [(40.0, -4.0, 0.1), (0.0, 6.0, 0.2), (40.0, 6.0, 0.2)],
    ids=["no slip", "at rest", "under way"],
)
def test_a_jump_that_is_taken_back_was_a_frame_that_came_late(speed: float, turns: float, seconds: float) -> None:
    rig = Rig()
    assert not rig.run(speed, 1.0)
    rig.says = lambda p, v: (p + turns, v)
    assert not rig.run(speed, seconds)
    rig.says = lambda p, v: (p, v)
    assert not rig.run(speed, 2.0)


@pytest.mark.parametrize("speed", [1e38, -1e38, 501.0])
@pytest.mark.parametrize("driven", [True, False])
def test_a_speed_that_no_motor_has_is_told_at_once(speed: float, driven: bool) -> None:
    check = Plausibility(BOUNDS)
    assert check.judge(0.0, 0.0, 1.0, driven=driven) is None
    assert "turn/s, where this robot's motors reach 50" in (check.judge(speed, 0.0, 1.01, driven=driven) or "")
    assert check.judge(0.0, 0.0, 1.02, driven=driven) is None, "it leaves no trace"


def test_while_nothing_is_heard_nothing_is_judged() -> None:
    rig = Rig()
    assert not rig.run(20.0, 1.0)
    rig.check.ask(-20.0, rig.now)
    rig.now += 3.0
    assert rig.look() is None, "one old frame after a silence proves nothing"


def test_setpoints_are_compared_with_what_was_measured_after_them() -> None:
    """The bus is read late: the newest setpoint was sent after all that waits to be read was measured."""
    check = Plausibility(BOUNDS)
    check.ask(20.0, 0.0)
    check.ask(-20.0, 3.0)
    for tick in range(1, 300):
        velocity = min(20.0, 0.4 * tick)
        assert check.judge(velocity, velocity * STEP, tick * STEP, driven=True) is None


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(-1e9, 1e9), st.floats(0, 1e6))
def test_no_number_is_too_strange(velocity: float, way: float, at: float) -> None:
    check = Plausibility(BOUNDS)
    check.ask(1.0, 0.0)
    for driven in (False, True, True):
        check.judge(velocity, way, at, driven=driven)
        check.judge(0.0, None, at + 0.01, driven=driven)
    assert math.isfinite(check._off)
