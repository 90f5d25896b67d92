"""The bus of a running match: foreign and broken messages, those who join late, and the tools that look at it."""

import json
import struct
from pathlib import Path

import pytest

from tests.system.harness import MINNOWS, PLAYERS, Match, concrete_keys, raw_publisher
from vrg.bus.codec import encode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock, Drive
from vrg.bus.session import open_session
from vrg.hal.sensors import png
from vrg.types import Twist

pytestmark = pytest.mark.system

GOOD = encode(Drive(twist=Twist(1.0, 1.0)), 1.0, 1)
BAD = {
    "empty": b"",
    "noise": bytes(range(256)),
    "truncated": GOOD[:-3],
    "longer than it says": GOOD + b"\x00",
    "another version": b"\x94\x63" + GOOD[2:],
    "a stamp that is not a number": b"\x94\x01\x01\xcb" + struct.pack(">d", float("nan")) + b"\x80",
    "fields that are not numbers": encode(Drive(twist=Twist(float("nan"), float("inf"))), 1.0, 1),
    "a field too few": b"\x94\x01\x01\xcb" + struct.pack(">d", 1.0) + b"\x80",
    "of another key": encode(Clock(time=1e7, tick=1, epoch=9, rate=1.0, estop=True), 1e7, 1)[:-1] + b"\x01",
    "a list of four billion": b"\x94\x01\x01\xcb" + struct.pack(">d", 1.0) + b"\x81\xa6bodies\xdd\xff\xff\xff\xff",
    "nested without end": b"\x94\x01\x01\xcb" + struct.pack(">d", 1.0) + b"\x91" * 100_000,
    "text that is not UTF-8": b"\x94\x01\x01\xcb" + struct.pack(">d", 1.0) + b"\x81\xa2\xff\xfe\x01",
}
ROUNDS = 3


def test_bad_messages_on_every_key_are_dropped_and_play_goes_on(match: Match) -> None:
    observer = match.observer
    everybody = ("router", "world", "coordinator", "recorder", *PLAYERS)
    before = {name: match.child(name).pid for name in everybody}
    restarts = match.said().count("started again")
    clock, calls, said = observer.state.clock, len(observer.heard.calls), observer.heard.bad
    with raw_publisher(match.endpoint) as put:
        for number in range(ROUNDS):
            for payload in BAD.values():
                for key in concrete_keys(match.keys, PLAYERS):
                    put(key, payload)
            observer.time_passes(0.3, f"after bad messages, round {number}")
    observer.wait_until(lambda: observer.heard.bad > said, "bad messages to be heard here too")
    observer.time_passes(1.5, "after bad messages")
    assert observer.playing
    assert observer.state.clock >= clock + 1.5
    assert observer.moving(*MINNOWS)
    assert observer.heard.calls[calls:] == [], "nothing was called, nobody was halted"
    assert {name: match.child(name).pid for name in everybody} == before
    assert match.said().count("started again") == restarts
    for name in ("world", "referee", "recorder", *PLAYERS):
        assert "dropped a bad message" in match.log(name), name
        assert "Traceback" not in match.log(name), match.log(name)


def test_who_joins_late_is_told_at_once_what_holds(match: Match) -> None:
    late = match.join()
    late.wait_until(lambda: late.heard.states, "the referee's state")
    assert late.playing
    assert {p.name for p in late.state.players} == set(PLAYERS)
    # Told once, when the match began: a robot that joins now must know its limit all the same.
    late.wait_until(lambda: set(late.heard.limits) == set(PLAYERS), "the speed limits")
    assert all(0.0 < limit <= 0.7 for limit in late.heard.limits.values())
    assert late.heard.limits == match.observer.heard.limits


def test_who_joins_late_is_not_given_old_calls_as_new(match: Match) -> None:
    assert match.observer.heard.calls, "the begin of the round was called"
    mailbox = Mailbox()
    calls = mailbox.subscribe(match.keys.referee_event)
    with open_session(match.endpoint) as session:
        session.attach(mailbox)
        match.observer.time_passes(1.5, "in which old calls might be repeated")
        session.receive()
        mailbox.handover(0.0)
    assert calls.take() == []


def test_topics_are_listed_with_rates_and_nodes(match: Match) -> None:
    listed = json.loads(match.command("topic", "list", "--json", "--seconds", "2"))
    assert set(listed["nodes"]) >= {"world/world", "coordinator/referee", "recorder/recorder"} | {
        f"player/{name}" for name in PLAYERS
    }
    topics = {row["key"].removeprefix(f"{match.keys.root}/"): row for row in listed["topics"]}
    assert topics["clock"]["type"] == "Clock"
    assert topics["robot/ann/drive"]["type"] == "Drive"
    assert topics["referee/state"]["hz"] < topics["clock"]["hz"]
    assert "clock" in match.command("topic", "list")


def test_a_topic_is_echoed_as_plain_data(match: Match) -> None:
    lines = match.command("topic", "echo", "robot/*/drive", "--count", "8", "--json").splitlines()
    drives = [json.loads(line) for line in lines]
    assert len(drives) == 8
    assert all({"key", "stamp", "sequence", "twist", "armed"} == set(drive) for drive in drives)
    assert {drive["key"].split("/")[3] for drive in drives} <= set(PLAYERS)


def test_the_rate_of_a_topic_is_measured(match: Match) -> None:
    rows = [json.loads(line) for line in match.command("topic", "hz", "clock", "--json", "--count", "2").splitlines()]
    assert len(rows) == 2
    assert rows[-1]["hz"] > 1
    assert rows[-1]["gap_max_ms"] > 0.0


def test_the_sensors_of_a_robot_are_shown_while_it_plays(match: Match) -> None:
    shown = match.vrg("sensors", PLAYERS[0], "--match", match.keys.match, "--router", match.endpoint, "--seconds", "3")
    assert shown.returncode == 0, shown.stderr
    for words in ("181 beams", "sonar rings", "satellites", "encoders main", "charge"):
        assert words in shown.stdout
    nobody = match.vrg("sensors", "nobody", "--match", match.keys.match, "--router", match.endpoint, "--seconds", "1")
    assert nobody.returncode == 1


def test_what_a_robot_sees_is_saved_while_it_plays(match: Match, tmp_path: Path) -> None:
    where = ("--match", match.keys.match, "--router", match.endpoint)
    saved = match.vrg("camera", PLAYERS[0], str(tmp_path / "seen.png"), *where)
    assert saved.returncode == 0, saved.stderr
    assert png.decode((tmp_path / "seen.png").read_bytes()).shape == (240, 320, 3)
