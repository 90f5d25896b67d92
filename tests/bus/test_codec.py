"""Messages survive the wire; anything else is refused with the key and the field."""

import enum
import math
import threading
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Struct, structs

from vrg.bus import codec
from vrg.bus import messages as m
from vrg.bus.codec import Received, decode, encode, header
from vrg.bus.topics import Keys
from vrg.errors import MessageError, MisroutedError
from vrg.hal.sensors import SENSORS, png
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.sonar import Sonar
from vrg.hal.sensors.touch import Touch
from vrg.regions import Circle, Polygon, Rectangle, Sector
from vrg.types import FrozenDict, Pose, Twist, Uncertainty, printable


def texts(max_size: int) -> st.SearchStrategy[str]:
    return st.text(max_size=max_size).map(printable).map(lambda text: text[:max_size])


coordinates = st.floats(-1e5, 1e5)
angles = st.floats(-1e4, 1e4)
poses = st.builds(Pose, coordinates, coordinates, angles)
uncertainties = st.builds(
    Uncertainty, st.floats(0, 1e10), st.floats(-1e10, 1e10), st.floats(0, 1e10), st.floats(0, 1e10)
)
names = st.text("abcdefghijklmnopqrstuvwxyz0123456789_-", min_size=1, max_size=20)
seconds = st.floats(0, 1e8)
counts = st.integers(0, 2**53)
speeds = st.floats(-100, 100)
spins = st.floats(-1000, 1000)
twists = st.builds(Twist, speeds, spins, st.just(0.0) | speeds)


own_places = st.builds(
    m.OwnPlace,
    st.floats(0, 1e8),
    pose=st.none() | poses,
    earth=st.none() | st.tuples(st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)),
)


def tuples(items: st.SearchStrategy[Any], **sizes: int) -> st.SearchStrategy[tuple[Any, ...]]:
    """Tuples of so many of these."""
    return st.lists(items, **sizes).map(tuple)


statuses = st.builds(
    m.PlayerStatus,
    name=names, team=names, role=names, state=names, may_move=st.booleans(),
    radius=st.floats(0.01, 10), pose=st.none() | poses, mark=st.none() | poses,
    lease=st.none() | twists,
)  # fmt: skip
lengths = st.floats(1e-6, 1e5)
regions = (
    st.builds(
        lambda x, y, w, h: Rectangle(x, y, min(x + w, 1e5), min(y + h, 1e5)), coordinates, coordinates, lengths, lengths
    )
    | st.builds(Circle, coordinates, coordinates, lengths)
    | st.builds(Sector, coordinates, coordinates, lengths, angles, st.floats(1e-6, math.pi))
    | st.just(Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 3.0))))
)
zones = st.builds(m.Zone, name=names, kind=names, region=regions, team=st.none() | names)
bodies = st.builds(m.Body, name=names, pose=poses, twist=twists, physical=st.booleans(), age=seconds)
sightings = st.builds(
    lambda xx, share, yy, **rest: m.Sighting(xx=xx, xy=share * (xx * yy) ** 0.5, yy=yy, **rest),
    x=coordinates, y=coordinates, time=seconds,
    xx=st.floats(1e-6, 100), share=st.floats(-0.99, 0.99), yy=st.floats(1e-6, 100),
)  # fmt: skip
auctions = st.builds(
    m.Auction,
    lot=names, bidders=tuples(names, max_size=3), opened=seconds, lasts=seconds,
    bids=st.dictionaries(names, st.floats(0, 1e6), max_size=3), winner=st.none() | names,
    evidence=tuples(sightings, max_size=3),
)  # fmt: skip
objects = st.builds(
    m.FieldObject,
    name=names, kind=names, x=coordinates, y=coordinates, team=st.none() | names, carrier=st.none() | names,
)  # fmt: skip
strokes = st.builds(
    m.Stroke,
    points=tuples(st.tuples(coordinates, coordinates), min_size=1, max_size=4), label=texts(max_size=40),
)  # fmt: skip
SMALL_PICTURE = png.encode(np.zeros((2, 3, 3), dtype=np.uint8))
MESSAGES: dict[type[m.Message], st.SearchStrategy[Any]] = {
    m.Clock: st.builds(
        m.Clock, time=seconds, tick=counts, epoch=counts, rate=st.floats(0, 1e4), estop=st.booleans()
    ),
    m.Poses: st.builds(
        m.Poses,
        bodies=tuples(bodies, max_size=4),
    ),
    m.Drive: st.builds(m.Drive, twist=twists, armed=st.booleans()),
    m.RobotState: st.builds(
        m.RobotState, armed=st.booleans(), estop=st.booleans(), fault=st.none() | texts(max_size=50),
    ),
    Ins: st.builds(Ins, pose=poses, uncertainty=st.none() | uncertainties),
    Odometry: st.builds(Odometry, pose=poses, twist=twists),
    Encoders: st.builds(Encoders, counts=tuples(st.integers(-(2**60), 2**60), max_size=4)),
    Touch: st.builds(Touch, pressed=tuples(st.booleans(), max_size=8)),
    Sonar: st.builds(Sonar, range_max=st.just(5.0), ranges=tuples(st.floats(0, 5), max_size=16)),
    Gps: st.builds(
        Gps,
        latitude=st.none() | st.floats(-1.57, 1.57), longitude=st.none() | st.floats(-3.14, 3.14), satellites=counts,
    ),
    Battery: st.builds(Battery, charge=st.floats(0, 1)),
    m.Sightings: st.builds(m.Sightings, seen=tuples(sightings, max_size=4)),
    m.Bid: st.builds(m.Bid, lot=names, cost=st.none() | st.floats(0, 1e6)),
    m.Sketch: st.builds(m.Sketch, strokes=tuples(strokes, max_size=4)),
    m.TeamOrder: st.builds(m.TeamOrder, priority=st.none() | names, lease=st.floats(0, 2)),
    m.Sight: st.builds(m.Sight, poses=st.dictionaries(names, poses, max_size=3)),
    m.Say: st.builds(
        m.Say, words=st.binary(max_size=1024), place=st.none() | st.tuples(coordinates, coordinates)
    ),
    m.Links: st.builds(
        m.Links,
        links=tuples(
            st.builds(
                m.LinkCount,
                speaker=names, arrived=counts, lost=counts, under_way=counts, delay=seconds, longest=seconds,
            ),
            max_size=3,
        ),
    ),
    m.Placed: st.builds(m.Placed, pose=poses, by=names),
    m.SpeedLimit: st.builds(m.SpeedLimit, v_max=st.floats(0.001, 100)),
    m.WorldRequest: st.builds(
        m.WorldRequest,
        kind=st.sampled_from(m.RequestKind), robot=st.none() | names, model=st.none() | names, pose=st.none() | poses,
    ),
    m.WorldAnswer: st.builds(m.WorldAnswer, id=st.none() | names, refused=st.none() | texts(max_size=50)),
    m.Report: st.builds(
        m.Report,
        mode=texts(max_size=30), armed=st.booleans(), manual=st.booleans(), fault=st.none() | texts(max_size=50),
        latched=st.booleans(), estop=st.booleans(),
        command=st.none() | twists, battery=st.none() | st.floats(0, 1),
    ),
    m.MeasuredPose: st.builds(
        m.MeasuredPose, pose=poses, twist=twists, uncertainty=st.none() | uncertainties, unseen=seconds
    ),
    m.Motion: st.builds(m.Motion, odometry=poses, twist=twists, own=tuples(own_places, max_size=2)),
    m.Fixes: st.builds(
        m.Fixes,
        fixes=st.lists(
            st.builds(m.Fix, names, poses, st.floats(1e-6, 1e3), st.none() | st.floats(1e-6, 10.0)), max_size=4
        ).map(tuple),
    ),
    m.Recover: st.builds(m.Recover, by=names),
    m.Manual: st.builds(m.Manual, forward=st.floats(-1, 1), turn=st.floats(-1, 1), lease=st.floats(0, 1)),
    m.RefereeState: st.builds(
        m.RefereeState,
        game=names, stage=st.sampled_from(m.Stage), halted=st.none() | texts(max_size=40),
        way_out=st.none() | texts(max_size=40),
        waiting=tuples(texts(max_size=20), max_size=3), clock=seconds, total=seconds, round=counts, rounds=counts,
        score=st.dictionaries(names, st.integers(0, 99), max_size=3), players=tuples(statuses, max_size=3),
        zones=tuples(zones, max_size=3), auctions=tuples(auctions, max_size=2),
        objects=tuples(objects, max_size=2), numbers=st.dictionaries(names, coordinates, max_size=2),
        winner=st.none() | names, estop=st.booleans(),
    ),
    m.Call: st.builds(
        m.Call,
        number=counts, rule=names, text=texts(max_size=50), players=tuples(names, max_size=3),
        poses=tuples(poses, max_size=3), clock=seconds,
    ),
    m.Official: st.builds(
        m.Official,
        action=st.sampled_from(m.OfficialAction), by=names, reason=texts(max_size=20),
        subject=st.none() | names, value=st.none() | texts(max_size=10),
    ),
    m.Estop: st.builds(m.Estop, by=names, reason=texts(max_size=20)),
    m.EstopRelease: st.builds(m.EstopRelease, by=names, reason=texts(max_size=20)),
    m.CameraRequest: st.builds(m.CameraRequest, lease=st.floats(0.01, 10)),
    Camera: st.builds(
        Camera, fov=st.floats(0.1, 3), data=st.binary(max_size=50).map(lambda rest: SMALL_PICTURE + rest)
    ),
    m.SeatRequest: st.builds(m.SeatRequest, player=names, strategy=texts(max_size=50), by=names, id=names),
    m.SeatAnswer: st.builds(m.SeatAnswer, id=names, refused=st.none() | texts(max_size=50)),
    m.Processes: st.builds(
        m.Processes,
        processes=tuples(
            st.builds(
                m.ProcessStatus,
                name=names, machine=names, state=st.sampled_from(m.ProcessState), node=texts(max_size=20),
                pid=st.none() | counts, cpu=st.floats(0, 64), memory=counts, restarts=counts,
            ),
            max_size=3,
        ),
    ),
    m.Pulse: st.builds(
        m.Pulse, ticks=counts, missed=counts, frequency=st.floats(0, 1e4), late=st.none() | seconds,
        drift=st.none() | st.floats(-10, 10),
    ),
    Laser: st.builds(
        Laser,
        angle_min=angles, angle_step=angles, range_max=coordinates,
        data=tuples(st.floats(0, 80, width=32), max_size=20).map(lambda r: np.array(r, "<f4").tobytes()),
    ),
}  # fmt: skip


def test_every_message_type_is_tried() -> None:
    sensors = {SENSORS.get(kind).message for kind in SENSORS.names()}
    assert set(MESSAGES) | {Laser} == {line.message for line in Keys.lines()} | sensors


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda k: k.__name__)
def test_a_message_comes_back_as_it_was_sent(kind: type[m.Message]) -> None:
    @given(body=MESSAGES[kind], stamp=seconds, sequence=counts)
    def check(body: m.Message, stamp: float, sequence: int) -> None:
        received = decode(encode(Received("k", stamp, sequence, body, "player/ann")), kind, "k")
        assert received == Received("k", stamp, sequence, body, "player/ann")
        assert_immutable(body)
        assert_immutable(received)

    check()


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
def test_a_cut_message_is_refused(kind: type[m.Message]) -> None:
    @given(body=MESSAGES[kind], data=st.data())
    def check(body: m.Message, data: st.DataObject) -> None:
        payload = encode(Received("some/key", 1.0, 2, body))
        cut = data.draw(st.integers(0, len(payload) - 1))
        with pytest.raises(MessageError, match="some/key"):
            decode(payload[:cut], kind, "some/key")

    check()


@given(junk=st.binary(max_size=60))
def test_junk_is_refused_or_valid_but_never_anything_else(junk: bytes) -> None:
    for kind in MESSAGES:
        try:
            decode(junk, kind, "k")
        except MessageError:
            continue


def test_any_reader_of_messagepack_understands_the_wire() -> None:
    payload = encode(Received("k", 3.25, 7, m.Drive(twist=Twist(1.5, -2.0)), "player/ann"), "player/ann/1f")
    assert msgpack.unpackb(payload) == [
        2,
        3,
        "player/ann/1f",
        "k",
        7,
        3.25,
        {"twist": {"v": 1.5, "w": -2.0}, "armed": True},
    ]


def test_any_writer_of_messagepack_is_understood() -> None:
    payload = msgpack.packb([2, 3, "x", "k", 7, 3.25, {"twist": {"v": 1.5, "w": -2}, "armed": True}])
    assert decode(payload, m.Drive, "k").body == m.Drive(twist=Twist(1.5, -2.0))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1001.0, "fast", None])
def test_a_speed_that_is_no_speed_is_refused_by_its_field(value: object) -> None:
    payload = msgpack.packb(
        [2, 3, "x", "vrg/m/robot/a/drive", 0, 0.0, {"twist": {"v": value, "w": 0.0}, "armed": True}]
    )
    with pytest.raises(MessageError, match=r"vrg/m/robot/a/drive: .*twist"):
        decode(payload, m.Drive, "vrg/m/robot/a/drive")


@pytest.mark.parametrize(
    ("wire", "told"),
    [
        ([1, 3, "x", "k", 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}}], "format 2, got 1: run the same release"),
        ([2, 1, "x", "k", 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}}], "version 3 of Drive, got 1"),
        ([2, 3, "x", "k", 0, math.nan, {"twist": {"v": 0.0, "w": 0.0}}], "expected a message"),
        ([2, 3, "x", "k", -1, 0.0, {"twist": {"v": 0.0, "w": 0.0}}], "expected a message"),
        ([2, 3, "x" * 401, "k", 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}}], "expected a message"),
        ([2, 3, "x", "k", 0, 0.0, {"twist": {"v": 0.0}}], "w"),
        ([2, 3, "x", "k", 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}, "speed": 1}], "speed"),
        ([2, 0, 0.0, {"twist": {"v": 0.0, "w": 0.0}}], "of format 2"),
        ({"twist": 0.0}, "of format 2"),
    ],
)
def test_what_is_wrong_is_told(wire: object, told: str) -> None:
    with pytest.raises(MessageError, match=told):
        decode(msgpack.packb(wire), m.Drive, "k")


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
