"""The moving parts of the field: a scene becomes arrays of the places, turns and colours of repeated solids."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.colours import Rgb, mix
from vrg.figures import rounded
from vrg.games import game_of
from vrg.games.game import Marker, Style
from vrg.geometry import compose
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Rays
from vrg.types import Pose, Twist
from vrg.ui import palette
from vrg.ui.scene import JUMP, Scene, SceneBody
from vrg_views.three.robots import CABIN, marker_mesh, robot_look
from vrg_views.three.shapes import Floats, Mesh, band, circle, joined, loft, prism, raised, sheet

Bytes = npt.NDArray[np.uint8]
FLASHES: Final = 6
"""The most calls that are shown at once where they happened."""
_LIFT: Final = 0.045
"""m above the ground of rings and lines, which lie above all zones."""
_GROUND: Final = mix(palette.FIELD, palette.MUTED, 0.35)
"""The colour into which trails fade."""
_POLE: Final = 1.5
"""The height of a flag, m."""


@dataclass(frozen=True)
class Batch:
    """One solid that is drawn many times.

    Args:
        name: its own. places: where, shape (n, 3), m. turns: quaternions (w, x, y, z), shape (n, 4).
        scales: the size of each along x, y and z, shape (n, 3). colours: of each, shape (n, 3).
        casts: it casts a shadow. opacity: 0 to 1. robots: each is a robot, in the order of the scene's bodies.
    """

    name: str
    mesh: Mesh
    places: Floats
    turns: Floats
    scales: Floats
    colours: Bytes
    casts: bool = True
    opacity: float = 1.0
    robots: tuple[str, ...] = ()


@dataclass(frozen=True)
class Lines:
    """Lines of two points each: points of shape (n, 2, 3), m, and the colours of both ends, shape (n, 2, 3)."""

    points: Floats
    colours: Bytes


class BatchMaker:
    """Makes batches of scenes. It remembers how far the wheels of each robot have turned.

    Args:
        robots: the models of the robots, by name. default: that of others.
    """

    def __init__(self, robots: Mapping[str, RobotModel], default: RobotModel) -> None:
        self._robots, self._default = dict(robots), default
        self._rolled: dict[str, tuple[Pose, npt.NDArray[np.float64]]] = {}
        self._worn: set[Marker] = set()

    def model(self, name: str) -> RobotModel:
        """The model of a robot."""
        return self._robots.get(name, self._default)

    def batches(self, scene: Scene) -> list[Batch]:
        """All that moves."""
        styles = {body.name: game_of(scene.game).style(body.role, body.state) for body in scene.bodies}
        found = []
        for model in dict.fromkeys(self.model(body.name) for body in scene.bodies):
            found += self._robots_of(model, [b for b in scene.bodies if self.model(b.name) is model], scene, styles)
        return [*found, *self._signs(scene, styles), *_flags(scene), *_things(scene), _flashes(scene)]

    def _robots_of(
        self, model: RobotModel, bodies: Sequence[SceneBody], scene: Scene, styles: Mapping[str, Style]
    ) -> list[Batch]:
        look, names = robot_look(model), tuple(body.name for body in bodies)
        places, turns = _poses([body.pose for body in bodies])
        paint = np.array([_painted(body, scene, styles[body.name]) for body in bodies], dtype=np.uint8)
        count, name = len(bodies), f"robots/{model.name}"
        ones = np.ones((count, 3), dtype=np.float32)
        found = [
            Batch(f"{name}/{part}", mesh, places, turns, ones, colours, robots=names)
            for part, mesh, colours in (
                ("paint", look.paint, paint),
                ("dark", look.dark, _same(palette.INK, count)),
                ("light", look.light, _same(mix(palette.TEXT, palette.ECHO, 0.25), count)),
            )
        ]
        wheels = model.drivetrain.wheels
        if not wheels:
            return found
        rolled = np.concatenate([self._roll(body, model) for body in bodies])
        spots = np.array([(w.x, w.y, model.drivetrain.wheel_radius) for w in wheels], dtype=np.float32)
        yaw = np.array([[b.pose.theta + w.heading for w in wheels] for b in bodies]).ravel()
        theta = np.array([body.pose.theta for body in bodies])[:, None]
        x = places[:, :1] + spots[:, 0] * np.cos(theta) - spots[:, 1] * np.sin(theta)
        y = places[:, 1:2] + spots[:, 0] * np.sin(theta) + spots[:, 1] * np.cos(theta)
        at = np.stack((x, y, np.broadcast_to(spots[:, 2], x.shape)), axis=2).reshape(-1, 3).astype(np.float32)
        spin = _turned(yaw, rolled)
        ones = np.ones((len(at), 3), dtype=np.float32)
        rubber = mix(palette.INK, palette.LINE, 0.35)
        found.append(Batch(f"{name}/tyres", look.tyre, at, spin, ones, _same(rubber, len(at))))
        found.append(Batch(f"{name}/hubs", look.hub, at, spin, ones, _same(palette.WALL_EDGE, len(at)), casts=False))
        return found

    def _roll(self, body: SceneBody, model: RobotModel) -> npt.NDArray[np.float64]:
        """The angle by which each wheel has turned, rad, from the way of the body since the last scene."""
        here, wheels = body.pose, model.drivetrain.wheels
        before, angles = self._rolled.get(body.name, (here, np.zeros(len(wheels))))
        dx, dy = here.x - before.x, here.y - before.y
        if math.hypot(dx, dy) + abs(here.theta - before.theta) > 0.0 and math.hypot(dx, dy) < JUMP:
            c, s = math.cos(here.theta), math.sin(here.theta)
            way = Twist(c * dx + s * dy, math.remainder(here.theta - before.theta, math.tau), c * dy - s * dx)
            axes = model.drivetrain.speeds(way)
            angles = angles + np.array([0.0 if w.axis is None else axes[w.axis] for w in wheels])
        self._rolled[body.name] = here, np.remainder(angles, math.tau)
        return self._rolled[body.name][1]

    def _signs(self, scene: Scene, styles: Mapping[str, Style]) -> list[Batch]:
        """On each robot the sign of its role, on the ground below its shade and a ring, and where players line up."""
        bodies = scene.bodies
        if not bodies:
            return []
        places, turns = _poses([body.pose for body in bodies])
        theta = np.array([body.pose.theta for body in bodies])
        models = [self.model(body.name) for body in bodies]
        back = np.array([CABIN * model.length for model in models])
        roofs = np.array([robot_look(model).roof for model in models])
        tops = places + _floats(np.column_stack((back * np.cos(theta), back * np.sin(theta), roofs)))
        white, found = _same(palette.TEXT, len(bodies)), []
        self._worn.update(style.marker for style in styles.values())
        for marker in sorted(self._worn, key=lambda marker: marker.value):
            worn = [[0.42 * body.width * (styles[body.name].marker is marker)] * 3 for body in bodies]
            name = f"signs/{marker.value}"
            found.append(Batch(name, marker_mesh(marker), tops, turns, _floats(worn), white, casts=False))
        sizes = _floats([(body.length, body.width, 1.0) for body in bodies])
        ground = places * _floats((1.0, 1.0, 0.0))
        black, low = _same((0, 0, 0), len(bodies)), ground + _floats((0.0, 0.0, 0.8 * _LIFT))
        found.append(Batch("shades", _SHADE, low, turns, sizes, black, casts=False, opacity=0.4))
        tints = np.array([styles[body.name].colour for body in bodies], dtype=np.uint8)
        physical = np.array([[body.physical] for body in bodies])
        wide = [math.hypot(body.length, body.width) * (not body.out_of_play) for body in bodies]
        rings, low = _floats([(size, size, 1.0) for size in wide]), ground + _floats((0.0, 0.0, _LIFT))
        still = _turned(np.zeros(len(bodies)))
        found.append(Batch("rings", _RING, low, still, rings, np.where(physical, white, tints), casts=False))
        marks = {player.name: player.mark for player in scene.players if player.mark is not None}
        spots, headings = _poses([marks.get(body.name, Pose(0.0, 0.0, 0.0)) for body in bodies])
        wanted = _floats([[0.8 * (body.name in marks)] * 3 for body in bodies])
        found.append(Batch("marks", _MARK, spots + _floats((0.0, 0.0, _LIFT)), headings, wanted, tints, casts=False))
        return found


def trails(scene: Scene) -> Lines:
    """The recent ways of robots, fading into the ground, and a line up to each that is in the air."""
    game = game_of(scene.game)
    points: list[Floats] = [np.zeros((0, 2, 3), np.float32)]
    colours: list[Bytes] = [np.zeros((0, 2, 3), np.uint8)]

    for body in scene.bodies:
        if len(body.trail) > 1 and not body.out_of_play:
            line = np.empty((len(body.trail), 3), dtype=np.float32)
            line[:, :2], line[:, 2] = body.trail, _LIFT
            share, colour = np.linspace(0.15, 1.0, len(line))[:, None], game.style(body.role, body.state).colour
            tint = (np.array(_GROUND) * (1.0 - share) + np.array(colour) * share).astype(np.uint8)
            points.append(np.stack((line[:-1], line[1:]), axis=1))
            colours.append(np.stack((tint[:-1], tint[1:]), axis=1))
        if body.pose.z > 0.0:
            x, y, z = body.pose.x, body.pose.y, body.pose.z
            points.append(_floats([[(x, y, _LIFT), (x, y, z)]]))
            colours.append(np.array([[game.style(body.role, body.state).colour] * 2], dtype=np.uint8))
    return Lines(np.concatenate(points), np.concatenate(colours))


def fan(pose: Pose, rays: Rays) -> Mesh:
    """The ground that a scan has found free, as a surface. The robot was at `pose`."""
    eye, angles = compose(pose, rays.mount), rays.bearings + pose.theta
    ranges = np.asarray(rays.ranges, dtype=np.float64)
    ends = np.column_stack((eye.x + ranges * np.cos(angles), eye.y + ranges * np.sin(angles)))
    corners = np.concatenate(([(eye.x, eye.y)], ends))
    here = np.arange(1, len(corners) - 1, dtype=np.uint32)
    return Mesh(raised(corners, 1.5 * _LIFT), np.stack((np.zeros_like(here), here, here + 1), axis=1))


def _painted(body: SceneBody, scene: Scene, style: Style) -> Rgb:
    """The colour of a robot: dull out of play. One that the referee has just called blinks."""
    for flash in scene.flashes:
        if math.dist(flash.at, (body.pose.x, body.pose.y)) < 0.6 * body.length and int(flash.share * 8) % 2 == 0:
            return palette.TEXT
    return mix(style.colour, palette.INK, 0.45) if body.out_of_play else style.colour


def _flags(scene: Scene) -> list[Batch]:
    """Flags on poles: in their places, or upright behind on the robot that carries them."""
    flags = [thing for thing in scene.objects if not thing.is_body]
    if not flags:
        return []
    poses = {body.name: body.pose for body in scene.bodies}
    game, count = game_of(scene.game), len(flags)
    lifted = np.array([0.2 * (thing.carrier in poses) for thing in flags], dtype=np.float32)
    places = np.column_stack((np.array([thing.at for thing in flags]), lifted)).astype(np.float32)
    # What is carried streams behind its carrier; the others sway in the wind.
    yaws = [
        poses[thing.carrier].theta + math.pi if thing.carrier in poses
        else 0.5 + 0.25 * math.sin(1.7 * scene.time + number)
        for number, thing in enumerate(flags)
    ]  # fmt: skip
    turns, ones = _turned(np.array(yaws)), np.ones((count, 3), dtype=np.float32)
    colours = np.array([game.team_style(thing.team).colour for thing in flags], dtype=np.uint8)
    return [
        Batch("flags/poles", _FLAG_POLE, places, turns, ones, _same(palette.BORDER, count)),
        Batch("flags/cloths", _CLOTH, places, turns, ones, colours),
    ]


def _things(scene: Scene) -> list[Batch]:
    """Balls, boxes and the like, as high as the game says; what is lost is dull."""
    game, found = game_of(scene.game), []
    for thing in (thing for thing in scene.objects if thing.is_body):
        style = game.thing_style(thing.kind, thing.team)
        corners = circle(thing.radius) if thing.radius else thing.corners
        place = _floats([(*thing.at, 0.0)])
        turns, ones = _turned(np.array([thing.heading])), np.ones((1, 3), dtype=np.float32)
        solid = prism(corners, 0.0, style.height)
        colour = mix(style.colour, palette.INK, 0.6) if thing.lost else style.colour
        found.append(Batch(f"things/{thing.name}", solid, place, turns, ones, _same(colour, 1)))
    return found


def _flashes(scene: Scene) -> Batch:
    """A ring that grows where the referee has just called something."""
    shown = scene.flashes[-FLASHES:]
    places, scales = np.zeros((FLASHES, 3), dtype=np.float32), np.zeros((FLASHES, 3), dtype=np.float32)
    for number, flash in enumerate(shown):
        places[number] = (*flash.at, 2 * _LIFT)
        size = 0.6 + 2.4 * flash.share
        scales[number] = (size, size, 1.0)
    turns = _turned(np.zeros(FLASHES))
    return Batch("flashes", _RING, places, turns, scales, _same(palette.CAUTION, FLASHES), casts=False)


def _poses(poses: Sequence[Pose]) -> tuple[Floats, Floats]:
    places = np.array([(pose.x, pose.y, pose.z) for pose in poses], dtype=np.float32)
    return places, _turned(np.array([pose.theta for pose in poses]))


def _turned(yaw: npt.NDArray[np.float64], pitch: npt.NDArray[np.float64] | float = 0.0) -> Floats:
    """Quaternions of a turn about z after one about y, rad."""
    half, down = yaw / 2, np.broadcast_to(np.asarray(pitch) / 2, yaw.shape)
    c, s, cp, sp = np.cos(half), np.sin(half), np.cos(down), np.sin(down)
    return np.stack((c * cp, -s * sp, c * sp, s * cp), axis=1).astype(np.float32)


def _floats(values: npt.ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float32)


def _same(colour: Rgb, count: int) -> Bytes:
    return np.tile(np.array(colour, dtype=np.uint8), (count, 1))


def _cloth() -> Mesh:
    """A waving pennant that is seen from both sides."""
    columns = [(0.02 + 0.09 * k, 0.05 * math.sin(1.1 * k) * min(1.0, k / 3)) for k in range(9)]
    rings = []
    for k, (x, y) in enumerate(columns):
        tall = 0.24 * (1.0 - 0.75 * k / 8)
        middle = _POLE - 0.28
        rings.append([(x, y - 0.006, middle - tall), (x, y + 0.006, middle - tall), (x, y + 0.006, middle + tall),
                      (x, y - 0.006, middle + tall)])  # fmt: skip
    return loft(*rings)


_SHADE: Final = sheet(rounded(1.18, 1.22, 0.3), 0.0)
_RING: Final = band(circle(0.62, 40), 0.07, 0.0)
_MARK: Final = joined([band(circle(0.5, 32), 0.06, 0.0), prism([(0.75, 0.0), (0.55, 0.12), (0.55, -0.12)], 0.0, 0.005)])
_BALL: Final = [
    raised(circle(max(0.05 * math.sin(a), 0.002), 12), _POLE + 0.04 - 0.05 * math.cos(a))
    for a in np.linspace(0, math.pi, 7)
]
_FLAG_POLE: Final = joined([prism(circle(0.2, 24), 0.0, 0.06, 0.02), prism(circle(0.02, 10), 0.0, _POLE), loft(*_BALL)])
_CLOTH: Final = _cloth()
