"""The recorded 3-D scene: each robot a box with an arrow and its name, coloured by role; each zone an outline.

A physical robot's box has a white rim, as in the spectator's window.
"""

import math
from dataclasses import dataclass
from typing import Final

from vrg.bus import foxglove as fg
from vrg.bus import messages as m
from vrg.colours import GREEN, GREY, Rgb, role_colour


@dataclass(frozen=True)
class Shape:
    """How large a robot is, and where its laser is.

    Args:
        length, width, height: m. laser_x: m ahead of the body's centre.
    """

    length: float = 0.5
    width: float = 0.4
    height: float = 0.25
    laser_x: float = 0.0

    def laser_pose(self, body: m.Pose) -> fg.Pose:
        """Where the laser is when the body is at `body`."""
        x = body.x + self.laser_x * math.cos(body.theta)
        y = body.y + self.laser_x * math.sin(body.theta)
        return fg.pose_of(x, y, body.theta)


def robot_entity(
    name: str, pose: fg.Pose, shape: Shape, role: str, state: str, at: fg.Time, *, physical: bool
) -> fg.SceneEntity:
    """A robot in the scene; `pose` is on the ground."""
    x, y, turned = pose.position.x, pose.position.y, pose.orientation
    middle = fg.Pose(fg.Vector3(x, y, shape.height / 2), turned)
    top = fg.Pose(fg.Vector3(x, y, shape.height + 0.02), turned)
    above = fg.Pose(fg.Vector3(x, y, shape.height + 0.3), turned)
    size = fg.Vector3(shape.length, shape.width, shape.height)
    box = fg.CubePrimitive(middle, size, _color(role_colour(role, state)))
    arrow = fg.ArrowPrimitive(top, shape.length * 0.5, 0.06, 0.18, 0.16, _WHITE)
    text = fg.TextPrimitive(above, True, 0.25, False, _WHITE, f"{name} ({state or role})")
    rim = [_rim(top, shape)] if physical else []
    return fg.SceneEntity(at, fg.FRAME, name, _FOREVER, False, [arrow], [box], rim, [text])


def _rim(top: fg.Pose, shape: Shape) -> fg.LinePrimitive:
    x, y = shape.length / 2, shape.width / 2
    corners = [fg.Vector3(a, b, 0.0) for a, b in ((x, y), (-x, y), (-x, -y), (x, -y))]
    return fg.LinePrimitive(1, top, 0.05, False, corners, _WHITE)


def zone_entity(zone: m.Zone, at: fg.Time) -> fg.SceneEntity:
    """A zone's outline; the safe one is green."""
    corners = [
        fg.Vector3(x, y, 0.01)
        for x, y in (
            (zone.x_min, zone.y_min),
            (zone.x_max, zone.y_min),
            (zone.x_max, zone.y_max),
            (zone.x_min, zone.y_max),
        )
    ]
    colour = _color(GREEN if zone.kind == "safe" else GREY)
    line = fg.LinePrimitive(1, _ORIGIN, 0.06, False, corners, colour)
    return fg.SceneEntity(at, fg.FRAME, f"zone:{zone.name}", _FOREVER, False, [], [], [line], [])


def _color(rgb: Rgb) -> fg.Color:
    return fg.Color(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, 1.0)


_WHITE: Final = _color((255, 255, 255))
_ORIGIN: Final = fg.pose_of(0.0, 0.0, 0.0)
_FOREVER: Final = fg.Time(0, 0)
