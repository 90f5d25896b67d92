"""Drives that were asked to start, and a computer that may be too busy to let them."""

import pytest

from tests.hal.can.judges.drives import NOW, report, started
from vrg.hal.can.axis import NEVER, AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.start import FAILED_STARTS, LATE, SETPOINT_TIMEOUT, START_TIMEOUT, STATUS_GRACE, DriveStart

DUE = NOW + START_TIMEOUT + 0.01


@pytest.fixture
def start() -> DriveStart:
    """Of a robot that is armed at NOW."""
    start = DriveStart()
    start.arm(NOW)
    return start


def cause(found: Reason | None) -> Cause | None:
    return None if found is None else found.cause


def test_a_drive_may_take_its_time_and_not_longer(start: DriveStart) -> None:
    assert start.judge(report(), NOW + START_TIMEOUT, NEVER) is None
    assert start.judge(report(4), DUE, NEVER) == (4, Cause.IDLE, ())
    assert start.judge(report(), DUE, excused=NOW + 0.1) is None, "it was not heard meanwhile"
    assert start.judge(started(), DUE, NEVER) is None


def test_one_that_has_started_may_not_be_idle_again(start: DriveStart) -> None:
    axis = started()
    start.look([axis], NOW)
    assert not start.started, "what it has said before it was asked is no answer"
    axis.expiry_reported = True
    start.look([axis], NOW + 0.01)
    assert start.started == {1}
    assert not axis.expiry_reported
    assert cause(start.judge(report(), NOW + 0.02, NEVER)) is Cause.IDLE
    start.arm(NOW + 0.02)
    assert not start.started


def test_who_is_to_blame_that_a_drive_is_off(start: DriveStart) -> None:
    refusing = report()
    refusing.refusal = "NOT_CALIBRATED"
    start.command(NOW + 0.5)
    assert start.judge(report(), DUE, NEVER) == (1, Cause.NO_SETPOINTS, (0.5,))
    assert start.judge(refusing, DUE, NEVER) == (1, Cause.REFUSES, ("NOT_CALIBRATED",))
    expired = report()
    expired.watchdog_expired = True
    assert start.judge(expired, DUE, NEVER) is None, "it has another reason"


@pytest.mark.parametrize(
    ("gap", "late", "busy"), [(LATE, False, False), (LATE + 0.01, True, False), (SETPOINT_TIMEOUT + 0.01, True, True)]
)
def test_setpoints_that_come_late(start: DriveStart, gap: float, late: bool, busy: bool) -> None:
    now = NOW + gap
    assert start.uncommanded(now) == pytest.approx(gap)
    start.command(now)
    assert (start.late(now), start.busy(now)) == (late, busy)
    for _ in range(20):
        now += 0.06
        start.command(now)
    assert (start.late(now), start.busy(now)) == (False, False), "that was long ago"
    assert start.late(now + LATE + 0.01), "the next one is late already"


def test_earlier_setpoints_do_not_count_for_a_robot_that_is_armed_anew(start: DriveStart) -> None:
    start.command(NOW + 0.5)
    start.arm(NOW + 5.0)
    assert start.uncommanded(NOW + 5.0) == 0.0
    assert not start.late(NOW + 5.0)


def test_a_watchdog_has_expired_unless_it_was_to_or_tells_of_before(start: DriveStart) -> None:
    axes: list[AxisReport] = [started(0), report(1)]
    axes[1].watchdog_expired = True
    assert start.judge_watchdogs(axes, NOW + STATUS_GRACE, proved=()) is None
    assert start.judge_watchdogs(axes, NOW + STATUS_GRACE + 0.01, proved={1}) is None
    assert start.judge_watchdogs(axes, NOW + STATUS_GRACE + 0.01, proved=()) == (1, Cause.EXPIRED, ())


def test_a_drive_that_never_starts_hears_nothing(start: DriveStart) -> None:
    found = [start.judge_failed(1) for _ in range(FAILED_STARTS)]
    assert found == [*[None] * (FAILED_STARTS - 1), (1, Cause.NEVER_STARTS, (FAILED_STARTS,))]
    start.begin()
    assert start.judge_failed(1) is None, "a person has mended its wires"
    assert [bool(start.judge_failed(1)) for _ in range(FAILED_STARTS - 1)][-1]
    start.look([started()], NOW + 0.01)
    assert start.judge_failed(1) is None, "they are counted in a row"
