"""The content of a match as messages of ROS 2: pure functions from VRG's values to fields.

Frames and units are those of REP 103 and REP 105: `map`, and for each robot `NAME/odom` and `NAME/base_link`, whose
origin is on the ground below the middle of the body, x ahead, y left, z up; m, rad and s. A time is match time, which
`/clock` tells, so nodes need `use_sim_time`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final
from xml.sax.saxutils import quoteattr

from vrg.bus.messages import FieldObject
from vrg.hal.models import RobotModel
from vrg.regions import Region, surrounding
from vrg.types import Pose, Twist, Uncertainty

Fields = dict[str, Any]

MAP: Final = "map"
_WHITE: Final = (1.0, 1.0, 1.0)
CYLINDER, LINE_STRIP, TEXT = 3, 4, 9
"""Kinds of markers (visualization_msgs/Marker)."""


def stamp(seconds: float) -> Fields:
    """The time of a message, which can hold 68 years."""
    nanoseconds = round(min(max(0.0, seconds), 2.0**31 - 1.0) * 1e9)
    return {"sec": nanoseconds // 1_000_000_000, "nanosec": nanoseconds % 1_000_000_000}


def header(seconds: float, frame: str) -> Fields:
    """The header of a message."""
    return {"stamp": stamp(seconds), "frame_id": frame}


def pose(at: Pose, height: float = 0.0) -> Fields:
    """A pose on the ground, or `height` above it, m."""
    return {"position": {"x": at.x, "y": at.y, "z": height}, "orientation": quaternion(at.theta)}


def pose_stamped(seconds: float, at: Pose) -> Fields:
    """geometry_msgs/PoseStamped: where a robot is on the map."""
    return {"header": header(seconds, MAP), "pose": pose(at)}


def quaternion(heading: float) -> Fields:
    """A turn about the vertical axis, rad."""
    return {"z": math.sin(heading / 2), "w": math.cos(heading / 2)}


def twist(of: Twist) -> Fields:
    """A velocity in the robot's frame."""
    return {"linear": {"x": of.v, "y": of.side, "z": of.climb}, "angular": {"z": of.w}}


def covariance(known: Uncertainty | None) -> list[float]:
    """The covariance of x, y, z and the turns about them, 6 rows; zeros where it is not known."""
    found = [0.0] * 36
    if known is not None:
        found[0], found[1], found[6], found[7], found[35] = known.xx, known.xy, known.xy, known.yy, known.heading
    return found


def odometry(seconds: float, robot: str, at: Pose, moves: Twist, known: Uncertainty | None = None) -> Fields:
    """nav_msgs/Odometry: where a robot is in its frame `odom`, and how it moves."""
    return {
        "header": header(seconds, f"{robot}/odom"),
        "child_frame_id": f"{robot}/base_link",
        "pose": {"pose": pose(at), "covariance": covariance(known)},
        "twist": {"twist": twist(moves)},
    }


def transform(seconds: float, parent: str, child: str, at: Pose, height: float = 0.0) -> Fields:
    """geometry_msgs/TransformStamped: where a frame is in another one."""
    return {
        "header": header(seconds, parent),
        "child_frame_id": child,
        "transform": {"translation": {"x": at.x, "y": at.y, "z": height}, "rotation": quaternion(at.theta)},
    }


def scan(
    seconds: float,
    frame: str,
    angle_min: float,
    step: float,
    longest: float,
    ranges: Sequence[float],
    scan_time: float = 0.0,
) -> Fields:
    """sensor_msgs/LaserScan, by REP 117: a beam that met nothing reads infinity, one that has measured nothing NaN.

    Args:
        scan_time: between two scans, s.
    """
    return {
        "header": header(seconds, frame),
        "angle_min": angle_min,
        "angle_max": angle_min + step * max(0, len(ranges) - 1),
        "angle_increment": step,
        "scan_time": scan_time,
        "range_max": longest,
        "ranges": [math.nan if value == 0.0 else value if value < longest else math.inf for value in ranges],
    }


def battery(seconds: float, charge: float) -> Fields:
    """sensor_msgs/BatteryState of which only the charge is known, from 0 to 1; what is not measured is NaN."""
    unknown = dict.fromkeys(("voltage", "temperature", "current", "charge", "capacity", "design_capacity"), math.nan)
    return {"header": header(seconds, ""), **unknown, "percentage": charge, "present": True}


def reach(seconds: float, frame: str, distance: float, cone: float, shortest: float, longest: float) -> Fields:
    """sensor_msgs/Range of a transducer; infinity if it hears no echo (REP 117). `cone` is its opening angle, rad."""
    return {
        "header": header(seconds, frame),
        "field_of_view": cone,
        "min_range": shortest,
        "max_range": longest,
        "range": distance if distance < longest else math.inf,
    }


def occupancy(seconds: float, obstacles: Sequence[Region], around: Sequence[Region], cell: float = 0.1) -> Fields:
    """nav_msgs/OccupancyGrid of a map: 100 where the middle of a cell is in an obstacle, 0 elsewhere.

    Args:
        obstacles: the ground that walls and obstacles cover, m. around: what else it must show, m.
        cell: the side of a cell, m.
    """
    x0, y0, x1, y1 = surrounding(region.bounds for region in (*obstacles, *around))
    columns, rows = max(1, math.ceil((x1 - x0) / cell)), max(1, math.ceil((y1 - y0) / cell))
    cells = [0] * (rows * columns)
    for obstacle in obstacles:
        left, low, right, high = obstacle.bounds
        for row in range(max(0, int((low - y0) / cell)), min(rows, math.ceil((high - y0) / cell))):
            for column in range(max(0, int((left - x0) / cell)), min(columns, math.ceil((right - x0) / cell))):
                if obstacle.contains(x0 + (column + 0.5) * cell, y0 + (row + 0.5) * cell):
                    cells[row * columns + column] = 100
    return {
        "header": header(seconds, MAP),
        "info": {"resolution": cell, "width": columns, "height": rows, "origin": pose(Pose(x0, y0, 0.0))},
        "data": cells,
    }


def outline(seconds: float, number: int, name: str, region: Region, colour: Sequence[float] = _WHITE) -> list[Fields]:
    """Markers of a zone: its outline and its name. Colours are red, green and blue from 0 to 1."""
    points = [{"x": x, "y": y, "z": 0.02} for x, y in region.outline()]
    common = _marker(seconds, Pose(0.0, 0.0, 0.0), colour)
    x, y = region.middle
    return [
        {
            **common, "ns": "zones", "id": number, "type": LINE_STRIP, "scale": {"x": 0.05},
            "points": [*points, points[0]],
        },
        {
            **common, "ns": "names", "id": number, "type": TEXT, "scale": {"z": 0.4}, "text": name,
            "pose": pose(Pose(x, y, 0.0), 0.1),
        },
    ]  # fmt: skip


def things(
    seconds: float,
    objects: Sequence[tuple[FieldObject, Pose]],
    colour: Callable[[str | None], Sequence[float]],
) -> list[Fields]:
    """Markers of things that are no robots, such as flags.

    Args:
        objects: the things, and where each is. colour: returns the colour of a team.
    """
    return [
        {
            **_marker(seconds, at, colour(thing.team), 0.5),
            "ns": thing.kind, "id": number, "type": CYLINDER, "scale": {"x": 0.2, "y": 0.2, "z": 1.0},
        }
        for number, (thing, at) in enumerate(objects)
    ]  # fmt: skip


def note(seconds: float, number: int, text: str, at: Pose, shown: float) -> Fields:
    """A marker of a call of the referee, which is shown for a while, s, above a place."""
    whole = stamp(shown)
    return {
        **_marker(seconds, at, _WHITE, 1.2),
        "ns": "calls", "id": number, "type": TEXT, "scale": {"z": 0.4}, "text": text, "lifetime": whole,
    }  # fmt: skip


def _marker(seconds: float, at: Pose, colour: Sequence[float], height: float = 0.0) -> Fields:
    r, g, b = colour
    color = {"r": r, "g": g, "b": b, "a": 1.0}
    return {"header": header(seconds, MAP), "pose": pose(at, height), "color": color}


def urdf(robot: str, model: RobotModel, mounts: Mapping[str, tuple[Pose, float]]) -> str:
    """The description of a robot as URDF: a box of its size, and the frames of its sensors.

    Args:
        mounts: where its sensors are, and how high above the ground, m, by the names of their frames.
    """
    links = [
        f'<link name="{robot}/base_link"><visual><origin xyz="0 0 {model.height / 2:g}"/><geometry>'
        f'<box size="{model.length:g} {model.width:g} {model.height:g}"/></geometry></visual></link>'
    ]
    for frame, (at, height) in mounts.items():
        links.append(
            f'<link name={quoteattr(frame)}/><joint name={quoteattr(frame + "_joint")} type="fixed">'
            f'<parent link="{robot}/base_link"/><child link={quoteattr(frame)}/>'
            f'<origin xyz="{at.x:g} {at.y:g} {height:g}" rpy="0 0 {at.theta:g}"/></joint>'
        )
    return f'<?xml version="1.0"?><robot name={quoteattr(robot)}>{"".join(links)}</robot>'


def satellite_fix(seconds: float, frame: str, latitude: float | None, longitude: float | None, noise: float) -> Fields:
    """sensor_msgs/NavSatFix, of a receiver whose errors east and north have the deviation `noise`, m.

    Args:
        latitude, longitude: rad, WGS 84; None without a fix.
    """
    known = latitude is not None and longitude is not None
    return {
        "header": header(seconds, frame),
        "status": {"status": 0 if known else -1, "service": 1},
        "latitude": math.nan if latitude is None else math.degrees(latitude),
        "longitude": math.nan if longitude is None else math.degrees(longitude),
        "altitude": math.nan,
        "position_covariance": [noise**2, 0.0, 0.0, 0.0, noise**2, 0.0, 0.0, 0.0, 0.0],
        "position_covariance_type": 1,
    }
