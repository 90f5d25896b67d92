"""The JSON schemas of a recording, judged as viewers judge them."""

import enum
import json
from typing import Literal

import pytest
from msgspec import Struct

from vrg.bus.messages import Zone
from vrg.bus.topics import Keys
from vrg.hal.sensors import SENSORS
from vrg.recording import foxglove
from vrg.recording.schemas import json_schema
from vrg.regions import Circle, Polygon, Rectangle, Sector
from vrg.types import Pose

VIEWS = [
    one for one in vars(foxglove).values()
    if isinstance(one, type) and issubclass(one, Struct) and one is not Struct
]  # fmt: skip
MESSAGES = {line.message for line in Keys.lines()}
READINGS = [SENSORS.get(name).message for name in SENSORS.names()]


def refuse(schema, path="it"):
    """Raise where the readers of schemas in Lichtblick and in Foxglove raise (their parseJsonSchema.ts)."""
    assert schema.get("type") == "object", f"{path}: expected an object"
    for name, field in schema["properties"].items():
        here = f"{path}.{name}"
        match field.get("type"):
            case "boolean" | "number" | "integer":
                pass
            case "string":
                assert field.get("contentEncoding") in (None, "base64"), here
            case "object":
                refuse(field, here)
            case "array":
                items = field["items"]
                assert items.get("type") in ("boolean", "number", "integer", "string", "object"), here
                assert "contentEncoding" not in items, here
                if items["type"] == "object":
                    refuse(items, here)
            case other:
                pytest.fail(f"{here}: unsupported type {other}")


@pytest.mark.parametrize("record", [*VIEWS, *sorted(MESSAGES, key=str), *READINGS])
def test_viewers_accept_the_schema_of_every_message_and_of_every_view(record):
    text = json_schema(record)
    refuse(json.loads(text))
    assert b"$ref" not in text
    assert b"anyOf" not in text


def test_a_zone_is_described_with_the_fields_of_every_shape():
    region = json.loads(json_schema(Zone))["properties"]["region"]["properties"]
    for shape in (Rectangle, Circle, Sector):
        assert set(shape.__struct_fields__) <= set(region)
    assert region["shape"] == {"type": "string"}
    assert "points" in Polygon.__struct_fields__
    assert "points" not in region, "viewers know no arrays of arrays"


@pytest.mark.parametrize("record", sorted(MESSAGES, key=str))
def test_the_schema_of_a_message_has_the_unit_of_each_time_length_and_angle(record):
    units = {"time": "s", "clock": "s", "total": "s", "x": "m", "y": "m", "theta": "rad", "v": "m/s", "w": "rad/s"}

    def check(schema, path):
        for name, field in schema.get("properties", {}).items():
            check(field, f"{path}.{name}")
            check(field.get("items", {}), f"{path}.{name}")
            if field["type"] == "number" and name in units:
                assert field.get("description") == units[name], f"{path}.{name}"

    check(json.loads(json_schema(record)), record.__name__)


class Colour(enum.IntEnum):
    """Made up."""

    RED = 1


class Odd(Struct):
    """A sensor of another package may say anything."""

    maybe: float | None
    either: int | str
    nested: list[list[int]]
    words: Literal["a", "b"]
    colour: Colour
    data: bytes
    several: list[bytes]
    table: dict[str, list[int]]
    pair: tuple[float, float]
    place: Pose | None
    more: "list[Odd]"


def test_what_viewers_cannot_describe_is_left_out():
    schema = json.loads(json_schema(Odd))
    refuse(schema)
    assert {name: field["type"] for name, field in schema["properties"].items()} == {
        "maybe": "number",
        "words": "string",
        "colour": "integer",
        "data": "string",
        "table": "object",
        "pair": "array",
        "place": "object",
    }
