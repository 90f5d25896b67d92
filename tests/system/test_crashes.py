"""A process dies or hangs in the middle of a match: robots stop, it comes back, and play goes on."""

import math
import signal

import psutil
import pytest

from tests.system.harness import MINNOWS, PLAYERS, Match
from tests.system.observer import Observer
from vrg.bus.messages import OfficialAction, RefereeState, Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import read_setup
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import judge_again
from vrg.types import STILL

pytestmark = pytest.mark.system

FAULTS = pytest.mark.parametrize("fault", [signal.SIGKILL, signal.SIGSTOP], ids=["dies", "hangs"])
STOP_TIME = 0.3
"""s of match time in which a robot that is left alone stands."""


def strike(match: Match, name: str, fault: signal.Signals) -> psutil.Process:
    """Kill or freeze a process."""
    process = match.child(name)
    match.observer.look()
    process.send_signal(fault)
    return process


def everybody_stands(observer: Observer) -> None:
    observer.wait_until(observer.standing, "all robots to stand")


def nobody_moves_before_resume(match: Match) -> None:
    """Robots stand while the match is halted, however long; then it is resumed."""
    observer = match.observer
    everybody_stands(observer)
    where = {name: observer.body(name).pose for name in PLAYERS}
    observer.time_passes(1.0, "halted")
    for name, pose in where.items():
        now = observer.body(name).pose
        assert math.hypot(now.x - pose.x, now.y - pose.y) < 0.02, f"{name} moved in HALT"
    match.resume()


def assert_same_standing(now: RefereeState, before: RefereeState) -> None:
    assert (now.stage, now.round, now.score) == (before.stage, before.round, before.score)
    assert now.clock == pytest.approx(before.clock, abs=0.11)
    assert now.total == pytest.approx(before.total, abs=0.11)
    assert [(p.name, p.role, p.state) for p in now.players] == [(p.name, p.role, p.state) for p in before.players]


@FAULTS
def test_the_robot_of_a_player_that_fails_stops_and_plays_on_in_its_role(match: Match, fault: signal.Signals) -> None:
    observer = match.observer
    since = len(observer.heard.poses)
    old = strike(match, "ann", fault)
    observer.look()
    struck = observer.now
    drives = observer.heard.drives["ann"]
    number = drives[-1].sequence

    def taken_over() -> float | None:
        """When the next player of this name first drove the robot: it may come before the robot stands."""
        return next((d.stamp for d in drives if d.stamp >= struck and d.sequence < number), None)

    observer.wait_until(
        lambda: observer.first_rest("ann", since) is not None or taken_over() is not None, "ann's robot to stop"
    )
    stopped = observer.first_rest("ann", since) or taken_over()
    assert stopped is not None
    last_drive = max(d.stamp for d in drives if d.stamp < stopped)
    assert stopped <= max(last_drive, struck) + STOP_TIME
    assert fault == signal.SIGKILL or observer.first_rest("ann", since) is not None
    assert observer.playing, "one player's failure halts nobody else"
    # What the referee decides while the player is away holds for the one that comes back.
    observer.decide(OfficialAction.SET_ROLE, "ann", "shark")
    match.wait_replaced("ann", old)
    observer.wait_until(lambda: observer.mode("ann").startswith("Sharks/"), "ann to come back as a shark")
    observer.wait_until(lambda: observer.moving("ann"), "ann to move again")
    observer.decide(OfficialAction.SET_ROLE, "ann", "minnow")
    observer.wait_until(lambda: observer.mode("ann").startswith("Minnows/"), "ann to be a minnow again")
    assert observer.playing


def test_a_player_that_is_asked_to_stop_stops_its_robot_first(match: Match) -> None:
    observer = match.observer
    old = strike(match, "bob", signal.SIGTERM)
    new = match.wait_replaced("bob", old)
    assert "bob ended with status 0: started again" in match.said()
    observer.wait_until(lambda: observer.moving("bob"), "bob to move again")
    assert new.is_running()
    # A player that comes back begins with a disarmed command, too: the one of the old player is the first of its kind.
    drives = observer.heard.drives["bob"]
    first_of_new = max(i for i, d in enumerate(drives) if d.sequence == 0)
    last_of_old = drives[first_of_new - 1].body
    assert (last_of_old.twist, last_of_old.armed) == (STILL, False)


@FAULTS
def test_a_coordinator_that_fails_comes_back_in_halt_with_the_same_standing(
    match: Match, fault: signal.Signals
) -> None:
    observer = match.observer
    observer.decide(OfficialAction.SET_SCORE, "sharks", "2")
    observer.wait_until(lambda: observer.state.score["sharks"] == 2, "the score to be set")
    since = len(observer.heard.poses)
    old = strike(match, "coordinator", fault)
    observer.wait_until(
        lambda: all(observer.first_rest(name, since) is not None for name in PLAYERS), "robots without referee to stop"
    )
    before = observer.state
    stopped = max(observer.first_rest(name, since) or 0.0 for name in PLAYERS)
    assert stopped <= observer.heard.states[-1].stamp + 1.0
    match.wait_replaced("coordinator", old)
    observer.wait_until(lambda: observer.state.halted, "the new coordinator to speak")
    assert "restarted" in (observer.state.halted or "")
    assert_same_standing(observer.state, before)
    nobody_moves_before_resume(match)
    assert observer.state.clock >= before.clock
    # What both have called follows from what each of them has seen.
    exhibits = read_evidence(match.run.evidence)
    judgement = judge_again(rulebook_of(read_setup(match.run.setup)), exhibits, read_journal(match.run.journal)[1])
    assert judgement.disagreements == []
    assert judgement.calls > 2


@FAULTS
def test_a_world_that_fails_goes_on_from_its_snapshot_after_a_halt(match: Match, fault: signal.Signals) -> None:
    observer = match.observer
    epoch = observer.epoch
    old = strike(match, "world", fault)
    match.wait_replaced("world", old)
    observer.wait_until(lambda: observer.epoch == epoch + 1, "the new world's clock")
    observer.wait_until(lambda: observer.state.halted, "a halt")
    assert "the world" in (observer.state.halted or "")
    clocks, poses = observer.heard.clocks, observer.heard.poses
    first = max(i for i, clock in enumerate(clocks) if clock.sequence == 0)
    assert clocks[first - 1].stamp - 0.3 <= clocks[first].stamp <= clocks[first - 1].stamp + 0.02
    first = max(i for i, pose in enumerate(poses) if pose.sequence == 0)
    for name in PLAYERS:
        then, now = observer.body(name, poses[first - 1]).pose, observer.body(name, poses[first]).pose
        assert math.hypot(now.x - then.x, now.y - then.y) < 0.2, f"{name} was moved"
    before = next(s.body for s in reversed(observer.heard.states) if s.body.halted is None)
    assert_same_standing(observer.state, before)
    nobody_moves_before_resume(match)


@FAULTS
def test_robots_without_a_router_stop_and_everybody_reconnects(match: Match, fault: signal.Signals) -> None:
    observer = match.observer
    score = observer.state.score
    old = strike(match, "router", fault)
    observer.look()
    cut = observer.heard.poses[-1]
    match.wait_replaced("router", old)
    observer.wait_until(lambda: observer.now > cut.stamp + 3.0, "the clock to be heard again")
    assert observer.state.score == score
    assert observer.state.stage is Stage.PLAY_ROUND
    if fault == signal.SIGKILL and observer.playing:
        # The new router was there before anybody missed the old one.
        observer.wait_until(lambda: observer.moving(*MINNOWS), "everybody to drive on")
        return
    observer.wait_until(lambda: observer.state.halted, "the referee to be heard in HALT")
    everybody_stands(observer)
    for name in PLAYERS:
        then, now = observer.body(name, cut).pose, observer.body(name).pose
        assert math.hypot(now.x - then.x, now.y - then.y) < 0.5, f"{name} drove on without a router"
    nobody_moves_before_resume(match)
    # On a busy machine a player misses the referee now and then, and stops for a moment.
    observer.wait_until(
        lambda: {observer.mode(name).split("/")[0] for name in MINNOWS} == {"Minnows"}, "minnows to be minnows again"
    )
