"""Messages of ROS 2 as bytes, compared with those of an independent implementation (rosbags)."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from vrg.errors import MessageError
from vrg_ros.cdr import HEADER, decode, encode
from vrg_ros.types import FIELDS, HASHES, RIHS_PREFIX

STORE = get_typestore(Stores.ROS2_JAZZY)
WHOLE = {"int8": 8, "int16": 16, "int32": 32, "uint8": 8, "uint16": 16, "uint32": 32}


def full(kind: str) -> str:
    return kind.replace("/", "/msg/", 1)


def values(kind: str) -> st.SearchStrategy[Any]:
    """Values of a field of a type."""
    if kind in WHOLE:
        bits, signed = WHOLE[kind], not kind.startswith("u")
        return st.integers(-(1 << bits - 1) if signed else 0, (1 << (bits - signed)) - 1)
    if kind == "bool":
        return st.booleans()
    if kind in ("float32", "float64"):
        return st.floats(width=int(kind[5:]), allow_nan=False)
    if kind == "string":
        return st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)
    if kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        return st.lists(values(element), min_size=int(count or 0), max_size=int(count or 3))
    return st.fixed_dictionaries({name: values(of) for name, of in FIELDS[kind].items()})


def foreign(kind: str, value: Any) -> Any:
    """The value as rosbags has it."""
    if kind.endswith("]"):
        element = kind.partition("[")[0]
        if "/" in element:
            return [foreign(element, each) for each in value]
        return np.array(value, dtype=element)
    if "/" not in kind:
        return value
    return STORE.types[full(kind)](**{name: foreign(of, value[name]) for name, of in FIELDS[kind].items()})


@pytest.mark.parametrize("kind", HASHES)
def test_hashes_are_those_of_the_definitions(kind: str) -> None:
    assert STORE.hash_rihs01(full(kind)) == RIHS_PREFIX + HASHES[kind]


@pytest.mark.parametrize("kind", FIELDS)
def test_the_fields_of_a_type_are_those_of_jazzy(kind: str) -> None:
    def words(one: Any) -> str:
        form, what = one
        if form == Nodetype.BASE:
            return str(what[0])
        if form == Nodetype.NAME:
            return str(what).replace("/msg/", "/")
        return f"{words(what[0])}[{what[1] or ''}]"

    _, fields = STORE.fielddefs[full(kind)]
    assert {name: words(of) for name, of in fields} == FIELDS[kind]
    assert list(FIELDS[kind]) == [name for name, _ in fields]


@pytest.mark.parametrize("kind", HASHES)
@settings(max_examples=25)
@given(data=st.data())
def test_the_bytes_are_those_of_another_implementation(kind: str, data: st.DataObject) -> None:
    message = data.draw(values(kind))
    ours = encode(kind, message)
    theirs = bytes(STORE.serialize_cdr(foreign(kind, message), full(kind)))
    assert ours == theirs[: len(ours)]
    assert not any(theirs[len(ours) :]), "it pads the end"
    assert decode(kind, ours) == decode(kind, theirs) == message


def test_a_field_that_is_left_out_is_zero_or_empty() -> None:
    said = {"header": {"frame_id": "map"}}
    found = decode("nav_msgs/Odometry", encode("nav_msgs/Odometry", said))
    assert found["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    assert found["pose"]["covariance"] == [0.0] * 36
    assert encode("std_msgs/String", {"data": "hi"}).hex() == "00010000" + "03000000" + "686900"


def test_what_is_no_such_message_is_refused() -> None:
    for data in (
        b"",
        HEADER,
        HEADER + b"\xff\xff\xff\xff",
        b"\0\0\0\0\x03\0\0\0hi\0",
        encode("std_msgs/String", {})[:-1],
    ):
        with pytest.raises(MessageError, match="std_msgs/String"):
            decode("std_msgs/String", data)
    with pytest.raises(MessageError, match="expected 12 bytes, got 20"):
        decode("rosgraph_msgs/Clock", HEADER + bytes(16))
    for wrong in ({"data": 3}, {"date": "x"}):
        with pytest.raises(ValueError, match="std_msgs/String"):
            encode("std_msgs/String", wrong)
    with pytest.raises(ValueError, match="expected 36 values, got 2"):
        encode("nav_msgs/Odometry", {"pose": {"covariance": [1.0, 2.0]}})
    assert math.isnan(decode("sensor_msgs/Range", encode("sensor_msgs/Range", {"range": math.nan}))["range"])
