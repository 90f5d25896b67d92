"""What pursuers say to one another: it arrives as it was said, it fits into a message, and nonsense is nothing."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.agents.perception.background import Snapshot
from vrg.bus.codec import checked, plain
from vrg.bus.messages import SAY_LIMIT, Sighting, Sightings
from vrg.games.pursuit_evasion.talk import RANGE_STEP, SIGHTINGS_AT_ONCE, Words, understood, words
from vrg.hal.models import MODELS
from vrg.hal.sensors.laser import LaserSpec
from vrg.types import STILL, Pose, Twist

coordinates = st.floats(-1e5, 1e5)
poses = st.builds(Pose, coordinates, coordinates, st.floats(-1e4, 1e4))
twists = st.builds(Twist, st.floats(-100, 100), st.floats(-1000, 1000))
sightings = st.builds(
    lambda x, y, time, xx, yy, share: Sighting(x=x, y=y, time=time, xx=xx, xy=share * math.sqrt(xx * yy), yy=yy),
    coordinates, coordinates, st.floats(0, 1e8), st.floats(1e-6, 100), st.floats(1e-6, 100), st.floats(-0.9, 0.9),
)  # fmt: skip
snapshots = st.builds(
    lambda origin, heading, first, step, free: Snapshot(origin, heading, first, step, np.array(free, dtype=np.float64)),
    st.tuples(coordinates, coordinates), st.floats(-1e4, 1e4), st.floats(-10, 10), st.floats(1e-3, 1.0),
    st.lists(st.floats(0, 40), max_size=181),
)  # fmt: skip


def sent(said: Any) -> Any:
    """What arrives of what was said."""
    return msgspec.msgpack.decode(msgspec.msgpack.encode(said, enc_hook=plain))


def heard(said: Any) -> Words:
    got = understood(sent(said))
    assert got is not None
    return got


@given(poses, twists, st.lists(sightings, max_size=12), st.none() | snapshots)
def test_what_is_said_arrives(pose: Pose, twist: Twist, seen: list[Sighting], free: Snapshot | None) -> None:
    got = heard(words(pose, twist, seen, free))
    assert (got.pose, got.twist) == (pose, twist)
    assert list(got.sightings) == seen[:SIGHTINGS_AT_ONCE]
    assert (got.snapshot is None) == (free is None)
    if free is None or got.snapshot is None:
        return
    assert (got.snapshot.origin, got.snapshot.heading) == (free.origin, free.heading)
    assert (got.snapshot.angle_min, got.snapshot.angle_step) == (free.angle_min, free.angle_step)
    assert got.snapshot.free.shape == free.free.shape
    said = np.minimum(free.free, 255 * RANGE_STEP)
    assert (got.snapshot.free <= said + 1e-9).all(), "no more is said to be free than is"
    assert (got.snapshot.free > said - RANGE_STEP - 1e-9).all(), "and hardly less"


def test_one_who_stands_says_so_exactly() -> None:
    assert heard(words(Pose(1, 2, 3), STILL, [], None)).twist == STILL


def test_numbers_of_numpy_can_be_said() -> None:
    seen = Sighting(
        x=np.float64(1), y=np.float64(2), time=np.float64(3), xx=np.float64(0.1), xy=np.float64(0), yy=np.float64(0.1)
    )
    got = heard(words(Pose(np.float64(1), np.float64(2), np.float64(3)), STILL, [seen], None))
    assert got.sightings[0].x == 1.0


def lasers() -> list[int]:
    """How many beams the lasers of robot models have."""
    specs = [MODELS.get(name).sensor(LaserSpec) for name in MODELS.names()]
    return [spec.beams for spec in specs if spec is not None]


@pytest.mark.parametrize("beams", [*sorted(set(lasers())), 361, 720, 1081])
def test_the_largest_that_is_said_fits_into_a_message(beams: int) -> None:
    """Half a degree, and the finer ones of other robots: what is too much to say is not said, or less finely."""
    odd = 1.0 / 3.0
    seen = [Sighting(x=odd * 1e5, y=-odd, time=odd * 1e8, xx=odd, xy=odd / 9, yy=odd)] * 20
    for step, far in ((odd / 100, 1e3), (math.pi / beams, 5.0)):
        free = Snapshot((odd, -odd), odd, -odd, step, np.full(beams, far))
        said = words(Pose(odd * 1e5, -odd * 1e5, odd), Twist(odd, -odd), seen, free)
        assert len(msgspec.msgpack.encode(said, enc_hook=plain)) <= SAY_LIMIT


GOOD: dict[str, Any] = {
    "pose": [1.0, 2.0, 3.0, 0.1, 0.2, 0.0],
    "seen": [[1.0, 2.0, 3.0, 0.1, 0.0, 0.1]],
    "free": [[1.0, 2.0, 0.0, -1.5, 0.01], b"\x10\x20"],
}


def test_the_example_that_is_spoilt_below_is_understood() -> None:
    assert understood(GOOD) is not None


def test_what_is_spoilt_is_not_understood() -> None:
    spoilt: list[dict[str, Any]] = [
        {"pose": [1.0, 2.0, 3.0, 0.1]},
        {"pose": [1.0, 2.0, 3.0, 0.1, math.nan]},
        {"pose": [1.0, 2.0, 3.0, 0.1, math.inf]},
        {"pose": [1.0, 2.0, 3.0, 0.1, None]},
        {"pose": [1.0, 2.0, 3.0, 0.1, "fast"]},
        {"pose": [1.0, 2.0, 3.0, 0.1, [1.0]]},
        {"pose": [1e300, 2.0, 3.0, 0.1, 0.0]},
        {"pose": None},
        {"pose": 3.0},
        {"pose": {}},
        {"seen": None},
        {"seen": 3},
        {"seen": {}},
        {"seen": [None]},
        {"seen": [[1.0, 2.0, 3.0]]},
        {"seen": [[1.0, 2.0, 3.0, 0.1, 0.0, 0.0]]},
        {"seen": [[1.0, 2.0, 3.0, 0.1, 0.1, 0.1]]},
        {"seen": [[1.0, 2.0, 3.0, -0.1, 0.0, -0.1]]},
        {"seen": [[1.0, 2.0, math.nan, 0.1, 0.0, 0.1]]},
        {"free": 3},
        {"free": []},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.01]]},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.0], b"\x10"]},
        {"free": [[1.0, 2.0, 0.0, -1.5, -0.1], b"\x10"]},
        {"free": [[1.0, 2.0, 0.0, -1.5], b"\x10"]},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.1], "wide"]},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.1], [1, 2, 3]]},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.1], None]},
        {"free": [[1.0, 2.0, 0.0, -1.5, 0.1], b"\x10", 3]},
        {"free": {"a": 1, "b": 2}},
        {"free": "ab"},
    ]
    wrong = [str(part) for part in spoilt if understood({**GOOD, **part}) is not None]
    assert not wrong, "\n".join(wrong)


def test_what_something_else_says_is_not_understood() -> None:
    said: list[Any] = [None, 3, 2.5, True, "hello", b"hello", [], [1, 2], {}, {"pose": [1, 2, 3, 4, 5]}, {1: 2}]
    wrong = [repr(thing) for thing in said if understood(thing) is not None]
    assert not wrong, "\n".join(wrong)


def test_who_has_seen_nothing_through_its_laser_is_understood() -> None:
    got = understood({**GOOD, "free": [[1.0, 2.0, 0.0, -1.5, 0.01], b""]})
    assert got is None or (got.snapshot is not None and not got.snapshot.contains(np.array([[1.0, 2.0]])).any())


integers = st.integers(-(2**63), 2**64 - 1)
keys = st.sampled_from(["pose", "seen", "free"]) | st.text(max_size=3)
things = st.recursive(
    st.none() | st.booleans() | integers | st.floats() | st.text(max_size=6) | st.binary(max_size=6),
    lambda inner: st.lists(inner, max_size=6) | st.dictionaries(keys, inner, max_size=4),
    max_leaves=25,
)
numbers = st.floats() | integers | st.floats(-1e5, 1e5) | st.floats(1e-6, 1.0)
nearly = st.fixed_dictionaries(
    {
        "pose": st.lists(numbers, min_size=5, max_size=5) | things,
        "seen": st.lists(st.lists(numbers, min_size=6, max_size=6) | things, max_size=10) | things,
    },
    optional={"free": st.tuples(st.lists(numbers, min_size=5, max_size=5), st.binary(max_size=30) | things) | things},
)


@given(things | nearly)
def test_nothing_that_can_be_said_stops_who_listens(said: Any) -> None:
    got = understood(sent(said))
    assert got is None or isinstance(got, Words)
    if got is not None and got.snapshot is not None:
        got.snapshot.contains(np.array([[0.0, 0.0], [1.0, 2.0]]))


@given(nearly)
def test_what_is_understood_is_what_messages_can_hold(said: Any) -> None:
    """So that who listens can draw it and tell it to others."""
    got = understood(sent(said))
    if got is not None:
        assert checked(Sightings(seen=tuple(got.sightings))).seen == tuple(got.sightings)
        assert msgspec.convert(msgspec.to_builtins(got.pose), Pose) == got.pose
        assert msgspec.convert(msgspec.to_builtins(got.twist), Twist) == got.twist
