"""The readings of a robot's sensors in words, and as a table for a terminal."""

from collections import deque
from typing import Final

from rich.table import Table
from rich.text import Text

from vrg.bus.codec import Received
from vrg.bus.messages import SensorMessage

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
        if stamps and reading.stamp < stamps[-1]:  # the world has started again
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
            Text(reading.body.words),
        )
    return grid
