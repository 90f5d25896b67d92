"""A robot that runs ROS 2 plays: a virtual one of another match, which ROS drives, stands in for it."""

import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from vrg.testing.processes.match import LiveMatch, long_match

pytestmark = [pytest.mark.system, pytest.mark.thorough]

STAND_IN = """
name = "stand_in"
game = "practice"
map = "open"
engine = "planar"

[rules]
x = [-30.0, 30.0]
y = [-95.0, 95.0]

[[players]]
name = "bot"
role = "player"
strategy = "ros"
x = 0.0
y = 0.0
heading = -90.0
"""

ROBOT = """
[backends.ros]
router = "{router}"

[backends.ros.robots.ann]
namespace = "stand_in/bot"
use_sim_time = true

[[players]]"""


def test_a_robot_of_ros_plays_stands_and_is_waited_for(start: Callable[..., LiveMatch], tmp_path: Path) -> None:
    (tmp_path / "stand_in").mkdir()
    with LiveMatch(tmp_path / "stand_in", STAND_IN, movers=(), options=["--ros"]) as other:
        other.movers = ("bot",)  # it moves once the other match plays
        text = long_match("rosy").replace("[[players]]", ROBOT.format(router=other.endpoint), 1)
        own = 'name = "ann"\nrole = "minnow"\nbackend = '
        match = start(text.replace(f'{own}"sim"', f'{own}"ros"'))
        bot = other.observer
        match.go_on(other)

        match.command("estop", "--reason", "test")
        bot.wait_until(lambda: bot.standing("bot"), "the robot to stand after the emergency stop")
        match.command("estop", "--release")
        match.go_on(other)

        # The robot falls silent: nothing of ROS is heard of it any more, and its lease ends.
        outlet = other.child("ros")
        outlet.send_signal(signal.SIGSTOP)
        silent = "no odometry on /stand_in/bot/odom for"
        before = match.log("ann").count(silent)
        bot.wait_until(lambda: bot.standing("bot"), "the robot that hears nothing to stand")
        match.observer.wait_until(lambda: match.log("ann").count(silent) > before, "the player to find out")
        outlet.send_signal(signal.SIGCONT)
        match.go_on(other)

        # The player freezes: nothing commands the robot any more, until another one takes its place.
        player = match.child("ann")
        player.send_signal(signal.SIGSTOP)
        bot.wait_until(lambda: bot.standing("bot"), "the robot to stand without its player")
        match.wait_replaced("ann", player)
        match.go_on(other)
