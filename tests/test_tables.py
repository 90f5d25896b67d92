"""Regions as people write them in TOML files."""

import math
import tomllib

import pytest
from pydantic import ValidationError

from vrg.regions import Circle, Polygon, Rectangle, Region, Sector
from vrg.tables import RegionSetting, Table


class Plan(Table):
    place: RegionSetting


@pytest.mark.parametrize(
    ("text", "region"),
    [
        ("{ x_min = 0.0, y_min = -1.0, x_max = 2, y_max = 3.0 }", Rectangle(0.0, -1.0, 2.0, 3.0)),
        ('{ shape = "rectangle", x_min = 0.0, y_min = -1.0, x_max = 2, y_max = 3.0 }', Rectangle(0.0, -1.0, 2.0, 3.0)),
        ('{ shape = "circle", x = 1, y = 0.0, radius = 0.6 }', Circle(1.0, 0.0, 0.6)),
        (
            '{ shape = "sector", x = 0.0, y = 0.0, radius = 2.0, start = -45, sweep = 180 }',
            Sector(0.0, 0.0, 2.0, -math.pi / 4, math.pi),
        ),
        (
            '{ shape = "polygon", points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }',
            Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))),
        ),
    ],
    ids=["a rectangle by default", "rectangle", "circle", "sector in degrees", "polygon"],
)
def test_every_region_can_be_written(text: str, region: Region) -> None:
    assert Plan.model_validate(tomllib.loads(f"place = {text}")).place == region


@pytest.mark.parametrize(
    "text",
    [
        '{ shape = "star", x = 0.0 }',
        '{ shape = "circle", x = 0.0, y = 0.0 }',
        '{ shape = "circle", x = 0.0, y = 0.0, radius = -1.0 }',
        '{ shape = "sector", x = 0.0, y = 0.0, radius = 1.0, start = 0, sweep = "all" }',
        '{ shape = "sector", x = 0.0, y = 0.0, radius = 1.0, start = 0, sweep = 270 }',
        "[1, 2]",
    ],
)
def test_what_is_no_region_is_refused(text: str) -> None:
    with pytest.raises(ValidationError, match="place"):
        Plan.model_validate(tomllib.loads(f"place = {text}"))
