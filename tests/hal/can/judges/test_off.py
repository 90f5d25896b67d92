"""Drives that were ordered to be off."""

import pytest

from tests.hal.can.judges.drives import NOW, report, started
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.off import COAST_TIMEOUT, OBEY_TIMEOUT, OFF_PERIOD, Off
from vrg.hal.can.judges.reasons import Cause


def turning(velocity: float = 10.0) -> AxisReport:
    axis = started()
    axis.velocity = velocity
    return axis


def ordered(axis: AxisReport) -> Off:
    """The judge of a robot that was armed, and is ordered to be off at NOW."""
    off = Off()
    off.arm()
    off.order([axis], NOW)
    return off


def test_only_a_report_after_the_order_confirms_it() -> None:
    axis = report()
    off = ordered(axis)
    assert not off.confirmed([axis])
    axis.reported_at = NOW + 0.01
    assert off.confirmed([axis])
    assert not off.confirmed([axis, started(2)])


def test_the_order_is_due_again_until_it_is_confirmed() -> None:
    axis = report()
    off = ordered(axis)
    assert not off.due([axis], NOW + OFF_PERIOD / 2)
    assert off.due([axis], NOW + OFF_PERIOD * 1.01)
    axis.reported_at = NOW + 0.01
    assert not off.due([axis], NOW + OFF_PERIOD * 1.01)


def test_one_that_says_for_too_long_that_it_is_on() -> None:
    axis = started(6)
    off = ordered(axis)
    assert off.judge([axis], NOW) is None
    axis.reported_at = NOW + OBEY_TIMEOUT + 0.01
    assert off.judge([axis], NOW + OBEY_TIMEOUT + 0.01) == (6, Cause.ON, ())
    assert off.reason is not None
    off.begin()
    assert off.reason is None
    assert off.judge([axis], NOW + OBEY_TIMEOUT + 0.02) is None, "it is counted anew"


@pytest.mark.parametrize(
    ("velocity", "way", "after", "found"),
    [
        (10.0, 10.0, COAST_TIMEOUT + 0.01, True),
        (10.0, 10.0, COAST_TIMEOUT, False),
        (8.0, 9.0, COAST_TIMEOUT + 0.01, False),
        (10.0, 1.0, COAST_TIMEOUT + 0.01, False),
    ],
    ids=["it turns on", "it has time yet", "it becomes slower", "its encoder tells a speed and no way"],
)
def test_a_motor_that_turns_on(velocity: float, way: float, after: float, found: bool) -> None:
    axis = turning()
    off = ordered(axis)
    axis.on, axis.velocity, axis.position, axis.measured = False, velocity, way, NOW + after
    assert off.judge([axis], NOW + after) == ((1, Cause.TURNS, (velocity,)) if found else None)
    assert off.confirmed([axis]) is False


def test_a_motor_coasts_from_the_first_order_on_and_not_from_each() -> None:
    axis = turning()
    off = ordered(axis)
    axis.position = 5.0
    off.order([axis], NOW + 0.5)
    axis.on, axis.position, axis.measured = False, 10.0, NOW + COAST_TIMEOUT + 0.01
    assert off.judge([axis], axis.measured) is not None


def test_a_motor_that_has_become_slower_may_be_pushed() -> None:
    axis = turning()
    off = ordered(axis)
    axis.on, axis.velocity = False, 1.0
    assert off.judge([axis], NOW + 0.1) is None
    axis.velocity, axis.position, axis.measured = 20.0, 30.0, NOW + 3.0
    assert off.judge([axis], NOW + 3.0) is None
