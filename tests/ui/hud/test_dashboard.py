"""What the display tells, as words and levels of urgency."""

from typing import Any

import pytest

from tests.ui.hud.making import START, received, report, seen, state, status
from vrg.bus import messages as m
from vrg.games.hud.helm import Wish
from vrg.types import Pose
from vrg.ui.builder import SceneBuilder
from vrg.ui.hud import words
from vrg.ui.hud.dashboard import Dashboard, Level, Line, alert, player_line, pose_line
from vrg.ui.hud.dashboard import status as lines
from vrg.ui.scene import Scene


def scene(*, live: bool = True, estop: bool = False, **changes: Any) -> Scene:
    builder = SceneBuilder()
    builder.clock(m.Clock(time=1.0, tick=50, epoch=0, rate=1.0, estop=estop))
    builder.referee(state(status("ann", START), **changes))
    return builder.build(live)


def line(label: str, **changes: Any) -> Line:
    made = {"scene": scene(), "mode": "Waiting", "holder": words.OWN_STRATEGY, "seen": seen(), **changes}
    board = Dashboard("ann", **made)
    return next(found for found in lines(board) if found.label == label)


def test_the_mode_and_who_drives() -> None:
    assert line(words.MODE) == Line(words.MODE, "Waiting")
    assert line(words.MODE, mode="Goto/Drive", wish=Wish.GOTO) == Line(words.MODE, "Goto/Drive", Level.CAUTION)
    assert line(words.LEASE).level is Level.CALM
    assert line(words.LEASE, holder=words.REFEREE) == Line(words.LEASE, "the referee", Level.CAUTION)


@pytest.mark.parametrize(
    ("charge", "told", "level"),
    [(None, words.NOT_MEASURED, Level.CALM), (0.75, "75%", Level.CALM), (0.1, "10%", Level.ALARM)],
)
def test_the_battery(charge: float | None, told: str, level: Level) -> None:
    found = line(words.BATTERY, seen=seen(report=received(report(battery=charge), 1.0)))
    assert found == Line(words.BATTERY, told, level)


def test_a_fault_is_told_without_the_players_name() -> None:
    assert line(words.FAULT) == Line(words.FAULT, "none")
    faulty = seen(report=received(report(fault="ann: the left motor is hot"), 1.0))
    assert line(words.FAULT, seen=faulty) == Line(words.FAULT, "the left motor is hot", Level.ALARM)


def test_why_the_robot_stands_is_told_with_its_speed() -> None:
    assert line(words.SPEED, seen=seen(speed=0.52)) == Line(words.SPEED, "0.5 m/s")
    assert line(words.SPEED, hindrance=words.HALTED).words == f"0.0 m/s; stands: {words.HALTED}"
    assert line(words.SPEED, seen=seen(speed=None)).words == words.NOT_MEASURED


def test_how_old_the_newest_messages_are() -> None:
    assert line(words.LINK, seen=seen(player_age=0.12)).words == "player 0.1 s   robot 0.0 s   referee 0.0 s"
    late = line(words.LINK, seen=seen(robot_age=2.0))
    assert late == Line(words.LINK, "player 0.0 s   robot 2.0 s   referee 0.0 s", Level.ALARM)
    assert "player never" in line(words.LINK, seen=seen(player_age=None)).words
    assert line(words.LINK, seen=seen(live=False)) == Line(words.LINK, words.NO_CLOCK, Level.ALARM)


def test_where_the_robot_is() -> None:
    assert pose_line(Dashboard("ann", seen=seen(Pose(1.234, -2.0, -3.14159)))) == "x 1.23 m   y -2.00 m   -180°"
    assert pose_line(Dashboard("ann", seen=seen(None))) == words.NO_POSE


def test_who_the_player_is() -> None:
    assert player_line(Dashboard("ann", scene=scene(), seen=seen())) == "red, Player HUD"
    out = seen(me=status("ann", START, state="inactive"))
    assert player_line(Dashboard("ann", scene=scene(game="sharks-and-minnows"), seen=out)) == (
        "red, inactive, Sharks and Minnows"
    )


@pytest.mark.parametrize(
    ("changes", "told", "level"),
    [
        ({}, "Playing   0:01.0", Level.CALM),
        ({"game": "roboflag", "score": {"red": 2, "blue": 1}}, "Playing   0:01.0   Red 2   Blue 1", Level.CALM),
        (
            {"halted": "a foul", "way_out": "The key C continues"},
            "HALT: a foul. The key C continues",
            Level.CAUTION,
        ),
        ({"estop": True}, "EMERGENCY STOP", Level.ALARM),
        ({"live": False}, "NO CLOCK: No clock from the world: what you see is old, robots stop.", Level.ALARM),
        ({"stage": m.Stage.GAME_OVER}, "GAME OVER", Level.GOOD),
        ({"stage": m.Stage.INITIALIZE, "waiting": ["ann is late"]}, "Waiting for: ann is late", Level.CALM),
    ],
)
def test_what_must_not_be_overlooked(changes: dict[str, Any], told: str, level: Level) -> None:
    assert alert(Dashboard("ann", scene=scene(**changes))) == Line("", told, level)


def test_before_the_referee_speaks() -> None:
    assert alert(Dashboard("ann", scene=Scene(live=True))).words == words.WAITING
