"""The readings of a robot's sensors in words, and as a table for a terminal."""

import math
import struct
from collections import deque
from collections.abc import Mapping
from typing import Final

import msgspec
from rich.table import Table
from rich.text import Text

from vrg.bus.codec import Received
from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.sonar import Sonar

RATE_OVER: Final = 3.0
"""s of match time over which the rate of a sensor is measured."""

Sensor = tuple[str, str]
"""The kind of a sensor, and its name on its robot."""


class Watched:
    """The newest reading of each sensor of a robot, and how often readings come."""

    def __init__(self) -> None:
        self.newest: dict[Sensor, Received[SensorMessage]] = {}
        self._stamps: dict[Sensor, deque[float]] = {}

    def take(self, sensor: Sensor, reading: Received[SensorMessage]) -> None:
        """Take a reading in."""
        self.newest[sensor] = reading
        stamps = self._stamps.setdefault(sensor, deque(maxlen=1000))
        if stamps and reading.stamp < stamps[-1]:  # the world has begun anew
            stamps.clear()
        stamps.append(reading.stamp)

    def rate(self, sensor: Sensor) -> float | None:
        """Readings a second of match time lately; None before the second reading."""
        stamps = self._stamps.get(sensor, deque())
        recent = [stamp for stamp in stamps if stamp > stamps[-1] - RATE_OVER]
        return (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 1 else None


def sensor_table(watched: Watched, robot: str, time: float) -> Table:
    """A line for each sensor: its name, its rate, the age of its newest reading at match time `time`, and its words."""
    grid = Table(title=f"{robot}, match time {time:.1f} s", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for heading, side in (("sensor", "left"), ("Hz", "right"), ("age, s", "right"), ("reading", "left")):
        grid.add_column(heading, justify=side, header_style="dim")  # type: ignore[arg-type]
    for sensor in sorted(watched.newest):
        reading, rate = watched.newest[sensor], watched.rate(sensor)
        grid.add_row(
            Text(" ".join(sensor)),
            "" if rate is None else f"{rate:.1f}",
            f"{max(0.0, time - reading.stamp):.2f}",
            Text(words_of(reading.body)),
        )
    return grid


def words_of(message: SensorMessage) -> str:
    """A reading in one line, with angles in degrees."""
    if isinstance(message, Laser):
        return _scan(message)
    if isinstance(message, Sonar):
        return " ".join("-" if r >= message.range_max else f"{r:.2f}" for r in message.ranges) + " m"
    if isinstance(message, Gps):
        if message.latitude is None or message.longitude is None:
            return f"no fix, {message.satellites} satellites"
        place = f"{math.degrees(message.latitude):.7f}°, {math.degrees(message.longitude):.7f}°"
        return f"{place}, {message.satellites} satellites"
    if isinstance(message, Camera):
        width, height = message.size
        return f"{width} x {height} pixels, {len(message.data) / 1000:.1f} KB"
    return _fields(msgspec.to_builtins(message))


def _scan(scan: Laser) -> str:
    ranges = struct.unpack(f"<{len(scan.data) // 4}f", scan.data)
    met = [index for index, r in enumerate(ranges) if r < scan.range_max]
    if not met:
        return f"{len(ranges)} beams, nothing within {scan.range_max:g} m"
    nearest = min(met, key=lambda index: ranges[index])
    bearing = math.degrees(scan.angle_min + nearest * scan.angle_step)
    return f"{len(ranges)} beams, {len(met)} met something; nearest {ranges[nearest]:.2f} m at {bearing:+.0f}°"


def _fields(value: object) -> str:
    """Plain data without its brackets; numbers are rounded to a thousandth, angles stay in rad."""
    match value:
        case Mapping():
            return ", ".join(f"{name} {_fields(item)}" for name, item in value.items())
        case list() | tuple():
            return "(" + " ".join(_fields(item) for item in value) + ")"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{round(value, 3) + 0.0:g}"
        case _:
            return str(value)
