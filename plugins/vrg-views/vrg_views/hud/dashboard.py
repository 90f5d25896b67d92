"""The content of the display at one instant, as data: everything is decided here, and only drawn by the painters."""

import math
from dataclasses import dataclass, field
from typing import Final

from vrg.colours import Rgb
from vrg.games import game_of
from vrg.games.game import title
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.depiction import Cones, Image, Rays
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.types import Vector
from vrg.ui import palette
from vrg.ui.banner import banners
from vrg.ui.deeds import LOW_BATTERY, NO_CLOCK
from vrg.ui.headline import stage_words
from vrg.ui.scene import Scene, clock_text, speed_text
from vrg_views.hud import words
from vrg_views.hud.helm import Goal, Wish
from vrg_views.hud.telemetry import Telemetry

OLD: Final = 0.3
"""The match time in s beyond which the age of a message is shown as alarming."""


ELSEWHERE: Final = (Ins, Odometry, Battery)
"""The messages of the sensors that the place of the robot, its speed and the line of the battery are from."""


@dataclass(frozen=True)
class Line:
    """One line of the status: its label, its words, and the colour that tells how urgent it is."""

    label: str
    words: str
    colour: Rgb = palette.TEXT


@dataclass(frozen=True)
class Dashboard:
    """Everything to show.

    Args:
        player: whose display it is. scene: the field as the player may see it.
        seen: what the player knows.
        wish: what the person wants. mode: the mode and the submode of the automaton that drives the robot.
        holder: who drives the robot. hindrance: what keeps it from being driven; empty if nothing does.
        goal: where Goto leads. home: where the robot began; None where that is not known.
        way: the points of the way that it will drive, m.
        texts: what stands in the fields. focus: the number of the field that is typed into.
        ranging: False where the match simulates no range finders.
        notice: a message to the person. pad: which gamepad is in use.
    """

    player: str
    scene: Scene = field(default_factory=Scene)
    seen: Telemetry = field(default_factory=Telemetry)
    wish: Wish = Wish.WATCH
    mode: str = ""
    holder: str = ""
    hindrance: str = ""
    goal: Goal | None = None
    home: Goal | None = None
    way: tuple[Vector, ...] = ()
    texts: tuple[str, ...] = ("", "", "")
    focus: int | None = None
    ranging: bool = True
    notice: str = ""
    pad: str = ""


def status(board: Dashboard) -> list[Line]:
    """The lines of the goto panel about the player and its robot."""
    seen = board.seen
    report = None if seen.report is None else seen.report.body
    driven = board.holder not in (words.OWN_STRATEGY, "")
    charge = None if report is None else report.battery
    fault = None if report is None else report.fault
    calm, caution, alarm = palette.TEXT, palette.CAUTION, palette.WARNING
    low = charge is not None and charge < LOW_BATTERY
    return [
        Line(words.MODE, board.mode or words.UNKNOWN, caution if board.wish is not Wish.WATCH else calm),
        Line(words.LEASE, board.holder or words.UNKNOWN, caution if driven else calm),
        Line(words.SPEED, _speed(seen.speed, board.hindrance), caution if board.hindrance else calm),
        Line(words.BATTERY, words.NOT_MEASURED if charge is None else f"{charge:.0%}", alarm if low else calm),
        Line(words.FAULT, fault or words.NOTHING, alarm if fault else calm),
        _link(seen),
        Line(words.PAD, board.pad),
        *([] if board.ranging else [Line(words.RANGES, words.NOT_SIMULATED)]),
        *_sensors(seen),
    ]


def alert(board: Dashboard) -> Line:
    """The line at the top: what must not be overlooked, or else the stage of the match. It stands upon its colour."""
    scene = board.scene
    for banner in banners(scene):
        return Line("", ": ".join(text for text in (banner.heading, banner.text) if text), banner.colour)
    if scene.stage is None:
        return Line("", words.WAITING, palette.RAISED)
    score = "   ".join(f"{title(team)} {points}" for team, points in scene.score) if scored(scene) else ""
    return Line("", f"{stage_words(scene)[0]}   {clock_text(scene.clock)}   {score}".rstrip(), palette.RAISED)


def scored(scene: Scene) -> bool:
    """True if the game of a scene has a score."""
    return game_of(scene.game).competitive


def player_line(board: Dashboard) -> str:
    """The role and the state of the player, and the game, in words."""
    me, game = board.seen.me, game_of(board.scene.game)
    parts = [] if me is None else [me.role, *([] if me.state == "active" else [me.state])]
    return ", ".join([*parts, game.title] if game.name else parts)


def pose_line(board: Dashboard) -> str:
    """The pose of the robot, in words."""
    pose = board.seen.pose
    if pose is None:
        return words.NO_POSE
    degrees = round(math.degrees(pose.theta)) + 0.0
    return f"x {pose.x:.2f} m   y {pose.y:.2f} m   {degrees:.0f}°"


def _speed(speed: float | None, hindrance: str) -> str:
    text = words.NOT_MEASURED if speed is None else f"{speed_text(speed)} m/s"
    return f"{text}; {hindrance}" if hindrance else text


def _link(seen: Telemetry) -> Line:
    """The ages of the newest messages, in match time; or a stopped clock, because nothing ages then."""
    if not seen.live:
        return Line(words.LINK, NO_CLOCK, palette.WARNING)
    ages = {words.OF_PLAYER: seen.player_age, words.OF_ROBOT: seen.robot_age, words.OF_REFEREE: seen.referee_age}
    ages_text = "   ".join(f"{who} {words.NEVER if age is None else f'{age:.1f} s'}" for who, age in ages.items())
    old = any(age is None or age > OLD for age in ages.values())
    return Line(words.LINK, ages_text, palette.WARNING if old else palette.TEXT)


def _sensors(seen: Telemetry) -> list[Line]:
    """A line for each sensor that is drawn nowhere: what it has measured last, in words."""
    # The first sensor of each of these has a place of its own on the display.
    drawn = [seen.first(depiction) for depiction in (Rays, Cones, Image)]
    rest = [s for s in seen.sensors if s not in drawn and s.spec.message not in ELSEWHERE]
    texts = [words.NO_READING if s.reading is None else s.reading.body.words for s in rest]
    labels = [s.spec.kind if s.spec.name == "main" else f"{s.spec.kind} {s.spec.name}" for s in rest]
    return [Line(label.upper(), text) for label, text in zip(labels, texts, strict=True)]
