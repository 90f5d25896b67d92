"""What all emulated drives share: the motor, and what is due again and again."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.workshop.emulated import Cycle
from vrg.hal.can.workshop.motor import Motor, MotorModel


class TestMotor:
    @given(st.floats(-60, 60), st.floats(0.05, 2.0))
    def test_it_reaches_what_it_is_told_within_its_current(self, target: float, seconds: float) -> None:
        motor = Motor(MotorModel())
        model = motor.model
        fastest = model.current_limit * model.torque_constant / model.inertia / (2 * math.pi)
        before = 0.0
        for _ in range(round(seconds / 0.01)):
            motor.turn(0.01, target)
            assert abs(motor.velocity - before) <= fastest * 0.01 * 1.001
            assert abs(motor.current) <= model.current_limit
            before = motor.velocity
        if seconds > 0.2 + abs(target) / fastest * 1.5:
            assert motor.velocity == pytest.approx(target, abs=0.05 + abs(target) * 0.02)

    def test_a_load_makes_it_slower(self) -> None:
        light, heavy = Motor(MotorModel()), Motor(MotorModel(inertia=MotorModel().inertia * 5))
        for motor in (light, heavy):
            motor.turn(0.2, 50.0)
        assert heavy.velocity < light.velocity / 2

    def test_shorted_phases_brake_it_to_a_halt(self) -> None:
        motor = Motor(MotorModel())
        motor.velocity = 50.0
        motor.coast(0.3)
        assert abs(motor.velocity) < 0.01
        assert motor.position == pytest.approx(50.0 * motor.model.braking, rel=0.01)

    def test_the_velocity_limit_holds(self) -> None:
        motor = Motor(MotorModel(velocity_limit=10.0))
        motor.turn(1.0, 50.0)
        assert motor.velocity <= 10.05

    def test_friction_holds_it_against_a_little_torque(self) -> None:
        motor = Motor(MotorModel())
        motor.pull(1.0, motor.model.friction * 0.9)
        assert motor.velocity == 0.0


def test_a_cycle_that_was_late_does_not_make_up() -> None:
    cycle = Cycle(0.1, 0.0)
    assert cycle.due(5.0)
    assert not cycle.due(5.04)
    assert cycle.due(5.06)
    assert not Cycle(0.0, 0.0).due(1e9)


def test_a_motor_with_a_delay_does_the_same_later() -> None:
    """Whatever the steps are in which time passes, and switched off it forgets what it was asked for."""
    early, late = Motor(MotorModel()), Motor(MotorModel(delay=0.05))
    for motor, begin in ((early, 0.05), (late, 0.0)):
        for n in range(100):
            now = 0.004 * n
            motor.turn(0.004, 20.0 if begin - 1e-9 <= now < begin + 0.2 - 1e-9 else 0.0)
    assert late.position == pytest.approx(early.position, rel=0.02)
    assert early.position > 1.0
    late.turn(0.01, 20.0)
    late.coast(0.5)
    before = late.position
    late.turn(0.04, 0.0)
    late.turn(0.04, 0.0)
    assert late.position == pytest.approx(before, abs=1e-6)
