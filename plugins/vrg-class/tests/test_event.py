"""Timetables: what is refused, when matches begin, what survives a restart, and who may decide."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from datetime import datetime
from pathlib import Path

import psutil
import pytest

from tests.command_line import invoke
from tests.system.harness import long_match
from tests.tiny import TINY
from vrg.errors import ConfigError
from vrg.launch.endpoints import free_port
from vrg.launch.folder_lock import owned
from vrg_class.event.site import EventSite
from vrg_class.event.timetable import Event, Outcome, Slot, read_timetable

TABLE = """title = "Open day"
pause = 60.0
[[matches]]
match = "tiny.toml"
title = "Ann against Bob"
strategies = { minnows = "mine.py:Mine" }
seed = 7
[[matches]]
match = "roboflag"
at = "23:59"
"""
MINE = """from vrg.agents import STILL, Strategy


class Mine(Strategy):
    def act(self, view):
        return STILL
"""
PATIENCE = 120.0


@pytest.fixture
def event(tmp_path: Path) -> Event:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "day.toml").write_text(TABLE)
    return Event(read_timetable(tmp_path / "day.toml"), tmp_path, tmp_path / "day")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "title"),
        ('title = "x"', "matches"),
        ('title = "x"\nmatches = []', "matches"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "25:00"', "at"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "2026-02-30 12:00"', "expected a time"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "0001-01-01 00:00"', "expected a time"),
        ('title = "x"\npause = -1\n[[matches]]\nmatch = "tiny.toml"', "pause"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\ntittle = "y"', "tittle"),
        ("[", "cannot be read"),
    ],
)
def test_a_timetable_is_checked(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "day.toml").write_text(text)
    with pytest.raises(ConfigError, match=words):
        read_timetable(tmp_path / "day.toml")


def test_a_match_has_the_strategies_and_the_seed_of_its_slot(event: Event) -> None:
    setup = event.setup(0)
    assert setup.seed == 7
    assert {player.strategy for player in setup.players if player.team == "minnows"} == {
        f"{event.base / 'mine.py'}:Mine"
    }
    assert event.setup(1).game == "roboflag"
    assert event.titles() == ["Ann against Bob", "roboflag"]


def test_a_match_begins_after_the_pause_and_not_before_its_time(event: Event) -> None:
    noon = datetime(2026, 11, 28, 12, 0).timestamp()
    assert event.due(0, noon, lately=False) == noon
    assert not event.played_lately(noon)
    assert event.due(1, noon, lately=False) == datetime(2026, 11, 28, 23, 59).timestamp()
    late = datetime(2026, 11, 28, 23, 59, 30).timestamp()
    assert event.due(1, late, lately=False) == late


@pytest.mark.parametrize(
    ("at", "ended", "begins"),
    [
        ("00:30", datetime(2026, 11, 28, 23, 40), datetime(2026, 11, 29, 0, 30)),
        ("23:50", datetime(2026, 11, 29, 0, 10), datetime(2026, 11, 29, 0, 10)),
        ("22:00", datetime(2026, 11, 28, 5, 0), datetime(2026, 11, 28, 22, 0)),
        ("09:00", datetime(2026, 11, 28, 14, 59), datetime(2026, 11, 28, 14, 59)),
        ("09:00", datetime(2026, 11, 28, 15, 1), datetime(2026, 11, 29, 9, 0)),
        ("2026-11-30 09:00", datetime(2026, 11, 28, 12, 0), datetime(2026, 11, 30, 9, 0)),
        ("2026-11-27 09:00", datetime(2026, 11, 28, 12, 0), datetime(2026, 11, 28, 12, 0)),
    ],
)
def test_a_time_of_the_day_is_one_at_most_six_hours_ago_or_the_next(
    at: str, ended: datetime, begins: datetime, event: Event
) -> None:
    slot = event.table.matches[1].model_copy(update={"at": at})
    event.table = event.table.model_copy(update={"matches": (slot,)})
    assert datetime.fromtimestamp(event.due(0, ended.timestamp(), lately=True)) == begins


def test_an_evening_match_waits_for_its_evening_if_nothing_was_played_yet(event: Event) -> None:
    night = datetime(2026, 11, 28, 0, 30)
    assert datetime.fromtimestamp(event.due(1, night.timestamp(), lately=False)) == night.replace(hour=23, minute=59)


def test_outcomes_survive_a_restart_and_can_be_taken_back(event: Event) -> None:
    event.keep(0, Outcome(title="Ann against Bob", words="Minnows win", score={"sharks": 1, "minnows": 2}, run="r"))
    again = Event(event.table, event.base, event.folder)
    assert (again.next, again.outcomes) == (1, event.outcomes)
    assert again.state()["matches"][0]["score"] == [("sharks", 1), ("minnows", 2)]
    again.keep(0, None)
    assert Event(event.table, event.base, event.folder).next == 0


def test_outcomes_stay_with_their_matches_if_the_timetable_changes(event: Event) -> None:
    event.keep(1, Outcome(title="roboflag", words="Red wins"))
    event.keep(0, Outcome(title="Ann against Bob", words="Minnows win"))
    first, second = event.table.matches
    another = first.model_copy(update={"title": "Cid against Dee"})

    def changed(*slots: Slot) -> Event:
        return Event(event.table.model_copy(update={"matches": slots}), event.base, event.folder)

    again = changed(another, second, first, second)
    assert {number: one.words for number, one in again.outcomes.items()} == {1: "Red wins", 2: "Minnows win"}
    assert again.next == 0
    again.keep(0, Outcome(title="Cid against Dee", words="Sharks win"))
    assert [*again.outcomes] == [1, 2, 0], "in the order of play"
    for _ in range(2):
        again.repeat()  # once, however often somebody wants it
        assert ([*again.outcomes], again.next, again.state()["repeats"]) == ([1, 2], 0, True)
    again.repeated = None
    again.keep(1, None)
    again.repeat()
    assert again.next == 2, "the last one, also where an earlier one of the timetable is still to be played"
    assert again.played_lately(time.time())
    assert not again.played_lately(time.time() + 30_000.0)
    again.keep(1, Outcome(title="roboflag", words="Red wins"))
    with pytest.raises(ConfigError, match="found that of 'roboflag'"):
        changed(first, another)


def test_only_officials_decide(event: Event) -> None:
    event.keep(0, Outcome(title="Ann against Bob", words="Minnows win"))
    port = free_port("127.0.0.1", 18170, tries=100)
    site = EventSite("127.0.0.1", port, event, 8080, "the-token")
    site.start()

    def act(what: bytes, token: str = "the-token") -> int:
        address, headers = f"http://127.0.0.1:{port}/act", {"Authorization": f"Bearer {token}"}
        try:
            with urllib.request.urlopen(urllib.request.Request(address, what, headers), timeout=20) as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            return error.code

    try:
        assert act(b'{"act": "hold"}', "another") == 401
        assert not event.held
        for wrong in (b"", b'{"act": "sleep"}', b'{"act": "hold", "more": 1}', b"[" * 10_000):
            assert act(wrong) == 400
        assert (act(b'{"act": "hold"}'), event.held) == (200, True)
        assert (act(b'{"act": "go on"}'), event.held) == (200, False)
        assert (act(b'{"act": "begin"}'), event.begun) == (200, True)
        assert (act(b'{"act": "again"}'), event.again) == (200, True)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/state", timeout=20) as answer:
            state = json.load(answer)
        assert (state["title"], state["next"], state["page"]) == ("Open day", 1, 8080)
        assert "the-token" not in json.dumps(state)
    finally:
        site.stop()


@pytest.mark.system
def test_an_event_plays_its_matches_and_goes_on_after_it_was_ended(event: Event, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "vrg",
        "event",
        "day.toml",
        "--listen",
        f"127.0.0.1:{free_port('127.0.0.1', 18270)}",
    ]
    with (tmp_path / "out.txt").open("wb") as out:
        process = subprocess.Popen(command, cwd=tmp_path, stdout=out, stderr=subprocess.STDOUT)
    try:
        until = time.monotonic() + PATIENCE
        while not (event.folder / "outcomes.json").exists():
            waits = process.poll() is None and time.monotonic() < until
            assert waits, (tmp_path / "out.txt").read_text()
            threading.Event().wait(0.1)
        again = Event(event.table, event.base, event.folder)
        assert again.next == 1
        assert (tmp_path / again.outcomes[0].run / "result.json").is_file()
    finally:
        os.kill(process.pid, signal.SIGINT)
        process.wait(PATIENCE)


def test_an_event_is_run_once(event: Event, tmp_path: Path) -> None:
    with owned(event.folder):
        done = invoke("event", str(tmp_path / "day.toml"))
    assert f"process {os.getpid()}, or what it has started, works here already" in str(done.exception)


@pytest.mark.system
def test_the_match_of_an_event_that_is_killed_ends(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text(long_match("long"))
    (tmp_path / "day.toml").write_text('title = "Open day"\n[[matches]]\nmatch = "long.toml"\n')
    listen = f"127.0.0.1:{free_port('127.0.0.1', 18370)}"
    process = subprocess.Popen([sys.executable, "-m", "vrg", "event", "day.toml", "--listen", listen], cwd=tmp_path)
    until = time.monotonic() + PATIENCE
    try:
        while not [*tmp_path.glob("day/runs/*/journal.jsonl")] and time.monotonic() < until:
            threading.Event().wait(0.1)
        started = psutil.Process(process.pid).children(recursive=True)
    finally:
        process.kill()
        process.wait()
    try:
        assert len(started) > 5
        _, alive = psutil.wait_procs(started, PATIENCE)
        assert not alive
    finally:
        for one in psutil.wait_procs(started, 0.0)[1]:
            one.kill()
