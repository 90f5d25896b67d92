"""The recorded 3-D scene: robots are boxes with an arrow and a name, zones are outlines, walls and obstacles blocks.

A robot has the colour of its role. A physical robot's box has a white rim, as in the spectator's window.
"""

from typing import Final

from vrg.bus.messages import Sketch, Zone
from vrg.colours import GREEN, GREY, Rgb
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.depiction import Cones
from vrg.recording import foxglove as fg
from vrg.regions import Region
from vrg.types import Pose, Vector

BLOCK_HEIGHT: Final = 1.0
"""The height of walls and obstacles, m. It is that of the world, `vrg.hal.sim.map.WALL_HEIGHT`."""
FLAG_HEIGHT: Final = 0.9
"""The height of a flag's pole, m."""
SONAR_HEIGHT: Final = 0.2
"""The height above ground in which the cones of a sonar are drawn, m."""
STROKE_HEIGHT: Final = 0.05
"""The height at which strokes are drawn, m above the ground, so that zones do not hide them."""
_DOT: Final = fg.Vector3(0.12, 0.12, 0.12)
"""The size of a dot, m."""
STROKE_WIDTH: Final = 0.04
"""The width of a line, m."""
UNKNOWN_SIZE: Final = fg.Vector3(0.5, 0.4, 0.25)
"""Length, width and height in m of a robot whose model is not known."""


def robot_entity(
    name: str, pose: fg.Pose, model: RobotModel | None, colour: Rgb, word: str, at: fg.Time, *, physical: bool
) -> fg.SceneEntity:
    """A robot in the scene.

    Args:
        pose: on the ground. model: None where it is not known.
        word: what is written beside its name.
    """
    size = UNKNOWN_SIZE if model is None else fg.Vector3(model.length, model.width, model.height)
    x, y, turned = pose.position.x, pose.position.y, pose.orientation
    middle = fg.Pose(fg.Vector3(x, y, size.z / 2), turned)
    top = fg.Pose(fg.Vector3(x, y, size.z + 0.02), turned)
    above = fg.Pose(fg.Vector3(x, y, size.z + 0.3), turned)
    box = fg.CubePrimitive(middle, size, colour_of(colour))
    arrow = fg.ArrowPrimitive(top, size.x * 0.5, 0.06, 0.18, 0.16, _WHITE)
    text = fg.TextPrimitive(above, True, 0.25, False, _WHITE, f"{name} ({word})")
    rim = [_rim(top, size)] if physical else []
    return fg.SceneEntity(at, fg.FRAME_ID, name, _FOREVER, False, [arrow], [box], rim, [text])


def flag_entity(name: str, place: Vector, colour: Rgb, at: fg.Time) -> fg.SceneEntity:
    """A flag: a pole with a cloth in the colour of its team, at a place on the ground, m."""
    x, y = place
    pole = fg.CubePrimitive(fg.pose_of(x, y, 0.0, FLAG_HEIGHT / 2), fg.Vector3(0.04, 0.04, FLAG_HEIGHT), _WHITE)
    cloth = fg.CubePrimitive(
        fg.pose_of(x + 0.2, y, 0.0, FLAG_HEIGHT - 0.14), fg.Vector3(0.36, 0.03, 0.24), colour_of(colour)
    )
    return fg.SceneEntity(at, fg.FRAME_ID, f"object:{name}", _FOREVER, False, [], [pole, cloth], [], [])


def zone_entity(zone: Zone, team: Rgb | None, at: fg.Time) -> fg.SceneEntity:
    """The outline of a zone; a safe one is green, and that of a team has the team's colour."""
    corners = [fg.Vector3(x, y, 0.01) for x, y in zone.region.outline()]
    colour = colour_of(GREEN if zone.kind == "safe" else team or GREY)
    line = fg.LinePrimitive(1, _ORIGIN, 0.06, False, corners, colour)
    return fg.SceneEntity(at, fg.FRAME_ID, f"zone:{zone.name}", _FOREVER, False, [], [], [line], [])


def obstacle_entity(obstacle: Region, number: int, at: fg.Time) -> fg.SceneEntity:
    """A wall or an obstacle of the map, as a block; `number` tells it from the others."""
    ground = obstacle.outline()
    count = len(ground)
    points = [fg.Vector3(x, y, z) for z in (0.0, BLOCK_HEIGHT) for x, y in ground]
    # The top is a fan, because every region is convex; each side is two triangles.
    indices = [count + i for corner in range(1, count - 1) for i in (0, corner, corner + 1)]
    for corner in range(count):
        after = (corner + 1) % count
        indices += [corner, after, count + after, corner, count + after, count + corner]
    block = fg.TriangleListPrimitive(_ORIGIN, points, colour_of(GREY), indices)
    return fg.SceneEntity(at, fg.FRAME_ID, f"obstacle:{number}", _FOREVER, False, [], [], [], [], [block])


def cones_entity(name: str, heard: Cones, body: Pose, at: fg.Time) -> fg.SceneEntity:
    """The cones in which something was heard, as flat triangles that end where it was heard.

    Args:
        name: of the sensor, with that of its robot. body: where the robot was.
    """
    points = []
    for number, distance in enumerate(heard.ranges):
        if distance < heard.range_max:
            (x, y), *ends = heard.outline(number, 2)
            points += [fg.Vector3(x, y, 0.0), *(fg.Vector3(round(x, 3), round(y, 3), 0.0) for x, y in ends)]
    pose = fg.pose_of(round(body.x, 3), round(body.y, 3), body.theta, SONAR_HEIGHT)
    cones = [fg.TriangleListPrimitive(pose, points, _ECHO, [])]
    return fg.SceneEntity(at, fg.FRAME_ID, name, _SHORT, False, [], [], [], [], cones if points else [])


def sketch_entity(player: str, sketch: Sketch, colour: Rgb, at: fg.Time) -> fg.SceneEntity:
    """The sketch of a player in the scene: dots are spheres, lines are lines with a dot at the end."""
    shade = colour_of(colour)
    dots, lines, texts = [], [], []
    for stroke in sketch.strokes:
        x, y = stroke.points[-1]
        if len(stroke.points) == 1:
            dots.append(fg.SpherePrimitive(fg.pose_of(x, y, 0.0, STROKE_HEIGHT), _DOT, shade))
        else:
            points = [fg.Vector3(x, y, STROKE_HEIGHT) for x, y in stroke.points]
            lines.append(fg.LinePrimitive(0, fg.pose_of(0.0, 0.0, 0.0), STROKE_WIDTH, False, points, shade))
        if stroke.label:
            place = fg.pose_of(x, y, 0.0, 4 * STROKE_HEIGHT)
            texts.append(fg.TextPrimitive(place, True, 0.2, False, shade, stroke.label))
    name = f"sketch:{player}"
    return fg.SceneEntity(at, fg.FRAME_ID, name, _FOREVER, False, [], [], lines, texts, spheres=dots)


def _rim(top: fg.Pose, size: fg.Vector3) -> fg.LinePrimitive:
    x, y = size.x / 2, size.y / 2
    corners = [fg.Vector3(a, b, 0.0) for a, b in ((x, y), (-x, y), (-x, -y), (x, -y))]
    return fg.LinePrimitive(1, top, 0.05, False, corners, _WHITE)


def colour_of(rgb: Rgb) -> fg.Color:
    """A colour as viewers write it."""
    return fg.Color(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, 1.0)


_WHITE: Final = colour_of((255, 255, 255))
_ORIGIN: Final = fg.pose_of(0.0, 0.0, 0.0)
_FOREVER: Final = fg.Time(0, 0)
_ECHO: Final = fg.Color(1.0, 0.8, 0.2, 0.3)
_SHORT: Final = fg.Time(2, 0)
"""For so long an echo is shown if no newer reading comes."""
