"""What people decide while a match is played."""

from collections.abc import Callable

import pytest

from tests.system.harness import MINNOWS, PLAYERS, Match, long_match
from tests.system.observer import Observer
from vrg.bus.messages import Stage
from vrg.coordinator.journal import read_journal

pytestmark = pytest.mark.system

REACH = 0.1
"""s of match time in which an emergency stop reaches every robot."""
BRAKING = 0.1
"""s of match time that the fastest of these robots brakes, with a tick to spare."""


def rest_of_all(observer: Observer, since: int) -> float | None:
    """Match time from which all robots stood, among the poses heard from number `since` on."""
    rests = [observer.first_rest(name, since) for name in PLAYERS]
    return None if None in rests else max(rest for rest in rests if rest is not None)


def test_an_official_halts_and_resumes(match: Match) -> None:
    observer = match.observer
    assert "play is halted: called by" in match.command("official", "halt", "--reason", "a dog on the field")
    observer.wait_until(lambda: observer.state.halted, "the halt")
    assert "a dog on the field" in (observer.state.halted or "")
    observer.wait_until(observer.standing, "all robots to stand")
    clock = observer.state.clock
    observer.time_passes(0.5, "halted")
    assert observer.state.clock == clock, "the play clock stands in HALT"
    match.resume()
    observer.wait_until(lambda: observer.state.clock > clock, "the play clock to go on")


def test_a_resume_of_what_is_not_halted_is_refused(match: Match) -> None:
    done = match.vrg("official", "resume")
    assert done.returncode == 1
    assert "play is not halted" in done.stdout


def test_an_official_lets_robots_recover(match: Match) -> None:
    assert "recover cid: asked by" in match.command("official", "recover", "cid")
    assert "recover all robots: asked by" in match.command("official", "recover", "--reason", "new battery")
    refused = match.vrg("official", "recover", "nobody")
    assert refused.returncode == 1
    assert "expected a player of this match" in refused.stdout
    assert match.observer.state.halted is None


def test_an_official_overrules_score_and_state(match: Match) -> None:
    observer = match.observer
    assert "set-score minnows 3" in match.command("official", "set-score", "minnows", "3")
    observer.wait_until(lambda: observer.state.score["minnows"] == 3, "the new score")
    match.command("official", "set-state", "cid", "inactive")
    observer.wait_until(lambda: observer.mode("cid") == "Inactive/Stop", "cid to be inactive")
    observer.wait_until(lambda: observer.standing("cid"), "cid to stop")
    match.command("official", "set-state", "cid", "active")
    observer.wait_until(lambda: observer.moving("cid"), "cid to move again")
    refused = match.vrg("official", "set-score", "whales", "3")
    assert refused.returncode == 1
    assert "whales" in refused.stdout
    rules = [call.rule for record in read_journal(match.run.journal)[1] for call in record.calls]
    assert rules[-4:] == ["overruled", "overruled", "overruled", "refused"]


def test_an_emergency_stop_holds_until_it_is_released_and_play_is_resumed(match: Match) -> None:
    observer = match.observer
    since, pressed = len(observer.heard.poses), len(observer.heard.estops)
    match.command("estop", "--reason", "smoke")
    observer.wait_until(lambda: rest_of_all(observer, since) is not None, "all robots to stop")
    heard_at, _ = observer.heard.estops[pressed]
    assert (rest_of_all(observer, since) or 0.0) <= heard_at + REACH + BRAKING
    observer.wait_until(lambda: observer.state.halted and observer.state.estop, "a halt")
    assert "smoke" in (observer.state.halted or "")

    refused = match.vrg("official", "resume")
    assert refused.returncode == 1
    assert "release it with the key U or `vrg estop --release`" in refused.stdout
    observer.wait_until(lambda: not any(observer.heard.robots[n][-1].body.armed for n in PLAYERS), "motors to be off")

    match.command("estop", "--release")
    observer.time_passes(1.0, "released, not resumed")
    stopped = rest_of_all(observer, since) or 0.0
    for poses in observer.heard.poses[since:]:
        if poses.stamp > stopped:
            assert all(abs(body.v) < 0.01 for body in poses.body.bodies), f"somebody moved at {poses.stamp:.2f} s"
    match.resume()


def test_an_official_ends_the_match(start: Callable[..., Match]) -> None:
    match = start(long_match("ended"))
    assert "ended by" in match.command("official", "end", "--reason", "rain")
    match.observer.wait_until(lambda: match.observer.state.stage is Stage.GAME_OVER, "the end")
    match.observer.wait_until(lambda: match.observer.standing(*MINNOWS), "robots to stop")
    assert match.wait_ended() == 0
    assert "ended by" in match.run.result.read_text()
