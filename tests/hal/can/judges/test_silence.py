"""Drives that are not heard, by frames and times alone."""

import math

import pytest

from tests.hal.can.judges.drives import NOW, report
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.silence import DROPOUT, DROPOUT_WINDOW, DROPOUTS, HEARTBEAT_TIMEOUT, DriveSilence

DISARMED = math.inf
LATER = NOW + HEARTBEAT_TIMEOUT + 0.01


def cause(found: Reason | None) -> Cause | None:
    return None if found is None else found.cause


def test_a_heartbeat_may_be_missing_for_a_while_and_not_longer() -> None:
    assert DriveSilence().judge(report(), NOW + HEARTBEAT_TIMEOUT, DISARMED) is None
    assert DriveSilence().judge(report(7), LATER, DISARMED) == (7, Cause.NO_HEARTBEAT, (HEARTBEAT_TIMEOUT,))


def test_silence_of_before_a_persons_act_does_not_count() -> None:
    silence = DriveSilence()
    silence.begin(LATER)
    assert silence.judge(report(), LATER, DISARMED) is None


@pytest.mark.parametrize(("armed_at", "expected"), [(DISARMED, None), (NOW - 1.0, Cause.NO_REPORT), (LATER, None)])
def test_only_a_drive_of_a_robot_that_is_armed_must_say_whether_it_is_on(
    armed_at: float, expected: Cause | None
) -> None:
    axis = report()
    axis.heard = LATER
    assert cause(DriveSilence().judge(axis, LATER, armed_at)) is expected


def test_an_encoder_is_missed_only_of_a_drive_that_is_heard() -> None:
    axis = report()
    assert DriveSilence().judge_encoder(axis, LATER) is None, "it is silent altogether, which is another fault"
    axis.heard = LATER
    assert cause(DriveSilence().judge_encoder(axis, LATER)) is Cause.NO_ENCODER


def test_what_makes_no_sense_stands_before_all_silence() -> None:
    axis = report()
    axis.implausible = "rubbish"
    assert DriveSilence().judge(axis, LATER, NOW) == (1, Cause.REPORTED, ("rubbish",))


def test_a_moment_is_told_of_a_drive_that_is_not_heard_or_does_not_hear() -> None:
    axis = report()
    assert DriveSilence().judge_moment(axis, NOW + DROPOUT - 0.01) is None
    assert cause(DriveSilence().judge_moment(axis, NOW + DROPOUT + 0.01)) is Cause.QUIET
    axis.measured = NOW + DROPOUT
    assert DriveSilence().judge_moment(axis, NOW + DROPOUT + 0.01) is None, "its encoder is heard"
    axis.deaf = True
    assert cause(DriveSilence().judge_moment(axis, NOW)) is Cause.DEAF


def test_a_process_that_did_not_run_excuses_each_kind_of_message_once() -> None:
    silence, axis = DriveSilence(), report()
    silence.catch_up([axis], LATER)
    assert silence.disturbed
    assert silence.judge(axis, LATER, DISARMED) is None
    silence.catch_up([axis], LATER + HEARTBEAT_TIMEOUT)
    assert cause(silence.judge(axis, LATER + HEARTBEAT_TIMEOUT + 0.01, DISARMED)) is Cause.NO_HEARTBEAT


@pytest.mark.parametrize(
    ("pause", "expected"),
    [(1.0, Cause.WIRES), (DROPOUT_WINDOW, None), (DROPOUT / 2, None)],
    ids=["again and again", "seldom", "one long moment"],
)
def test_wires_that_fail_too_often(pause: float, expected: Cause | None) -> None:
    silence = DriveSilence()
    found = [silence.judge_wires(1, NOW + pause * number) for number in range(DROPOUTS)]
    assert cause(found[-1]) is expected
    assert not any(found[:-1])
    silence.begin(NOW)
    assert silence.judge_wires(1, NOW + pause * DROPOUTS) is None, "a person has mended them"
