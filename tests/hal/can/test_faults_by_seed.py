"""Seeded sequences of faults; `python -m vrg.testing.can_faults` has as many as one likes."""

import pytest

from vrg.hal.can import guard
from vrg.hal.can.base import DriveBase
from vrg.hal.can.guard import Guard
from vrg.hal.can.machine import StateMachine
from vrg.testing.can_faults.__main__ import main
from vrg.testing.can_faults.life import Life, live

PROTOCOLS = ("odrive", "cia402", "moteus", "vesc")
LIVES = 2
"""The lives of robots of each protocol; `make test-all` plays a thousand."""
SEARCHED = 40
"""The lives in which broken code must be found."""


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_motors_stand_or_the_fault_is_reported(protocol: str) -> None:
    findings = [live((protocol, seed)) for seed in range(LIVES)]
    assert not any(findings), "\n".join(str(finding) for finding in findings if finding is not None)


def test_a_seed_is_the_same_life_every_time() -> None:
    lives: list[list[str]] = [[], []]
    for told in lives:
        assert Life("odrive", 3, told.append).run() is None
    assert lives[0] == lives[1]
    assert lives[0]


def latches_for_no_reason(guard: Guard, heard_until: float) -> str | None:
    """A guard that has a fault after a while in which nothing is wrong."""
    return "no reason at all" if guard.armed_by_player and heard_until - guard.armed_at > 1.5 else None


@pytest.mark.parametrize(
    ("where", "name", "instead"),
    [
        (StateMachine, "_estimate", lambda *_: None),
        (Guard, "_problem", latches_for_no_reason),
        (DriveBase, "update", lambda _self, _node, _estimate, _turns: 0.0),
        (guard, "HEARTBEAT_TIMEOUT", 1e9),
    ],
    ids=["believes its encoders", "false alarms", "does not count", "waits for heartbeats"],
)
def test_code_that_is_broken_is_found(
    monkeypatch: pytest.MonkeyPatch, where: object, name: str, instead: object
) -> None:
    monkeypatch.setattr(where, name, instead)
    assert any(live(("moteus", seed)) for seed in range(SEARCHED))


def test_what_is_found_is_one_line_and_can_be_told_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(StateMachine, "_estimate", lambda *_: None)
    first = next(found for seed in range(SEARCHED) if (found := live(("moteus", seed))) is not None)
    assert main(["--protocol", "moteus", "--seed", str(first.seed)]) == 1
    printed = capsys.readouterr().out
    assert str(first) in printed
    assert f"--protocol moteus --seed {first.seed}: episode {first.episode}, at {first.time:.2f} s: " in printed
    assert printed.count("\n") > 3, "a single life is told step by step"
