"""Watchdogs of drives that must stop their motors once."""

import pytest

from tests.hal.can.judges.drives import started
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.proof import PROOF_TIMEOUT, PROOFS, ProofStep, WatchdogProof
from vrg.hal.can.judges.reasons import Cause, Reason

IN_TIME, TOO_LATE = PROOF_TIMEOUT, PROOF_TIMEOUT + 0.01
BOTH = {0, 1}


@pytest.fixture
def axes() -> list[AxisReport]:
    return [started(0), started(1)]


def expire(*axes: AxisReport) -> None:
    for axis in axes:
        axis.expiry_reported = True


def look(
    proof: WatchdogProof, axes: list[AxisReport], uncommanded: float, *, disturbed: bool = False
) -> ProofStep | Reason:
    return proof.judge(axes, BOTH, uncommanded, disturbed=disturbed)


def test_they_are_proved_once_all_have_expired_in_time(axes: list[AxisReport]) -> None:
    proof = WatchdogProof()
    expire(axes[0])
    assert look(proof, axes, IN_TIME) is ProofStep.WAIT
    expire(axes[1])
    assert look(proof, axes, IN_TIME) is ProofStep.PROVED
    assert not proof.pending
    assert proof.proved == BOTH


def test_an_expiry_that_comes_too_late_or_before_the_start_proves_nothing(axes: list[AxisReport]) -> None:
    expire(*axes)
    assert look(WatchdogProof(), axes, TOO_LATE) is ProofStep.AGAIN
    proof = WatchdogProof()
    assert proof.judge(axes, {0}, IN_TIME, disturbed=False) is ProofStep.WAIT
    assert proof.judge(axes, {0}, TOO_LATE, disturbed=False) is ProofStep.WAIT, "setpoints are not withheld yet"


def test_it_is_tried_again_and_then_given_up(axes: list[AxisReport]) -> None:
    proof = WatchdogProof()
    expire(axes[0])
    look(proof, axes, IN_TIME)
    assert [look(proof, axes, TOO_LATE) for _ in range(PROOFS - 1)] == [ProofStep.AGAIN] * (PROOFS - 1)
    assert look(proof, axes, TOO_LATE) == (1, Cause.UNPROVED, (PROOF_TIMEOUT,))


def test_a_drive_that_had_no_chance_is_tried_again_at_no_cost(axes: list[AxisReport]) -> None:
    proof = WatchdogProof()
    for _ in range(10):
        assert look(proof, axes, TOO_LATE, disturbed=True) is ProofStep.AGAIN


def test_a_watchdog_that_has_worked_before_is_not_missing(axes: list[AxisReport]) -> None:
    proof = WatchdogProof()
    expire(*axes)
    look(proof, axes, IN_TIME)
    proof.doubt(axes)
    proof.proved.clear()
    assert proof.pending
    assert [look(proof, axes, TOO_LATE) for _ in range(PROOFS)][-1] == (0, Cause.UNPROVED_NOW, (PROOF_TIMEOUT,))
    proof.begin(axes)
    assert [look(proof, axes, TOO_LATE) for _ in range(PROOFS)][-1] == (0, Cause.UNPROVED, (PROOF_TIMEOUT,))


def test_who_has_no_watchdog_need_not_prove_it(axes: list[AxisReport]) -> None:
    proof = WatchdogProof()
    axes[0].unwatched = True
    proof.begin(axes)
    assert proof.pending
    expire(axes[1])
    assert look(proof, axes, IN_TIME) is ProofStep.PROVED
    axes[1].unwatched = True
    proof.begin(axes)
    assert not proof.pending
