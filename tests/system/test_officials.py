"""What people decide while a match is played."""

import pytest

from vrg.coordinator.journal import read_journal
from vrg.testing.processes.match import PLAYERS, LiveMatch
from vrg.testing.processes.observer import Observer, at_rest
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

REACH = 0.5
"""s of match time in which an emergency stop reaches every robot: much longer than it takes where processes get to run.
"""
BRAKING = 0.12
"""s of match time that the fastest of these robots brakes once its device has the stop, with a tick to spare."""


def stopped_at(observer: Observer, name: str, since: int) -> float | None:
    """Match time at which the device of a robot told for the first time since then that it has the emergency stop."""
    states = observer.heard.robots[name][since:]
    return next((state.stamp for state in states if state.body.estop), None)


def rest_after(observer: Observer, name: str, at: float) -> float | None:
    """Match time from which a robot stood, at that time or later."""
    poses = [poses for poses in observer.heard.poses if poses.stamp >= at]
    return next((p.stamp for p in poses if at_rest(observer.body(name, p))), None)


def test_an_official_halts_and_resumes(match: LiveMatch) -> None:
    observer = match.observer
    assert "play is halted: called by" in match.command("official", "halt", "--reason", "a dog on the field")
    observer.wait_until(lambda: observer.state.halted, "the halt")
    assert "a dog on the field" in (observer.state.halted or "")
    observer.wait_until(observer.standing, "all robots to stand")
    clock = observer.state.clock
    observer.time_passes(0.5, "halted")
    assert observer.state.clock == clock, "the play clock stands in HALT"
    # What hinders it may come between the look and the decision.
    wait_until(lambda: match.vrg("official", "resume", "--reason", "no dog").returncode == 0, "play to be resumed")
    match.go_on()
    observer.wait_until(lambda: observer.state.clock > clock, "the play clock to go on")


def test_an_official_overrules_score_and_state(match: LiveMatch) -> None:
    observer = match.observer
    assert "set-score minnows 3" in match.command("official", "set-score", "minnows", "3")
    observer.wait_until(lambda: observer.state.score["minnows"] == 3, "the new score")
    match.command("official", "set-state", "cid", "inactive")
    observer.wait_until(lambda: observer.mode("cid") == "Inactive/Stop", "cid to be inactive")
    observer.wait_until(lambda: observer.standing("cid"), "cid to stop")
    match.command("official", "set-state", "cid", "active")
    observer.wait_moving("cid")
    refused = match.vrg("official", "set-score", "whales", "3")
    assert refused.returncode == 1
    assert "whales" in refused.stdout
    rules = [call.rule for record in read_journal(match.run.journal)[1] for call in record.calls]
    decided = [rule for rule in rules if rule in ("overruled", "refused")]
    assert decided[-4:] == ["overruled", "overruled", "overruled", "refused"]


def test_an_emergency_stop_holds_until_it_is_released_and_play_is_resumed(match: LiveMatch) -> None:
    observer = match.observer
    told = {name: len(observer.heard.robots[name]) for name in PLAYERS}
    since, pressed = len(observer.heard.poses), len(observer.heard.estops)
    match.command("estop", "--reason", "smoke")
    observer.wait_until(lambda: observer.heard.estops[pressed:], "the emergency stop")
    heard_at, _ = observer.heard.estops[pressed]
    observer.wait_until(
        lambda: all(stopped_at(observer, name, told[name]) is not None for name in PLAYERS), "all devices to have it"
    )
    observer.wait_until(observer.standing, "all robots to stop")
    rests = []
    for name in PLAYERS:
        at = stopped_at(observer, name, told[name]) or 0.0
        rest = rest_after(observer, name, at)
        assert at <= heard_at + REACH
        assert rest is not None
        assert rest <= at + BRAKING, f"{name} drove on for {rest - at:.2f} s"
        rests.append(rest)
    observer.wait_until(lambda: observer.state.halted and observer.state.estop, "a halt")
    assert "smoke" in (observer.state.halted or "")

    refused = match.vrg("official", "resume")
    assert refused.returncode == 1
    assert "`vrg estop --release long` releases the stop" in refused.stdout
    observer.wait_until(lambda: not any(observer.heard.robots[n][-1].body.armed for n in PLAYERS), "motors to be off")

    match.command("estop", "--release")
    observer.time_passes(1.0, "released, not resumed")
    stopped = max(rests)
    for poses in observer.heard.poses[since:]:
        if poses.stamp > stopped:
            assert all(abs(body.twist.v) < 0.01 for body in poses.body.bodies), f"somebody moved at {poses.stamp:.2f} s"
    match.resume()
