"""A process dies or hangs in the middle of a match: robots stop, it comes back, and play goes on."""

import itertools
import math
import signal
from collections.abc import Sequence
from typing import Any

import psutil
import pytest

from tests.system.conftest import FAULTS
from vrg.bus.codec import Received
from vrg.bus.messages import OfficialAction, RefereeState, Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import read_setup
from vrg.coordinator.coordinator import PERIOD
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import judge_again
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.testing.processes.match import MINNOWS, PLAYERS, LiveMatch
from vrg.types import STILL

pytestmark = pytest.mark.system

STOP_TIME = COMMAND_TIMEOUT + 0.1 + 2 * 0.02
"""s of match time in which a robot that is left alone stands: its watchdog, its brake from 0.65 m/s, and a tick each
until the world has heard its last command and until it looks."""


def takeover(messages: Sequence[Received[Any]]) -> int | None:
    """The index of the first message that the newest sender sent; None while there is one sender only."""
    if not messages:
        return None
    first = next(i for i, message in enumerate(messages) if message.sender == messages[-1].sender)
    return first or None


def strike(match: LiveMatch, name: str, fault: signal.Signals) -> psutil.Process:
    """Kill or freeze a process."""
    process = match.child(name)
    match.observer.look()
    process.send_signal(fault)
    return process


def nobody_moves_before_resume(match: LiveMatch) -> None:
    """Robots stand while the match is halted, however long; then it is resumed."""
    observer = match.observer
    observer.wait_until(observer.standing, "all robots to stand")
    where = {name: observer.body(name).pose for name in PLAYERS}
    observer.time_passes(1.0, "halted")
    for name, pose in where.items():
        now = observer.body(name).pose
        assert math.hypot(now.x - pose.x, now.y - pose.y) < 0.02, f"{name} moved in HALT"
    match.resume()


def assert_same_standing(heard: Received[RefereeState], last: Received[RefereeState]) -> None:
    """A referee's first state in HALT tells what its last one in play told.

    The play clock may have gone on for one tick in between: on a busy machine ticks are left out, so that one is long.
    """
    now, before = heard.body, last.body
    tick = max(PERIOD, heard.stamp - last.stamp) + 0.01
    assert (now.stage, now.round, now.score) == (before.stage, before.round, before.score)
    assert before.clock - PERIOD - 0.01 <= now.clock <= before.clock + tick
    assert before.total - PERIOD - 0.01 <= now.total <= before.total + tick
    assert [(p.name, p.role, p.state) for p in now.players] == [(p.name, p.role, p.state) for p in before.players]


@FAULTS
def test_the_robot_of_a_player_that_fails_stops_and_plays_on_in_its_role(
    match: LiveMatch, fault: signal.Signals
) -> None:
    observer = match.observer
    since = len(observer.heard.poses)
    old = strike(match, "ann", fault)
    observer.look()
    struck, drives = observer.now, observer.heard.drives["ann"]
    sender = drives[-1].sender
    observer.wait_until(lambda: observer.stopped_at("ann", since, sender) is not None, "ann's robot to stop")
    stopped = observer.stopped_at("ann", since, sender)
    assert stopped is not None
    last_drive = max(d.stamp for d in drives if d.stamp < stopped)
    assert stopped <= max(last_drive, struck) + STOP_TIME
    assert fault == signal.SIGKILL or observer.last_motion("ann", since) is not None
    assert observer.halts_nobody_else("ann"), observer.state.halted
    # What the referee decides while the player is away holds for the one that comes back.
    observer.decide(OfficialAction.SET_ROLE, "ann", "shark")
    match.wait_replaced("ann", old)

    def back() -> bool:
        return observer.mode("ann").startswith("Sharks/") or observer.state.halted is not None

    observer.wait_until(back, "ann to come back as a shark, or to be missed for too long")
    assert observer.halts_nobody_else("ann"), observer.state.halted
    match.go_on()
    observer.wait_until(lambda: observer.mode("ann").startswith("Sharks/"), "ann to come back as a shark")
    observer.decide(OfficialAction.SET_ROLE, "ann", "minnow")
    observer.wait_until(lambda: observer.mode("ann").startswith("Minnows/"), "ann to be a minnow again")
    observer.wait_moving("ann")


def test_a_player_that_is_asked_to_stop_stops_its_robot_first(match: LiveMatch) -> None:
    observer = match.observer
    drives = observer.heard.drives["bob"]
    sender = drives[-1].sender
    old = strike(match, "bob", signal.SIGTERM)
    new = match.wait_replaced("bob", old)
    match.wait_said("bob ended with status 0: started again")
    observer.wait_until(lambda: drives[-1].sender != sender and drives[-1].body.armed, "the new player's commands")
    assert observer.halts_nobody_else("bob"), observer.state.halted
    match.go_on()
    assert new.is_running()
    # A player that comes back begins with a disarmed command, too: the one of the old player is the last of its own.
    last_of_old = next(drive for drive in reversed(drives) if drive.sender == sender).body
    assert (last_of_old.twist, last_of_old.armed) == (STILL, False)


@FAULTS
def test_a_coordinator_that_fails_comes_back_in_halt_with_the_same_standing(
    match: LiveMatch, fault: signal.Signals
) -> None:
    observer = match.observer
    observer.decide(OfficialAction.SET_SCORE, "sharks", "2")
    observer.wait_until(lambda: observer.state.score["sharks"] == 2, "the score to be set")
    since, sender = len(observer.heard.poses), observer.heard.states[-1].sender
    old = strike(match, "coordinator", fault)
    observer.wait_until(
        lambda: all(observer.last_motion(name, since) is not None for name in PLAYERS), "robots without referee to stop"
    )
    match.wait_replaced("coordinator", old)
    observer.wait_until(lambda: observer.heard.states[-1].sender != sender, "the new coordinator to speak")
    states = observer.heard.states
    before = next(state for state in reversed(states) if state.sender == sender)
    first = states[states.index(before) + 1]
    stopped = max(observer.last_motion(name, since) or 0.0 for name in PLAYERS)
    assert stopped <= before.stamp + 1.0
    assert "restarted" in (first.body.halted or "")
    assert_same_standing(first, before)
    nobody_moves_before_resume(match)
    assert observer.state.clock >= before.body.clock
    # What both have called follows from what each of them has seen.
    exhibits = list(read_evidence(match.run.evidence))
    judgement = judge_again(rulebook_of(read_setup(match.run.setup)), exhibits, read_journal(match.run.journal)[1])
    assert judgement.disagreements == []
    assert judgement.calls > 2


@FAULTS
def test_a_world_that_fails_goes_on_from_its_snapshot_after_a_halt(match: LiveMatch, fault: signal.Signals) -> None:
    observer = match.observer
    epoch = observer.epoch
    old = strike(match, "world", fault)
    match.wait_replaced("world", old)
    observer.wait_until(lambda: observer.epoch == epoch + 1, "the new world's clock")
    observer.wait_until(lambda: observer.state.halted, "a halt")
    assert "the world" in (observer.state.halted or "")
    clocks, poses = observer.heard.clocks, observer.heard.poses
    observer.wait_until(lambda: takeover(poses) is not None, "the new world's poses")
    first, first_pose = takeover(clocks), takeover(poses)
    assert first is not None
    assert first_pose is not None
    # The first few of a new process may be lost before everybody has heard of it: they are what the number says.
    assert clocks[first - 1].stamp - 0.3 <= clocks[first].stamp
    assert clocks[first].stamp <= clocks[first - 1].stamp + 0.02 * (1 + clocks[first].sequence)
    for name in PLAYERS:
        then, now = observer.body(name, poses[first_pose - 1]).pose, observer.body(name, poses[first_pose]).pose
        assert math.hypot(now.x - then.x, now.y - then.y) < 0.2, f"{name} was moved"
    states = observer.heard.states
    last = max(number for number, state in enumerate(states) if state.body.halted is None)
    assert_same_standing(states[last + 1], states[last])
    assert observer.state.clock == states[last + 1].body.clock, "the play clock stands in HALT"
    nobody_moves_before_resume(match)


@FAULTS
def test_robots_without_a_router_stop_and_everybody_reconnects(match: LiveMatch, fault: signal.Signals) -> None:
    observer = match.observer
    score, poses = observer.state.score, observer.heard.poses
    since, struck = len(poses), observer.now
    old = strike(match, "router", fault)
    match.wait_replaced("router", old)
    observer.wait_until(lambda: observer.now > struck + 3.0, "the clock to be heard again")
    assert observer.state.score == score
    assert observer.state.stage is Stage.PLAY_ROUND
    if fault == signal.SIGKILL and observer.playing:
        # The new router was there before anybody missed the old one.
        match.go_on()
        return
    observer.wait_until(lambda: observer.state.halted, "the referee to be heard in HALT")
    observer.wait_until(observer.standing, "all robots to stand")
    # The longest gap is where nothing was heard.
    cut, _ = max(itertools.pairwise(poses[since - 1 :]), key=lambda pair: pair[1].stamp - pair[0].stamp)
    for name in PLAYERS:
        then, now = observer.body(name, cut).pose, observer.body(name).pose
        assert math.hypot(now.x - then.x, now.y - then.y) < 0.5, f"{name} drove on without a router"
    nobody_moves_before_resume(match)
    # On a busy machine a player misses the referee now and then, and stops for a moment.
    observer.wait_until(
        lambda: {observer.mode(name).split("/")[0] for name in MINNOWS} == {"Minnows"}, "minnows to be minnows again"
    )
