"""The journal survives what happens to machines."""

import contextlib
import json
import resource
import signal
import time
from pathlib import Path

import pytest

from vrg.bus.messages import Call, Stage
from vrg.coordinator.journal import Journal, JournalHeader, read_journal, read_standing
from vrg.coordinator.match import Checkpoint
from vrg.errors import JournalError

HEADER = JournalHeader(match="m", game="g", seed=1)


def standing(clock: float = 0.0, **changed: object) -> Checkpoint:
    values: dict[str, object] = {
        "stage": Stage.PLAY_ROUND, "halted": None, "clock": clock, "total": clock, "in_stage": clock,
        "calls": 1, "winner": None, "game": {"round": 1},
    }  # fmt: skip
    return Checkpoint(**(values | changed))  # type: ignore[arg-type]


def call(number: int) -> Call:
    return Call(number=number, rule="tag", text="a tags b", players=("a",), poses=(), clock=1.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal.jsonl"


def filled(path: Path, records: int = 3) -> None:
    with Journal(path, HEADER) as journal:
        for i in range(records):
            journal.append(float(i), [Stage.PLAY_ROUND], [call(i + 1)], standing(float(i)))


def test_what_was_written_is_read_back_and_taken_up_where_it_ended(path: Path) -> None:
    with Journal(path, HEADER) as journal:
        assert journal.standing is None
    filled(path)
    header, records = read_journal(path)
    assert header == HEADER
    assert [r.n for r in records] == [1, 2, 3]
    assert records[2].calls == [call(3)]
    with Journal(path, HEADER) as journal:
        assert journal.standing == standing(2.0)
        journal.append(9.0, [], [call(4)], standing(9.0))
    assert [r.n for r in read_journal(path)[1]] == [1, 2, 3, 4]


def test_a_journal_of_another_release_is_refused_in_words(path: Path) -> None:
    filled(path)
    path.write_text(path.read_text().replace('"journal":3', '"journal":1', 1))
    with pytest.raises(JournalError, match="expected a journal of version 3, got 1: use the VRG that recorded it"):
        read_journal(path)


def test_the_standing_is_read_with_the_clock_of_the_newest_tick(path: Path) -> None:
    with Journal(path, HEADER) as journal:
        assert read_standing(path) is None
        journal.append(1.0, [Stage.PLAY_ROUND], [call(1)], standing(1.0))
        assert read_standing(path) == standing(1.0)
        journal.mark(2.7, 2.7, 2.7)
    assert read_standing(path) == standing(2.7)
    path.with_name(path.name + ".clock").unlink()
    assert read_standing(path) == standing(1.0)


@pytest.mark.parametrize("torn", [1, 10, 100])
def test_a_torn_last_line_is_dropped_and_the_rest_is_good(path: Path, torn: int) -> None:
    filled(path)
    path.write_bytes(path.read_bytes()[:-torn])
    with Journal(path, HEADER) as journal:
        assert journal.standing == standing(1.0)
        journal.append(9.0, [], [], standing(9.0))
    assert [r.n for r in read_journal(path)[1]] == [1, 2, 3]


def test_every_cut_leaves_a_journal_that_can_be_taken_up(path: Path) -> None:
    filled(path)
    whole = path.read_bytes()
    for cut in range(0, len(whole), 17):
        path.write_bytes(whole[:cut])
        with Journal(path, HEADER) as journal:
            journal.append(1.0, [], [], standing(1.0))
        assert read_journal(path)[1][-1].standing == standing(1.0)


def test_damage_before_the_last_line_is_told_with_its_line(path: Path) -> None:
    filled(path)
    lines = path.read_bytes().splitlines(keepends=True)
    lines[2] = b"{}\n"
    path.write_bytes(b"".join(lines))
    damage: list[str] = []
    whole = [line for number, line in enumerate(lines) if number not in (0, 2)]
    assert [record.n for record in read_journal(path, damage)[1]] == [json.loads(line)["n"] for line in whole]
    assert [words.partition(": left out")[0] for words in damage] == [f"{path}:3"], "it is named"


def test_one_of_another_match_a_second_writer_and_one_in_no_folder_are_refused(path: Path) -> None:
    with Journal(path, HEADER) as journal:
        with pytest.raises(JournalError, match="another coordinator is writing it"):
            Journal(path, HEADER)
        journal.close()
        filled(path)
    with pytest.raises(JournalError, match="choose another run folder"):
        Journal(path, JournalHeader(match="m", game="g", seed=2))
    with pytest.raises(JournalError, match="cannot be opened"):
        Journal(path / "no" / "journal.jsonl", HEADER)


def test_the_clock_of_the_newest_tick_is_kept_beside(path: Path) -> None:
    filled(path)
    with Journal(path, HEADER) as journal:
        journal.mark(2.7, 2.7, 2.7)
    with Journal(path, HEADER) as journal:
        assert journal.standing == standing(2.7)
        journal.append(3.0, [], [], standing(3.0))
        assert journal.standing == standing(3.0), "a mark of before the last record is old"


@pytest.mark.parametrize("damage", [b"", b"{", b"x" * 120])
def test_a_damaged_clock_mark_is_ignored(path: Path, damage: bytes) -> None:
    filled(path)
    path.with_name("journal.jsonl.clock").write_bytes(damage)
    with Journal(path, HEADER) as journal:
        assert journal.standing == standing(2.0)


def settled(journal: Journal) -> bool:
    """Wait until what was begun is written."""
    while not journal.settled():
        time.sleep(0.001)
    return True


@pytest.mark.parametrize("aside", [False, True])
def test_a_full_disk_is_told_and_the_journal_stays_whole(path: Path, aside: bool) -> None:
    filled(path)
    before = path.read_bytes()
    with Journal(path, HEADER, aside=aside) as journal:
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 20, limits[1]))
        try:
            journal.append(9.0, [], [call(4)], standing(9.0))
            for _ in range(3):
                with pytest.raises(JournalError, match="free some space"):
                    settled(journal)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            signal.signal(signal.SIGXFSZ, handler)
        assert aside or path.read_bytes() == before
        with contextlib.suppress(JournalError):  # it may have begun to try again before there was room
            settled(journal)
        assert settled(journal)
    assert [r.n for r in read_journal(path)[1]] == [1, 2, 3, 4]


@pytest.mark.parametrize("tail", [b"{}\n", b"\xff\n", bytes(4096), b"\0\n", b'{"n":4,"time":"late"}\n'])
def test_what_a_power_cut_leaves_behind_the_last_whole_line_is_cut_off(path: Path, tail: bytes) -> None:
    filled(path)
    path.write_bytes(path.read_bytes() + tail)
    assert [record.n for record in read_journal(path)[1]] == [1, 2, 3]
    with Journal(path, HEADER) as journal:
        assert journal.standing == standing(2.0)
        journal.append(9.0, [], [call(4)], standing(9.0))
    damage: list[str] = []
    assert [record.n for record in read_journal(path, damage)[1]] == [1, 2, 3, 4]
    assert damage == []
