"""The bus of a running match: foreign and broken messages, those who join late, and the tools that look at it."""

import json
import math
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgpack
import pytest

from tests.system.raw import concrete_keys, raw_publisher
from vrg.bus.codec import Received, encode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock, Drive, Estop
from vrg.bus.session import open_session
from vrg.coordinator.journal import read_journal
from vrg.testing.processes.match import MINNOWS, PLAYERS, LiveMatch
from vrg.testing.waiting import wait_until
from vrg.types import Twist

pytestmark = pytest.mark.system

DRIVE = "vrg/m/robot/ann/drive"
GOOD = encode(Received(DRIVE, 1.0, 1, Drive(twist=Twist(1.0, 1.0))))
CLOCK = Clock(time=1e7, tick=1, epoch=9, rate=1.0, estop=True)


def on(key: str, body: bytes, stamp: float = 1.0, version: int = 1) -> bytes:
    """A message for a key, whose body is given as MessagePack."""
    header = msgpack.packb([2, version, "player/ann/1", key, 1, stamp, 0])
    return header[:-1] + body


BAD: dict[str, Callable[[str], bytes]] = {
    "empty": lambda key: b"",
    "noise": lambda key: bytes(range(256)),
    "truncated": lambda key: GOOD[:-3],
    "longer than it says": lambda key: on(key, b"\x80") + b"\x00",
    "another version": lambda key: on(key, b"\x80", version=99),
    "of an older release": lambda key: b"\x94\x01\x01\xcb" + struct.pack(">d", 1.0) + b"\x80",
    "a stamp that is not a number": lambda key: on(key, b"\x80", math.nan),
    "fields that are not numbers": lambda key: encode(
        Received(key, 1.0, 1, Drive(twist=Twist(float("nan"), float("inf"))))
    ),
    "a field too few": lambda key: on(key, b"\x80"),
    "of another type": lambda key: encode(Received(key, 1e7, 1, CLOCK))[:-1] + b"\x01",
    "of another key": lambda key: encode(Received(f"{key}s", 1.0, 1, Estop(by="nobody"))),
    "a list of four billion": lambda key: on(key, b"\x81\xa6bodies\xdd\xff\xff\xff\xff"),
    "nested without end": lambda key: on(key, b"\x91" * 100_000),
    "text that is not UTF-8": lambda key: on(key, b"\x81\xa2\xff\xfe\x01"),
}
ROUNDS = 3


def test_bad_messages_on_every_key_are_dropped_and_play_goes_on(match: LiveMatch) -> None:
    observer = match.observer
    match.abused = True
    everybody = ("router", "world", "coordinator", "recorder", *PLAYERS)
    before = {name: match.child(name).pid for name in everybody}
    restarts = match.said().count("started again")

    def abuse() -> None:
        clock, said = observer.state.clock, observer.heard.bad
        with raw_publisher(match.endpoint) as put:
            for number in range(ROUNDS):
                for payload in BAD.values():
                    for key in concrete_keys(match.keys, PLAYERS):
                        put(key, payload(key))
                observer.time_passes(0.3, f"after bad messages, round {number}")
        observer.wait_until(lambda: observer.heard.bad > said, "bad messages to be heard here too")
        observer.wait_until(lambda: observer.state.clock >= clock + 1.5 or observer.stalled, "the play clock to go on")
        observer.wait_moving(*MINNOWS)

    observer.undisturbed(abuse)
    for name in ("world", "referee", "recorder", *PLAYERS):
        for words in ("dropped a bad message", "refused a message: "):
            wait_until(lambda name=name, words=words: words in match.log(name), f"{name} to log: {words}")  # type: ignore[misc]
        assert "Traceback" not in match.log(name), match.log(name)
    assert {name: match.child(name).pid for name in everybody} == before
    assert match.said().count("started again") == restarts


@pytest.mark.thorough
def test_who_looks_after_a_match_is_told_how_many_messages_were_refused(match: LiveMatch) -> None:
    match.abused = True
    stray = encode(Received(match.keys.drive("ann").key, 1.0, 0, Drive(twist=Twist(0.0, 0.0)), "player/ann/1"))
    refused = re.compile(rf"{match.keys.match}: ([1-9]\d*) had a wrong key")
    with raw_publisher(match.endpoint) as put:

        def told() -> bool:
            put(match.keys.drive("bob").key, stray)
            return refused.search(match.vrg("doctor").stdout) is not None

        wait_until(told, "the doctor to tell")

    match.observer.wait_moving()


@pytest.mark.thorough
def test_who_joins_late_is_not_given_old_calls_as_new(match: LiveMatch) -> None:
    old = [call.number for record in read_journal(match.run.journal)[1] for call in record.calls]
    assert old, "the begin of the round was called"
    mailbox = Mailbox()
    calls = mailbox.subscribe(match.keys.referee_event)
    with open_session(match.endpoint) as session:
        session.attach(mailbox)
        match.observer.time_passes(1.5, "in which old calls might be repeated")
        session.receive()
        mailbox.handover(0.0)
    assert [call.body.text for call in calls.take() if call.body.number <= max(old)] == []


def test_topics_are_listed_with_rates_and_nodes(match: LiveMatch) -> None:
    listed: dict[str, Any] = {}
    topics: dict[str, Any] = {}

    def heard() -> bool:
        listed.update(json.loads(match.command("topic", "list", "--json", "--for", "0.5")))
        topics.update({row["key"].removeprefix(f"{match.keys.root}/"): row for row in listed["topics"]})
        return {"clock", "robot/ann/drive", "referee/state"} <= topics.keys()

    wait_until(heard, "all topics to be heard within the time for which the command listens")
    assert set(listed["nodes"]) >= {"world/world", "coordinator/referee", "recorder/recorder"} | {
        f"player/{name}" for name in PLAYERS
    }
    assert topics["clock"]["type"] == "Clock"
    assert topics["robot/ann/drive"]["type"] == "Drive"
    assert topics["referee/state"]["type"] == "RefereeState"
    assert all(row["hz"] > 0.0 and row["bytes"] > 0 for row in topics.values())
    assert "clock" in match.command("topic", "list", "--for", "0.5")


@pytest.mark.thorough
def test_the_rate_of_a_topic_is_measured(match: LiveMatch) -> None:
    rows = [json.loads(line) for line in match.command("topic", "hz", "clock", "--json", "--count", "2").splitlines()]
    assert len(rows) == 2
    assert rows[-1]["hz"] > 0.0
    assert rows[-1]["gap_max_ms"] > 0.0


@pytest.mark.thorough
def test_the_readings_of_sensors_come_line_by_line_where_there_is_no_terminal(match: LiveMatch, tmp_path: Path) -> None:
    command = ["show", "sensors", PLAYERS[0], match.keys.match, "--router", match.endpoint]
    printed = tmp_path / "printed"
    with printed.open("wb") as file:
        going = subprocess.Popen([sys.executable, "-m", "vrg", *command], stdout=file)
    try:
        wait_until(lambda: "laser front: 181 beams" in printed.read_text(), "a reading while the command goes on")
    finally:
        going.kill()
        going.wait()
