"""Names in every language, and the ASCII keys that are made of them."""

import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.naming import names
from vrg.bus import messages as m
from vrg.bus.topics import Keys, key_matches, name_in
from vrg.errors import ConfigError
from vrg.hal.sensors import message_class
from vrg.hal.sensors.laser import Laser
from vrg.names import check_name, chunk_of, name_of, normal

SOME = ["ann", "player-1", "Ольга", "山田", "José", "Αθηνά", "หนึ่ง", "ö", "7-zwerge"]


def test_names_of_every_language_are_names_and_have_keys_of_their_own() -> None:
    assert [check_name(name) for name in SOME] == SOME
    assert len({chunk_of(name) for name in SOME}) == len(SOME)
    assert normal("Jose\u0301") == "José", "also where a mark is typed after its letter"


@pytest.mark.parametrize(
    "text", ["", " ", "a b", "-a", "_a", "a/b", "a*", "a" * 65, "x--a", "́a", "a\n", "🙂", "Jose\u0301"]
)
def test_what_is_no_name_is_told(text: str) -> None:
    with pytest.raises(ConfigError, match="expected 1 to 64 letters, digits, _ and -"):
        check_name(text)


@given(names())
def test_a_key_is_ascii_and_tells_the_name_again(name: str) -> None:
    chunk = chunk_of(name)
    assert re.fullmatch(r"[A-Za-z0-9_-]+", chunk)
    assert name_of(chunk) == name


@given(st.text(alphabet="abcxyz019-_", min_size=1, max_size=20))
@example("x--ib9b")
@example("x--")
def test_whatever_comes_on_the_bus_is_read(chunk: str) -> None:
    assert name_of(chunk).encode(), "a text, whatever it stands for"


def test_the_topics_of_such_names() -> None:
    name = "Ольга"
    keys = Keys("Зимний")
    topic = keys.report(name)
    assert topic.key.isascii()
    assert name_in(topic.key) == name
    assert key_matches(keys.report().key, topic.key)
    assert keys.topic_of(topic.key) == keys.report()
    scan = keys.sensor(Laser, name, "main")
    assert keys.topic_of(scan.key, message_class) == scan
    assert name_of(keys.alive("player", name).split("/")[4]) == name
    assert topic.type is m.Report
