"""Messages survive the wire; anything else is refused with the key and the field."""

import enum
import math
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Struct, inspect, structs

from tests.bus.bench import KEYS
from vrg.bus import codec
from vrg.bus import messages as m
from vrg.bus.codec import SEQUENCES, Received, decode, encode, header
from vrg.bus.topics import Keys
from vrg.errors import MessageError, MisroutedError
from vrg.hal.sensors import SENSORS, png
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.laser import Laser
from vrg.regions import Circle, Polygon, Rectangle, Sector
from vrg.types import FrozenDict, Twist, printable


def texts(max_size: int, min_size: int = 0) -> st.SearchStrategy[str]:
    return st.text(min_size=min_size, max_size=max_size).map(printable).map(lambda text: text[:max_size])


def rectangle(x: float, y: float, width: float, height: float, extent: tuple[float, float] | None) -> Rectangle:
    z_min, z_max = (0.0, None) if extent is None else sorted(extent)
    return Rectangle(x, y, min(x + width, 1e5), min(y + height, 1e5), z_min=z_min, z_max=z_max)


def sighting(xx: float, share: float, yy: float) -> m.Sighting:
    return m.Sighting(x=1.0, y=-2.0, time=3.0, xx=xx, xy=share * (xx * yy) ** 0.5, yy=yy)


seconds, counts = st.floats(0, 1e8), st.integers(0, 2**53)
coordinates, lengths, variances = st.floats(-1e5, 1e5), st.floats(1e-6, 1e5), st.floats(1e-6, 100)
SMALL_PICTURE = png.encode(np.zeros((2, 3, 3), dtype=np.uint8))
CHECKED: dict[type, st.SearchStrategy[Any]] = {
    Rectangle: st.builds(
        rectangle, coordinates, coordinates, lengths, lengths, st.none() | st.tuples(coordinates, coordinates)
    ),
    Polygon: st.just(Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 3.0)), z_max=1.5)),
    Circle: st.builds(Circle, coordinates, coordinates, lengths),
    Sector: st.builds(Sector, coordinates, coordinates, lengths, st.floats(-7, 7), st.floats(0.1, 3)),
    m.Sighting: st.builds(sighting, variances, st.floats(-0.99, 0.99), variances),
    Camera: st.builds(
        Camera, fov=st.floats(0.1, 3), data=st.binary(max_size=50).map(lambda rest: SMALL_PICTURE + rest)
    ),
    Laser: st.builds(
        Laser, angle_min=st.floats(-1e4, 1e4), angle_step=st.floats(-1e4, 1e4), range_max=coordinates,
        data=st.lists(st.floats(0, 80, width=32), max_size=20).map(lambda r: np.array(r, "<f4").tobytes()),
    ),
}  # fmt: skip
"""Those of which more must be so than the limits of their fields."""


def tuples(items: st.SearchStrategy[Any], least: int) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(items, min_size=least, max_size=4).map(tuple)


def structs_of(kind: inspect.StructType) -> st.SearchStrategy[Any]:
    required = {field.name: drawn(field.type) for field in kind.fields if field.required}
    optional = {field.name: drawn(field.type) for field in kind.fields if not field.required}
    return st.fixed_dictionaries(required, optional=optional).map(lambda values: kind.cls(**values))


def floats_of(kind: inspect.FloatType) -> st.SearchStrategy[float]:
    return st.floats(
        kind.gt if kind.ge is None else kind.ge, kind.lt if kind.le is None else kind.le,
        exclude_min=kind.gt is not None, exclude_max=kind.lt is not None, allow_nan=False, allow_infinity=False,
    )  # fmt: skip


DRAWN: dict[type[inspect.Type], Callable[[Any], st.SearchStrategy[Any]]] = {
    inspect.StructType: lambda kind: CHECKED[kind.cls] if kind.cls in CHECKED else structs_of(kind),
    inspect.FloatType: floats_of,
    inspect.IntType: lambda kind: st.integers(-(2**60) if kind.ge is None else kind.ge, 2**60),
    inspect.StrType: lambda kind: texts(min(kind.max_length or 50, 50), kind.min_length or 0),
    inspect.BytesType: lambda kind: st.binary(max_size=kind.max_length),
    inspect.VarTupleType: lambda kind: tuples(drawn(kind.item_type), kind.min_length or 0),
    inspect.ListType: lambda kind: st.lists(drawn(kind.item_type), max_size=4),
    inspect.TupleType: lambda kind: st.tuples(*map(drawn, kind.item_types)),
    inspect.DictType: lambda kind: st.dictionaries(drawn(kind.key_type), drawn(kind.value_type), max_size=3),
    inspect.UnionType: lambda kind: st.one_of(*map(drawn, kind.types)),
    inspect.EnumType: lambda kind: st.sampled_from(kind.cls),
    inspect.BoolType: lambda _: st.booleans(),
    inspect.NoneType: lambda _: st.none(),
    inspect.Metadata: lambda kind: drawn(kind.type),
}


def drawn(kind: inspect.Type) -> st.SearchStrategy[Any]:
    """Values of a type within its limits, which are those that docs/bus.md tells."""
    return DRAWN[type(kind)](kind)


SENSED = {SENSORS.get(kind).message for kind in SENSORS.names()}
MESSAGES: dict[type[m.Message], st.SearchStrategy[Any]] = {
    kind: drawn(inspect.type_info(kind))
    for kind in sorted({line.message for line in Keys.lines()} | SENSED, key=lambda kind: kind.__name__)
}


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda k: k.__name__)
@given(data=st.data(), stamp=seconds, sequence=st.integers(0, SEQUENCES - 1))
def test_a_message_comes_back_as_it_was_sent(
    kind: type[m.Message], data: st.DataObject, stamp: float, sequence: int
) -> None:
    sent = Received("k", stamp, sequence, data.draw(MESSAGES[kind]), "player/ann")
    received = decode(encode(sent), kind, "k")
    assert received == sent
    assert_immutable(sent.body)
    assert_immutable(received)


def assert_immutable(value: object) -> None:
    """Many receivers share a message, so nothing in it may be changed, however deep it is."""
    if isinstance(value, Struct):
        with pytest.raises(AttributeError):
            setattr(value, value.__struct_fields__[0], None)
        parts: Iterable[object] = structs.astuple(value)
    elif isinstance(value, FrozenDict):
        with pytest.raises(TypeError, match=r"dict\(table\)"):
            value["x"] = 1
        parts = value.values()
    else:
        assert value is None or isinstance(value, str | int | float | bytes | tuple | enum.Enum), value
        parts = value if isinstance(value, tuple) else ()
    for part in parts:
        assert_immutable(part)


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda k: k.__name__)
@given(data=st.data())
def test_a_cut_message_is_refused(kind: type[m.Message], data: st.DataObject) -> None:
    payload = encode(Received("some/key", 1.0, 2, data.draw(MESSAGES[kind])))
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(MessageError, match="some/key"):
        decode(payload[:cut], kind, "some/key")


@given(junk=st.binary(max_size=60))
def test_junk_is_refused_or_valid_but_never_anything_else(junk: bytes) -> None:
    for kind in MESSAGES:
        try:
            decode(junk, kind, "k")
        except MessageError:
            continue


def test_any_reader_and_writer_of_messagepack_understands_the_wire() -> None:
    drive = m.Drive(twist=Twist(1.5, -2.0))
    wire = [2, 5, "player/ann/1f", "k", 7, 3.25, {"twist": {"v": 1.5, "w": -2.0}, "armed": True, "use": {}}]
    assert msgpack.unpackb(encode(Received("k", 3.25, 7, drive, "player/ann"), "player/ann/1f")) == wire
    wire[-1] = {"twist": {"v": 1.5, "w": -2}, "armed": True}
    assert decode(msgpack.packb(wire), m.Drive, "k").body == drive


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1001.0, "fast", None])
def test_a_speed_that_is_no_speed_is_refused_by_its_field(value: object) -> None:
    key, body = KEYS.drive("a").key, {"twist": {"v": value, "w": 0.0}, "armed": True}
    with pytest.raises(MessageError, match=rf"{key}: .*twist"):
        decode(msgpack.packb([2, 5, "x", key, 0, 0.0, body]), m.Drive, key)


def test_what_a_stranger_calls_a_field_steers_no_terminal() -> None:
    key, body = KEYS.drive("a").key, {"twist": {"v": 0.0, "w": 0.0}, "armed": True, "\x1b[2J": 1}
    with pytest.raises(MessageError) as refused:
        decode(msgpack.packb([2, 5, "x", key, 0, 0.0, body]), m.Drive, key)
    assert "\x1b" not in str(refused.value)


STANDING = {"twist": {"v": 0.0, "w": 0.0}}


@pytest.mark.parametrize(
    ("wire", "told"),
    [
        ([1, 3, "x", "k", 0, 0.0, STANDING], "format 2, got 1: run the same release"),
        ([2, 1, "x", "k", 0, 0.0, STANDING], "version 5 of Drive, got 1"),
        ([2, 5, "x", "k", 0, math.nan, STANDING], "expected a message"),
        ([2, 5, "x", "k", -1, 0.0, STANDING], "expected a message"),
        ([2, 5, "x", "k", 2**32, 0.0, STANDING], "expected a message"),
        ([2, 5, "x" * 401, "k", 0, 0.0, STANDING], "expected a message"),
        ([2, 5, "x", "k", 0, 0.0, {"twist": {"v": 0.0}}], "w"),
        ([2, 5, "x", "k", 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}, "speed": 1}], "speed"),
        ([2, 0, 0.0, STANDING], "of format 2"),
        ({"twist": 0.0}, "of format 2"),
    ],
)
def test_what_is_wrong_is_told(wire: object, told: str) -> None:
    with pytest.raises(MessageError, match=told):
        decode(msgpack.packb(wire), m.Drive, "k")


def test_the_highest_number_of_a_message_is_the_highest_of_a_recording() -> None:
    assert decode(msgpack.packb([2, 5, "x", "k", 2**32 - 1, 0.0, STANDING]), m.Drive, "k").sequence == 2**32 - 1


@given(key=texts(max_size=20), other=texts(max_size=20), body=MESSAGES[m.Drive])
def test_a_message_is_believed_under_its_own_key_only(key: str, other: str, body: m.Drive) -> None:
    payload = encode(Received(key, 1.0, 2, body, "player/ann"))
    assert header(payload, key).sequence == 2
    if other != key:
        for read in (lambda: header(payload, other), lambda: decode(payload, m.Drive, other)):
            with pytest.raises(MisroutedError) as refused:
                read()
            assert (refused.value.key, refused.value.meant, refused.value.sender) == (other, key, "player/ann")


def test_a_scan_with_nan_or_half_a_number_is_refused() -> None:
    good = {"angle_min": 0.0, "angle_step": 0.1, "range_max": 8.0}
    for data in (b"\x00\x00\xc0\x7f", b"\x00\x00\x00"):
        with pytest.raises(MessageError, match="data"):
            decode(msgpack.packb([2, 1, "x", "k", 0, 0.0, {**good, "data": data}]), Laser, "k")


def test_one_thread_at_a_time_makes_decoders(monkeypatch: pytest.MonkeyPatch) -> None:
    """A description of a type that another thread has only half made would crash the process."""
    making: list[type] = []
    overlaps: list[list[type]] = []
    real = msgspec.msgpack.Decoder

    def slow(kind: type) -> Any:
        making.append(kind)
        time.sleep(0.02)
        overlaps.append(list(making))
        made = real(kind)
        making.remove(kind)
        return made

    monkeypatch.setattr(codec, "_bodies", {})
    monkeypatch.setattr(msgspec.msgpack, "Decoder", slow)
    messages = [m.Estop(by="ann"), m.EstopRelease(by="ann"), m.Drive(twist=Twist(0.0, 0.0), armed=False)]
    start = threading.Barrier(2 * len(messages))

    def work(message: m.Message) -> m.Message:
        data = encode(Received("key", 0.0, 0, message))
        start.wait()
        return decode(data, type(message), "key").body

    with ThreadPoolExecutor(2 * len(messages)) as pool:
        assert list(pool.map(work, messages * 2)) == messages * 2
    assert [len(kinds) for kinds in overlaps] == [1] * len(messages)


@pytest.mark.parametrize("sign", ["\x1b", "\n", "\x07", "\x9b", "\u202e"])
def test_what_would_change_a_terminal_is_refused_and_shown_as_text(sign: str) -> None:
    said = f"{sign}[2Jall is well"
    for order in (m.Estop(by="ann", reason=said), m.Estop(by=said), m.Estop(by=f"ann{sign}")):
        with pytest.raises(MessageError):
            decode(encode(Received("key", 0.0, 0, order)), m.Estop, "key")
    assert m.shortened(said) == f"{sign.encode('unicode_escape').decode()}[2Jall is well"
    good = m.Estop(by="ann", reason=m.shortened(said))
    assert decode(encode(Received("key", 0.0, 0, good)), m.Estop, "key").body == good
