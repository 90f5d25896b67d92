"""GPS: coordinates on the earth, satellites behind walls, and an error that changes slowly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.models import robot_model
from vrg.hal.sensors.gps import Gps, GpsSpec, from_wgs84, to_wgs84
from vrg.hal.sim.map import Map, load_map
from vrg.hal.sim.sensors.base import Instant, Surroundings
from vrg.hal.sim.sensors.suite import SensorSuite
from vrg.hal.sim.shapes import Box
from vrg.regions import Rectangle

ALBUQUERQUE = math.radians(35.083), math.radians(-106.624)
P2AT = robot_model("P2AT")
USUAL = GpsSpec()


@given(st.floats(-1000, 1000), st.floats(-1000, 1000), st.floats(-80, 80))
def test_a_place_is_found_again(x: float, y: float, latitude: float) -> None:
    origin = math.radians(latitude), 0.5
    assert from_wgs84(*to_wgs84((x, y), origin), origin) == pytest.approx((x, y), abs=1e-6)


def test_a_minute_of_latitude_is_a_nautical_mile() -> None:
    """At 45 degrees it is 1852.2 m; a minute of longitude on the equator is 1855.3 m."""
    minute = math.radians(1 / 60)
    assert from_wgs84(math.pi / 4 + minute, 0.0, (math.pi / 4, 0.0))[1] == pytest.approx(1852.2, abs=0.3)
    assert from_wgs84(0.0, minute, (0.0, 0.0))[0] == pytest.approx(1855.3, abs=0.1)


def readings(
    count: int, *, noise: bool = True, spec: GpsSpec = USUAL, boxes: tuple[Box, ...] = (), robot: str = "a"
) -> list[Gps]:
    """What a robot at (10, 20) receives, once a second."""
    map_ = Map("yard", Rectangle(-50, -50, 50, 50), boxes, (), ALBUQUERQUE)
    model = replace(P2AT, sensors=(spec,))

    def now(tick: int) -> Instant:
        pose = np.array([[10.0, 20.0, 0.0]])
        return Instant(tick, 0.02, [model], pose, np.zeros((1, 2)), np.zeros((1, 2)), [0], np.ones(1))

    suite = SensorSuite(Surroundings(map_, 3, noise), [robot], [False], now(0))
    return [message for tick in range(50 * count) for _, _, message in suite.sense(now(tick))]  # type: ignore[misc]


def places(found: list[Gps]) -> np.ndarray:  # type: ignore[type-arg]
    assert all(gps.fix for gps in found)
    return np.array([from_wgs84(g.latitude or 0.0, g.longitude or 0.0, ALBUQUERQUE) for g in found])


def test_without_noise_the_place_is_exact() -> None:
    found = readings(3, noise=False)
    assert len(found) == 3
    assert places(found) == pytest.approx(np.tile((10.0, 20.0), (3, 1)), abs=1e-6)
    assert all(gps.satellites >= 4 for gps in found)


def test_the_error_is_as_large_as_its_spec_says_and_changes_slowly() -> None:
    error = places(readings(4000)) - (10.0, 20.0)
    assert error.std(axis=0) == pytest.approx([1.5, 1.5], rel=0.25)
    steps = np.diff(error, axis=0).std(axis=0)
    assert (steps < 0.3 * error.std(axis=0)).all()
    assert (readings(5, robot="a")[4]) != readings(5, robot="b")[4], "each receiver has its own error"


def test_noise_does_not_depend_on_when_the_world_was_started() -> None:
    assert readings(70)[65] == readings(66)[65]


def test_high_walls_hide_satellites_and_without_four_there_is_no_fix() -> None:
    low = GpsSpec(height=0.1)
    around = tuple(
        Box(10.0 + dx * 0.6, 20.0 + dy * 0.6, 0.0, 0.2 if dx else 2.0, 2.0 if dx else 0.2)
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))
    )
    open_sky, hidden = readings(1, spec=low)[0], readings(1, spec=low, boxes=around)[0]
    assert hidden.satellites < open_sky.satellites
    none = readings(1, spec=replace(low, mask=math.radians(89.9)))[0]
    assert (none.fix, none.latitude, none.longitude) == (False, None, None)
    assert none.satellites < 4


def test_a_map_says_where_it_is_on_the_earth() -> None:
    assert load_map("courtyard").origin == pytest.approx(ALBUQUERQUE)
    assert load_map("open").origin == (0.0, 0.0)
