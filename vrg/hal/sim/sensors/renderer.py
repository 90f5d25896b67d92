"""Pictures of a world, drawn by PyBullet's software renderer in a client of their own.

Nothing is simulated in that client. It is independent of the engine, so every engine has the same pictures, and no
picture changes what an engine computes. PyBullet draws robots, walls and obstacles. The ground and the sky fill the
rest: where they are depends on the camera alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from vrg.hal.models import RobotModel
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sim.map import WALL_HEIGHT, Map
from vrg.hal.sim.sensors.base import Floats
from vrg.modules import silent_errors

with silent_errors():
    import pybullet

if TYPE_CHECKING:
    from vrg.hal.sensors.png import Picture

NEAR_PLANE: Final = 0.02
"""The distance in m below which nothing is drawn."""
FAR_PLANE: Final = 300.0
"""The distance in m beyond which nothing is drawn."""

_Rgba = tuple[float, float, float, float]
_Vector3 = tuple[float, float, float]
_Quaternion = tuple[float, float, float, float]

_WALL: Final[_Rgba] = (0.74, 0.66, 0.56, 1.0)
_ROUND: Final[_Rgba] = (0.36, 0.52, 0.30, 1.0)
_TYRE: Final[_Rgba] = (0.13, 0.13, 0.14, 1.0)
_BLACK: Final[_Rgba] = (0.25, 0.25, 0.27, 1.0)
_BLUE: Final[_Rgba] = (0.10, 0.30, 0.75, 1.0)
_GROUND: Final = np.array((125, 124, 120))
_HAZE: Final = np.array((178, 184, 190))
"""The colour of the ground far away."""
_HORIZON: Final = np.array((205, 222, 238))
_SKY: Final = np.array((112, 163, 214))
_CLEARANCE: Final = 0.06
"""The ground clearance of a hull, m."""
_DECK: Final = 0.02
"""The thickness of the deck of a robot, m."""
_LASER_SIDE: Final = 0.15
"""The length and the width of a laser range finder, m."""
_LASER_TOP: Final = 0.05
"""The height of a laser range finder above its beams, m."""
_FLAT: Final[_Quaternion] = (0.0, 0.0, 0.0, 1.0)
_AWAY: Final[_Vector3] = (0.0, 0.0, -10 * FAR_PLANE)
"""The place of the robot that carries the camera, as it is not in its own picture."""
_LIGHT: Final = {
    "shadow": 0,
    "lightDirection": (3.0, 5.0, 10.0),
    "lightAmbientCoeff": 0.65,
    "lightDiffuseCoeff": 0.40,
    "lightSpecularCoeff": 0.0,
}


class Renderer:
    """Renders the pictures of cameras.

    Args:
        map_: the walls and obstacles.
    """

    def __init__(self, map_: Map) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._open = True
        self._models: list[RobotModel] = []
        self._bodies: list[int] = []
        for box in map_.boxes:
            up = (box.z_max or WALL_HEIGHT) / 2
            half, place = (box.length / 2, box.width / 2, up), (box.x, box.y, up)
            self._body([_Part(pybullet.GEOM_BOX, half, place, _WALL, _turned(box.heading))])
        for circle in map_.circles:
            up = (circle.z_max or WALL_HEIGHT) / 2
            half, place = (circle.radius, circle.radius, up), (circle.x, circle.y, up)
            self._body([_Part(pybullet.GEOM_CYLINDER, half, place, _ROUND)])

    def look(self, models: Sequence[RobotModel], poses: Floats) -> None:
        """Take in where all robots are, shape (robots, 3), before the pictures of a tick."""
        if list(models) != self._models:
            for body in self._bodies:
                pybullet.removeBody(body, physicsClientId=self._client)
            self._models = list(models)
            self._bodies = [self._body(_parts(model)) for model in models]
        for body, (x, y, theta) in zip(self._bodies, poses.tolist(), strict=True):
            self._put(body, (x, y, 0.0), _turned(theta))

    def picture(self, spec: CameraSpec, row: int, pose: tuple[float, float, float]) -> "Picture":
        """Draw what a camera sees among the robots that `look` was given.

        Args:
            row: the row of the robot that carries it. pose: that robot's x and y in m and its heading in rad.

        Returns:
            shape (rows, columns, 3), uint8.
        """
        x, y, theta = pose
        self._put(self._bodies[row], _AWAY, _FLAT)
        c, s, up, ahead = math.cos(theta), math.sin(theta), math.sin(spec.tilt), math.cos(spec.tilt)
        eye = (x + spec.x * c, y + spec.x * s, spec.height)
        target = (eye[0] + ahead * c, eye[1] + ahead * s, eye[2] + up)
        view = pybullet.computeViewMatrix(eye, target, (-up * c, -up * s, ahead))
        vertical = 2 * math.atan(math.tan(spec.fov / 2) * spec.rows / spec.columns)
        projection = pybullet.computeProjectionMatrixFOV(
            math.degrees(vertical), spec.columns / spec.rows, NEAR_PLANE, FAR_PLANE
        )
        _, _, rgba, _, segments = pybullet.getCameraImage(
            spec.columns,
            spec.rows,
            view,
            projection,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
            **_LIGHT,
        )
        self._put(self._bodies[row], (x, y, 0.0), _turned(theta))
        shape = (spec.rows, spec.columns)
        drawn = np.asarray(rgba, dtype=np.uint8).reshape(*shape, 4)[:, :, :3]
        nothing = np.asarray(segments).reshape(shape) < 0
        return np.where(nothing[:, :, np.newaxis], _background(spec), drawn)

    def close(self) -> None:
        """Disconnect from PyBullet. Idempotent."""
        if self._open:
            self._open = False
            pybullet.disconnect(physicsClientId=self._client)

    def _put(self, body: int, place: _Vector3, turn: _Quaternion) -> None:
        pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=self._client)

    def _body(self, parts: "Sequence[_Part]") -> int:
        shape = pybullet.createVisualShapeArray(
            shapeTypes=[part.shape for part in parts],
            halfExtents=[part.half for part in parts],
            radii=[part.half[0] for part in parts],
            lengths=[2 * part.half[2] for part in parts],
            rgbaColors=[part.colour for part in parts],
            visualFramePositions=[part.place for part in parts],
            visualFrameOrientations=[part.turn for part in parts],
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(0.0, -1, shape, physicsClientId=self._client)
        return body


@dataclass(frozen=True)
class _Part:
    """A part of a body.

    Args:
        shape: a box or a cylinder. half: half of its length, width and height, m.
        place, turn: where it is in the body's frame, m, as a quaternion.
    """

    shape: int
    half: _Vector3
    place: _Vector3
    colour: _Rgba
    turn: _Quaternion = _FLAT


def _parts(model: RobotModel) -> list[_Part]:
    """A robot: a hull between its wheels, a deck that is as large as the robot, and its laser. The origin is below."""
    drivetrain = model.drivetrain
    between = min(abs(wheel.y) for wheel in drivetrain.wheels) * 2
    inside = max(between - drivetrain.wheel_width, model.width / 4)
    tall = max(model.height - _CLEARANCE - _DECK, 0.01)
    r, g, b = model.colour
    hull = _Part(
        pybullet.GEOM_BOX,
        (model.length / 2, inside / 2, tall / 2),
        (0.0, 0.0, _CLEARANCE + tall / 2),
        (r / 255, g / 255, b / 255, 1.0),
    )
    deck = _Part(
        pybullet.GEOM_BOX,
        (model.length / 2, model.width / 2, _DECK / 2),
        (0.0, 0.0, model.height - _DECK / 2),
        _BLACK,
    )
    radius = drivetrain.wheel_radius
    half = (radius, radius, drivetrain.wheel_width / 2)
    wheels = [
        _Part(pybullet.GEOM_CYLINDER, half, (wheel.x, wheel.y, radius), _TYRE, _lying(wheel.heading))
        for wheel in drivetrain.wheels
    ]
    laser = model.sensor(LaserSpec)
    if laser is None or laser.height <= model.height:
        return [hull, deck, *wheels]
    half = (_LASER_SIDE / 2, _LASER_SIDE / 2, (laser.height + _LASER_TOP - model.height) / 2)
    return [hull, deck, *wheels, _Part(pybullet.GEOM_BOX, half, (laser.x, 0.0, model.height + half[2]), _BLUE)]


def _lying(heading: float) -> _Quaternion:
    """The turn of a cylinder that rolls along a heading."""
    c, s = math.cos(heading / 2) * math.sqrt(0.5), math.sin(heading / 2) * math.sqrt(0.5)
    return c, s, s, c


def _turned(heading: float) -> _Quaternion:
    return 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)


@cache
def _background(spec: CameraSpec) -> "Picture":
    """The ground and the sky as a camera sees them: shape (rows, columns, 3). Robots and walls come before them."""
    focal = spec.columns / 2 / math.tan(spec.fov / 2)
    down = np.arange(spec.rows) + 0.5 - spec.rows / 2
    # The elevation of the middle of each row. One colour for a whole row keeps the files of the pictures small.
    elevation = spec.tilt - np.arctan(down / focal)
    # The ground fades into the haze with the distance, the sky into the horizon.
    far = np.exp(np.minimum(elevation, 0.0) * 12.0)[:, np.newaxis]
    high = np.clip(elevation * 2.0, 0.0, 1.0)[:, np.newaxis]
    ground = _GROUND + far * (_HAZE - _GROUND)
    sky = _HORIZON + high * (_SKY - _HORIZON)
    colours = np.where(elevation[:, np.newaxis] < 0.0, ground, sky).astype(np.uint8)
    return np.repeat(colours[:, np.newaxis], spec.columns, axis=1)
