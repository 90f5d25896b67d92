"""The lives of single robots by seeds; `vrg fuzz --protocol all` plays as many as one likes."""

import pytest

from vrg.hal.can.base import DriveBase
from vrg.hal.can.guard import Guard
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.silence import DriveSilence
from vrg.hal.can.machine import StateMachine
from vrg.testing.command_line import invoke
from vrg_faults.command import lived
from vrg_faults.robot.life import Counterexample, Life

PROTOCOLS = ("odrive", "cia402", "moteus", "vesc")
LIVES = 2
"""The lives of robots of each protocol; `make test-all` plays a thousand."""
SEARCHED = 40
"""The lives in which broken code must be found."""


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_motors_stand_or_the_fault_is_reported(protocol: str) -> None:
    findings = [line for seed in range(LIVES) for line in lived(protocol, seed)]
    assert not findings, "\n".join(findings)


def test_a_seed_is_the_same_life_every_time() -> None:
    lives: list[list[str]] = [[], []]
    for told in lives:
        assert Life("odrive", 3, told.append).run() is None
    assert lives[0] == lives[1]
    assert lives[0]


def latches_for_no_reason(guard: Guard, heard_until: float) -> Reason | None:
    """A guard that has a fault after a while in which nothing is wrong."""
    late = guard.armed_by_player and heard_until - guard.start.armed_at > 1.5
    return Reason(0, Cause.REPORTED, ("no reason at all",)) if late else None


@pytest.mark.parametrize(
    ("where", "name", "instead"),
    [
        (StateMachine, "_estimate", lambda *_: None),
        (Guard, "_problem", latches_for_no_reason),
        (DriveBase, "update", lambda _self, _node, _estimate, _turns: 0.0),
        (DriveSilence, "judge", lambda *_: None),
    ],
    ids=["believes its encoders", "false alarms", "does not count", "waits for who is silent"],
)
def test_code_that_is_broken_is_found(
    monkeypatch: pytest.MonkeyPatch, where: object, name: str, instead: object
) -> None:
    monkeypatch.setattr(where, name, instead)
    assert any(lived("moteus", seed) for seed in range(SEARCHED))


def test_what_is_found_is_one_line_and_can_be_played_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StateMachine, "_estimate", lambda *_: None)
    lives = (Life("moteus", seed).run() for seed in range(SEARCHED))
    first: Counterexample = next(found for found in lives if found is not None)
    again = invoke("fuzz", "--protocol", "moteus", "--games", "1", "--seed", str(first.seed))
    assert again.exit_code == 1
    assert str(first) in again.output
    assert f"--protocol moteus --seed {first.seed}: episode {first.episode}, at {first.time:.2f} s: " in again.output
    assert again.output.count("\n    ") > 3, "a single life is told step by step"


def test_the_command_plays_many_lives_and_refuses_what_makes_no_sense() -> None:
    many = invoke("fuzz", "--protocol", "vesc", "--protocol", "odrive", "--games", "2")
    assert many.exit_code == 0, many.output
    assert "robots: 4, from seed 0 on; in 0 something did not hold" in many.output
    for wrong in ([], ["sharks-and-minnows", "--protocol", "vesc"]):
        assert "either a match or --protocol" in invoke("fuzz", *wrong).output
    assert "did you mean 'vesc'?" in str(invoke("fuzz", "--protocol", "vesk").exception)
