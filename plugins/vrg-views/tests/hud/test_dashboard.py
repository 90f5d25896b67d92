"""What the display tells, as words, and colours that tell how urgent they are."""

from typing import Any

import pytest
from displays import START, received, report, seen, state, status

from vrg.bus import messages as m
from vrg.colours import Rgb
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.builder import SceneBuilder
from vrg.ui.deeds import NO_CLOCK
from vrg.ui.scene import Scene
from vrg_views.hud import words
from vrg_views.hud.dashboard import Dashboard, Line, alert, player_line, pose_line
from vrg_views.hud.dashboard import status as lines
from vrg_views.hud.helm import Wish


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
    assert line(words.MODE, mode="Goto/Drive", wish=Wish.GOTO) == Line(words.MODE, "Goto/Drive", palette.CAUTION)
    assert line(words.LEASE).colour == palette.TEXT
    assert line(words.LEASE, holder=words.REFEREE) == Line(words.LEASE, "the referee", palette.CAUTION)


@pytest.mark.parametrize(
    ("charge", "told", "colour"),
    [(None, words.NOT_MEASURED, palette.TEXT), (0.75, "75%", palette.TEXT), (0.1, "10%", palette.WARNING)],
)
def test_the_battery(charge: float | None, told: str, colour: Rgb) -> None:
    found = line(words.BATTERY, seen=seen(report=received(report(battery=charge), 1.0)))
    assert found == Line(words.BATTERY, told, colour)


def test_a_fault_is_told_without_the_players_name() -> None:
    assert line(words.FAULT) == Line(words.FAULT, "none")
    faulty = seen(report=received(report(fault="the left motor is hot"), 1.0))
    assert line(words.FAULT, seen=faulty) == Line(words.FAULT, "the left motor is hot", palette.WARNING)


def test_why_the_robot_cannot_be_driven_is_told_with_its_speed() -> None:
    assert line(words.SPEED, seen=seen(speed=0.52)) == Line(words.SPEED, "0.5 m/s")
    assert line(words.SPEED, hindrance="the referee drives it").words == "0.0 m/s; the referee drives it"
    assert line(words.SPEED, seen=seen(speed=None)).words == words.NOT_MEASURED


def test_how_old_the_newest_messages_are() -> None:
    assert line(words.LINK, seen=seen(player_age=0.12)).words == "player 0.1 s   robot 0.0 s   referee 0.0 s"
    late = line(words.LINK, seen=seen(robot_age=2.0))
    assert late == Line(words.LINK, "player 0.0 s   robot 2.0 s   referee 0.0 s", palette.WARNING)
    assert "player never" in line(words.LINK, seen=seen(player_age=None)).words
    assert line(words.LINK, seen=seen(live=False)) == Line(words.LINK, NO_CLOCK, palette.WARNING)


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
    ("changes", "told", "colour"),
    [
        ({}, "Playing   0:01.0", palette.RAISED),
        ({"game": "roboflag", "score": {"red": 2, "blue": 1}}, "Playing   0:01.0   Red 2   Blue 1", palette.RAISED),
        (
            {"halted": "a foul", "way_out": "The key C continues"},
            "HALT: a foul. The key C continues",
            palette.CAUTION,
        ),
        ({"estop": True}, "EMERGENCY STOP", palette.ALARM),
        ({"live": False}, "NO CLOCK: No clock from the world: what you see is old, robots stop.", palette.LOST),
        ({"stage": m.Stage.GAME_OVER}, "GAME OVER", palette.LOST),
        ({"stage": m.Stage.INITIALIZE, "waiting": ["ann is late"]}, "Waiting for: ann is late", palette.CALM),
    ],
)
def test_what_must_not_be_overlooked(changes: dict[str, Any], told: str, colour: Rgb) -> None:
    assert alert(Dashboard("ann", scene=scene(**changes))) == Line("", told, colour)


def test_before_the_referee_speaks() -> None:
    assert alert(Dashboard("ann", scene=Scene(live=True))).words == words.WAITING
