"""The recorded 3-D scene: robots are boxes with an arrow and a name; all else are the figures of windows.

A robot has the colour of its role. A physical robot's box has a white rim, as in the spectator's window.
"""

from collections.abc import Sequence
from typing import Final

from vrg.colours import Rgb
from vrg.figures import Figure
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.depiction import Cones
from vrg.recording import foxglove as fg
from vrg.types import Pose

SONAR_HEIGHT: Final = 0.2
"""The height above ground in which the cones of a sonar are drawn, m."""
LAYER: Final = 0.002
"""m between surfaces that lie upon each other."""
FIGURE: Final = 3 * LAYER
"""m between figures that lie upon each other."""
STROKE_HEIGHT: Final = 0.1
"""The height of the strokes of players, m above the ground, so that zones do not hide them."""
PIXEL: Final = 0.025
"""The width in m of a line that is a pixel wide in a window."""
UPRIGHT: Final = 1.8
"""What stands upright is drawn larger by this factor, so that it is seen among robots."""
UNKNOWN_SIZE: Final = fg.Vector3(0.5, 0.4, 0.25)
"""Length, width and height in m of a robot whose model is not known."""


def robot_entity(
    name: str, pose: fg.Pose, model: RobotModel | None, colour: Rgb, word: str, at: fg.Time, *, physical: bool
) -> fg.SceneEntity:
    """A robot in the scene.

    Args:
        pose: of its lowest point. model: None where it is not known.
        word: what is written beside its name.
    """
    size = UNKNOWN_SIZE if model is None else fg.Vector3(model.length, model.width, model.height)
    x, y, z, turned = pose.position.x, pose.position.y, pose.position.z, pose.orientation
    middle = fg.Pose(fg.Vector3(x, y, z + size.z / 2), turned)
    top = fg.Pose(fg.Vector3(x, y, z + size.z + 0.02), turned)
    above = fg.Pose(fg.Vector3(x, y, z + size.z + 0.3), turned)
    box = fg.CubePrimitive(middle, size, colour_of(colour))
    arrow = fg.ArrowPrimitive(top, size.x * 0.5, 0.06, 0.18, 0.16, _WHITE)
    text = fg.TextPrimitive(above, True, 0.25, False, _WHITE, f"{name} ({word})")
    rim = [_rim(top, size)] if physical else []
    return fg.SceneEntity(at, fg.FRAME_ID, name, _FOREVER, False, [arrow], [box], rim, [text])


def entity(name: str, figures: Sequence[Figure], at: fg.Time, height: float = 0.0) -> fg.SceneEntity:
    """Figures in the scene: what stands rises from the ground.

    Args:
        height: of what lies, m above the ground.
    """
    lines, texts, triangles, spheres = [], [], [], []
    for figure in figures:
        x, y, metre = figure.at.x, figure.at.y, PIXEL if figure.most == 1.0 else 1.0
        for part, shape in enumerate(figure.shapes):
            low = height + LAYER * min(part, 2)
            points = [
                fg.Vector3(x + UPRIGHT * px, y, UPRIGHT * py) if shape.still else fg.Vector3(x + px, y + py, low)
                for px, py in shape.points
            ]
            if shape.radius and shape.fill is not None:
                size, colour = fg.Vector3(*[2 * metre * shape.radius] * 3), colour_of(shape.fill)
                spheres += [fg.SpherePrimitive(fg.pose_of(p.x, p.y, 0.0, p.z), size, colour) for p in points]
            elif shape.fill is not None:
                triangles.append(_block(points, shape.height, colour_of(shape.fill)))
            if shape.line is not None and not shape.height:
                kind, width = 1 if shape.closed else 0, PIXEL * shape.width
                lines.append(fg.LinePrimitive(kind, _ORIGIN, width, False, points, colour_of(shape.line)))
        if figure.label is not None:
            above, ink = fg.pose_of(x, y, 0.0, 0.2), colour_of(figure.label.ink)
            texts.append(fg.TextPrimitive(above, True, 0.2, False, ink, figure.label.words))
    return fg.SceneEntity(at, fg.FRAME_ID, name, _FOREVER, False, [], [], lines, texts, triangles, spheres)


def _block(ground: list[fg.Vector3], height: float, colour: fg.Color) -> fg.TriangleListPrimitive:
    """A polygon, or the block that stands on it."""
    count = len(ground)
    points = [*ground, *(fg.Vector3(p.x, p.y, p.z + height) for p in ground)] if height else ground
    # The top is a fan, because every region is convex; each side is two triangles.
    top = len(points) - count
    indices = [top + i for corner in range(1, count - 1) for i in (0, corner, corner + 1)]
    for corner in range(count if height else 0):
        after = (corner + 1) % count
        indices += [corner, after, count + after, corner, count + after, count + corner]
    return fg.TriangleListPrimitive(_ORIGIN, points, colour, indices)


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
