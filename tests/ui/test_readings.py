"""Readings of sensors in words."""

import io
import math

import numpy as np
import pytest
from rich.console import Console

from vrg.bus.codec import Received
from vrg.bus.messages import SensorMessage
from vrg.hal.sensors import png
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.sonar import Sonar
from vrg.hal.sensors.touch import Touch
from vrg.ui.readings import Watched, sensor_table


def scan(*ranges: float) -> Laser:
    data = np.array(ranges, dtype="<f4").tobytes()
    return Laser(angle_min=-math.pi / 2, angle_step=math.pi / 2, range_max=8.0, data=data)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (scan(8.0, 2.5, 1.25), "3 beams, 2 met something; nearest 1.25 m at +90°"),
        (scan(8.0, 8.0, 8.0), "3 beams, nothing within 8 m"),
        (scan(), "0 beams, nothing within 8 m"),
        (Sonar(range_max=5.0, ranges=(5.0, 0.5, 1.234)), "- 0.50 1.23 m"),
        (
            Gps(latitude=math.radians(35.5), longitude=-math.pi / 2, satellites=7),
            "35.5000000°, -90.0000000°, 7 satellites",
        ),
        (Gps(latitude=None, longitude=None, satellites=3), "no fix, 3 satellites"),
        (Camera(fov=1.0, data=png.encode(np.zeros((24, 32, 3), dtype=np.uint8))), "32 x 24 pixels, 0.1 KB"),
        (Battery(charge=0.98765), "charge 0.988"),
        (Touch(pressed=(False, True, False, True)), "pressed at +90°, -90°"),
        (Touch(pressed=(False, False)), "none of 2 pressed"),
        (Encoders(counts=(3, -4)), "counts (3 -4)"),
    ],
)  # fmt: skip
def test_a_reading_is_told_in_one_line(message: SensorMessage, words: str) -> None:
    assert message.words == words


def test_the_rate_is_that_of_match_time_and_begins_anew_with_the_world() -> None:
    watched, battery = Watched(), ("battery", "main")
    assert watched.rate(battery) is None
    for number in range(100):
        watched.take(battery, Received("k", number / 10, number, Battery(charge=0.5)))
    assert watched.rate(battery) == pytest.approx(10.0)
    watched.take(battery, Received("k", 0.0, 0, Battery(charge=0.5)))
    assert watched.rate(battery) is None


def test_the_table_has_a_line_for_each_sensor() -> None:
    watched = Watched()
    watched.take(("laser", "rear"), Received("k", 1.0, 0, scan(1.0)))
    watched.take(("laser", "front"), Received("k", 1.5, 0, scan(2.0)))
    console = Console(file=io.StringIO(), width=100)
    console.print(sensor_table(watched, "sue", 2.0))
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert "sue" in lines[0]
    assert [line.split()[:4] for line in lines[2:]] == [
        ["laser", "front", "0.50", "1"],
        ["laser", "rear", "1.00", "1"],
    ]
