"""A match is judged again from its evidence: an honest journal agrees, and whatever was altered is found."""

import errno
import os
import tracemalloc
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from tests.coordinator.test_coordinator import KEYS, Table, wait_until
from vrg.bus import messages as m
from vrg.coordinator.coordinator import STALL_TICKS
from vrg.coordinator.evidence import Began, EvidenceFile, Exhibit, Looked, TickEvidence, read_evidence
from vrg.coordinator.journal import Record, read_journal
from vrg.coordinator.judging import Judgement, judge_again
from vrg.coordinator.match import Checkpoint
from vrg.coordinator.rulebook import Observation
from vrg.errors import JournalError
from vrg.types import Pose

Played = tuple[list[Exhibit], list[Record]]


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return Table(tmp_path)


@pytest.fixture
def played(table: Table) -> Played:
    """A round with a tag, a halt, a player that falls silent, and an official who overrules."""
    table.ticks(12)
    table.tag()
    table.ticks(5)
    table.decide(m.OfficialAction.HALT)
    table.ticks(3)
    table.decide(m.OfficialAction.RESUME)
    table.silent.add("m1")
    table.ticks(80)
    table.hear(KEYS.estop, m.Estop(by="ann"))
    table.ticks(3)
    assert {"begin", "tag", "halt", "resume", "disqualified"} <= set(table.rules())
    return told(table)


def told(table: Table) -> Played:
    table.journal.close()
    folder = table.journal.path.parent
    return list(read_evidence(folder / "evidence.bin")), read_journal(table.journal.path)[1]


def judged(table: Table, exhibits: Iterable[Exhibit], records: Sequence[Record]) -> Judgement:
    return judge_again(table.book, exhibits, records)


def test_an_honest_journal_agrees_with_the_rule_book(table: Table, played: Played) -> None:
    exhibits, records = played
    judgement = judged(table, exhibits, records)
    assert judgement.disagreements == []
    assert judgement.calls == len(table.calls) > 5
    assert judgement.unjudged == 0
    assert all(record.evidence for record in records)


def test_a_match_that_another_coordinator_went_on_with_is_judged_to_its_end(tmp_path: Path) -> None:
    first = Table(tmp_path)
    first.ticks(12)
    first.journal.close()
    second = Table(tmp_path)
    second.time = first.time
    second.ticks(3)
    second.decide(m.OfficialAction.RESUME)
    second.tag()
    second.ticks(5)
    exhibits, records = told(second)
    judgement = judged(second, exhibits, records)
    assert judgement.disagreements == []
    assert judgement.calls == len(first.calls) + len(second.calls)


def another_rule(tag: m.Call) -> list[m.Call]:
    return [structs.replace(tag, rule="out_of_bounds")]


def another_player(tag: m.Call) -> list[m.Call]:
    return [structs.replace(tag, players=("s0", "m1"))]


def one_more(tag: m.Call) -> list[m.Call]:
    return [tag, structs.replace(tag, number=tag.number + 1)]


@pytest.mark.parametrize(
    ("alter", "number", "words"),
    [
        (another_rule, 1, "by the rules it is tag: "),
        (another_player, 1, "its players are"),
        (lambda _: [], None, "a call that was not made: tag"),
        (one_more, None, "there is no such call"),
    ],
    ids=["rule", "players", "left out", "invented"],
)
def test_a_call_that_was_altered_left_out_or_invented_is_found(
    table: Table, played: Played, alter: Callable[[m.Call], list[m.Call]], number: int | None, words: str
) -> None:
    exhibits, records = played
    at = next(i for i, record in enumerate(records) if any(call.rule == "tag" for call in record.calls))
    records[at] = structs.replace(records[at], calls=alter(*records[at].calls))
    found = judged(table, exhibits, records).disagreements
    assert words in found[0].what
    assert number is None or (len(found), found[0].time) == (number, records[at].time)


def test_a_run_whose_calls_an_earlier_release_told_in_other_words_agrees(table: Table, played: Played) -> None:
    exhibits, records = played
    for at, record in enumerate(records):
        calls = [
            structs.replace(call, text=f"then: {call.text}", why="then" if call.why else "") for call in record.calls
        ]
        why = None if record.standing.halted is None else "then"
        records[at] = structs.replace(record, calls=calls, standing=structs.replace(record.standing, halted=why))
    judgement = judged(table, exhibits, records)
    assert judgement.disagreements == []
    assert judgement.reworded == judgement.calls == len(table.calls)


def test_a_clock_that_was_altered_is_found(table: Table, played: Played) -> None:
    exhibits, records = played
    last = records[-1]
    records[-1] = structs.replace(last, standing=structs.replace(last.standing, total=last.standing.total + 1.0))
    (found,) = judged(table, exhibits, records).disagreements
    assert "total is" in found.what


def test_each_pose_that_was_altered_in_the_file_is_found(table: Table, played: Played, tmp_path: Path) -> None:
    exhibits, records = played
    path = tmp_path / "evidence.bin"
    content = path.read_bytes()
    at, length = 0, 0
    for exhibit in exhibits:
        length = int.from_bytes(content[at : at + 4], "little")
        place = content.find(b"\xcb", at + 12, at + 12 + length)  # the first number with a point: the time, or a pose
        changed = bytearray(content)
        changed[place + 5] ^= 0x10
        path.write_bytes(bytes(changed))
        found = judged(table, read_evidence(path), records).disagreements
        assert any("was changed" in one.what for one in found)
        at += 12 + length
        assert exhibit.genuine


def test_evidence_that_was_written_anew_as_a_whole_is_not_that_of_the_journal(table: Table, played: Played) -> None:
    exhibits, records = played
    other = [Exhibit(exhibit.tick, digest=f"{number:016x}", genuine=True) for number, exhibit in enumerate(exhibits)]
    (found,) = judged(table, other, records).disagreements
    assert "not belong to this journal" in found.what


def test_poses_that_would_have_been_a_tag_are_told_as_the_call_that_is_missing(table: Table) -> None:
    table.ticks(15)
    exhibits, records = told(table)
    last = exhibits[-1].tick
    close = {**last.field.poses, "s0": Pose(1.0, 5.0, 0.0), "m0": Pose(1.0, 5.7, 0.0)}
    field = type(last.field)(close, frozenset(), frozenset(), last.field.time + 0.1)
    tick = TickEvidence(after=records[-1].n, time=last.time + 0.1, field=field, entries=[Looked(0.1, [])])
    (found,) = judged(table, [*exhibits, Exhibit(tick, "", genuine=True)], records).disagreements
    assert "the journal lacks" in found.what


def test_a_torn_tick_is_left_out_and_what_it_tells_is_unjudged(table: Table, played: Played, tmp_path: Path) -> None:
    exhibits, records = played
    path = tmp_path / "evidence.bin"
    path.write_bytes(path.read_bytes()[:-7])
    again = list(read_evidence(path))
    assert len(again) == len(exhibits) - 1
    early = [exhibit for exhibit in exhibits if exhibit.tick.after < 2]
    judgement = judged(table, early, records)
    assert judgement.disagreements == []
    assert judgement.unjudged == sum(len(record.calls) for record in records[2:])


@pytest.mark.parametrize("tail", [bytes(4096), bytes([7]) * 4096, b"\xff" * 3000, b"\x05\0\0\0" + b"x" * 13])
def test_what_a_power_cut_leaves_behind_the_last_tick_is_named_and_a_coordinator_goes_on_before_it(
    tmp_path: Path, tail: bytes
) -> None:
    first = Table(tmp_path)
    first.ticks(12)
    first.journal.close()
    path = tmp_path / "evidence.bin"
    ticks = list(read_evidence(path))
    path.write_bytes(path.read_bytes() + tail)
    damage: list[str] = []
    assert list(read_evidence(path, damage)) == ticks
    assert damage == [f"{path}: its last {len(tail)} bytes are torn or damaged, and were left out"]
    second = Table(tmp_path)
    second.time = first.time
    second.ticks(3)
    exhibits, records = told(second)
    assert len(exhibits) > len(ticks)
    judgement = judged(second, exhibits, records)
    assert (judgement.disagreements, judgement.unjudged) == ([], 0)


def fill(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Let files of these names have no space left until `monkeypatch.undo()`."""
    write = os.pwrite

    def refuse(file: int, data: bytes, at: int) -> int:
        if os.readlink(f"/proc/self/fd/{file}").endswith(names):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data, at)

    monkeypatch.setattr(os, "pwrite", refuse)


@pytest.mark.parametrize("aside", [False, True])
def test_after_a_disk_was_full_the_evidence_goes_on_and_the_gap_is_no_fault_of_the_referee(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, aside: bool
) -> None:
    table, halt = Table(tmp_path, aside=aside), m.Official(action=m.OfficialAction.HALT, by="ann", id="7")
    wait_until(lambda: table.tick().stage is m.Stage.PLAY_ROUND)
    fill(monkeypatch, "evidence.bin")
    began = table.time
    wait_until(lambda: table.tick().unproved)
    table.tag()
    assert all(table.tick().unproved for _ in range(10)), "everybody sees it, all the time"
    table.hear(KEYS.official, halt)
    table.hear(KEYS.estop, m.Estop(by="ann"))
    wait_until(lambda: table.tick() and table.rules().count("halt") == 2)
    monkeypatch.undo()
    ended = table.time
    wait_until(lambda: not table.tick().unproved)
    table.hear(KEYS.official, halt)
    wait_until(lambda: table.tick() and table.rules().count("halt") == 3)
    exhibits, records = told(table)
    judgement = judged(table, exhibits, records)
    assert judgement.disagreements == []
    assert judgement.unjudged >= 3, "what was called meanwhile"
    assert judgement.unjudged + judgement.calls == len(table.calls)
    ((since, until),) = judgement.gaps
    assert since <= began + 1.0
    assert until >= ended - 0.2


def test_what_a_full_disk_keeps_out_of_the_journal_too_is_unjudged_and_no_fault_of_the_referee(
    table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    table.ticks(5)
    fill(monkeypatch, "evidence.bin", "journal.jsonl")
    table.tag()
    table.ticks(3)
    table.hear(KEYS.official, m.Official(action=m.OfficialAction.RESUME, by="ann", id="7"))
    table.ticks(3)
    assert table.rules() == ["begin"], "nothing is announced that is not in the journal"
    monkeypatch.undo()
    table.ticks(4)
    assert table.rules() == ["begin", "tag", "halt", "resume", "halt"]
    table.decide(m.OfficialAction.RESUME)
    table.ticks(3)
    table.decide(m.OfficialAction.HALT)
    judgement = judged(table, *told(table))
    assert (judgement.disagreements, judgement.unjudged, judgement.calls) == ([], 4, 3)
    assert len(judgement.gaps) == 1


def test_a_halt_that_a_full_disk_keeps_out_while_match_time_stands_is_unjudged(
    table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    table.ticks(5)
    fill(monkeypatch, "evidence.bin")
    for _ in range(STALL_TICKS + 1):
        table.tick(live=False)
    monkeypatch.undo()
    table.ticks(3)
    assert table.rules() == ["begin", "halt"]
    judgement = judged(table, *told(table))
    assert (judgement.disagreements, judgement.unjudged, judgement.calls) == ([], 1, 1)


@pytest.mark.parametrize(
    ("full", "next_full", "unjudged"),
    [("evidence.bin", None, 1), ("evidence.bin", "evidence.bin", 1), ("journal.jsonl", "evidence.bin", 0)],
    ids=["first alone", "both", "journal, then evidence"],
)
def test_a_coordinator_that_ends_while_the_disk_is_full_leaves_a_gap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, full: str, next_full: str | None, unjudged: int
) -> None:
    first = Table(tmp_path)
    first.ticks(5)
    fill(monkeypatch, full)
    first.tag()
    first.ticks(3)
    first.journal.close()
    monkeypatch.undo()
    second = Table(tmp_path)
    second.time = first.time
    if next_full is not None:
        fill(monkeypatch, next_full)
    second.ticks(3)
    monkeypatch.undo()
    second.ticks(3)
    second.decide(m.OfficialAction.RESUME)
    judgement = judged(second, *told(second))
    assert judgement.disagreements == []
    assert (judgement.unjudged, len(judgement.gaps)) == (unjudged, 1)
    assert judgement.calls == len(first.calls) + len(second.calls) - unjudged


def test_what_a_coordinator_could_not_write_is_not_missed_in_the_next_record_if_that_has_no_evidence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Table(tmp_path)
    first.ticks(12)
    fill(monkeypatch, "journal.jsonl")
    first.tag()
    first.ticks(3)
    first.journal.close()
    monkeypatch.undo()
    second = Table(tmp_path)
    second.time = first.time
    fill(monkeypatch, "evidence.bin")
    second.ticks(3)
    second.decide(m.OfficialAction.HALT)
    judgement = judged(second, *told(second))
    assert judgement.disagreements == []
    assert judgement.unjudged == len(second.calls) > 0


def test_ticks_side_by_side_that_were_edited_are_found_and_all_others_are_judged(
    table: Table, played: Played, tmp_path: Path
) -> None:
    exhibits, records = played
    path = tmp_path / "evidence.bin"
    content, at = bytearray(path.read_bytes()), 0
    for number in range(len(exhibits)):
        length = int.from_bytes(content[at : at + 4], "little")
        if number in (5, 6):
            content[content.find(b"\xcb", at + 12, at + 12 + length) + 5] ^= 0x10
        at += 12 + length
    path.write_bytes(content)
    found = judged(table, read_evidence(path), records)
    assert [("was changed" in one.what) for one in found.disagreements].count(True) == 2
    assert found.ticks == len(exhibits)


def test_a_standing_that_somebody_has_edited_is_a_finding(table: Table, played: Played) -> None:
    exhibits, records = played
    at = next(i for i, record in enumerate(records) if any(call.rule == "tag" for call in record.calls))
    standing = records[at].standing
    game = {**standing.game, "points": {"sharx": 1, "minnows": 0}}
    records[at] = structs.replace(records[at], standing=structs.replace(standing, game=game))
    found = judged(table, exhibits, records)
    assert found.disagreements
    assert found.calls + found.unjudged == sum(len(record.calls) for record in records)


def edited(record: Record, **changes: Any) -> Record:
    """The record with another standing, by the names of its fields or of those of the game."""
    own = {name: value for name, value in changes.items() if name in Checkpoint.__struct_fields__}
    game = {**record.standing.game, **{name: value for name, value in changes.items() if name not in own}}
    return structs.replace(record, standing=structs.replace(record.standing, game=game, **own))


@pytest.mark.parametrize(("digest", "later"), [("", 0.0), ("", 0.1), ("0123456789abcdef", 0.1)])
@pytest.mark.parametrize(
    ("alter", "words"),
    [
        (lambda record: edited(record, winner="sharks"), "winner is 'sharks'"),
        (lambda record: edited(record, points={"sharks": 9, "minnows": 0}), "points is"),
        (lambda record: structs.replace(record, calls=another_rule(*record.calls)), "by the rules it is tag: "),
        (lambda record: structs.replace(record, calls=[]), "a call that was not made: tag"),
    ],
    ids=["winner", "points", "rule", "call"],
)
def test_a_last_record_that_was_altered_is_found_without_its_digest_too(
    table: Table, digest: str, later: float, alter: Callable[[Record], Record], words: str
) -> None:
    table.ticks(12)
    table.tag()
    table.ticks(3)
    exhibits, records = told(table)
    at = next(i for i, record in enumerate(records) if any(call.rule == "tag" for call in record.calls))
    until = [exhibit for exhibit in exhibits if exhibit.tick.after <= at]
    last = structs.replace(records[at], evidence=digest, time=records[at].time + later)
    honest = judged(table, until, [*records[:at], last])
    assert honest.disagreements == [], "a torn end has this look, too"
    found = judged(table, until, [*records[:at], alter(last)]).disagreements
    assert any(words in one.what for one in found)


@pytest.mark.parametrize("ends", [False, True], ids=["resumed", "began"])
@pytest.mark.parametrize("changes", [{"points": {"sharks": 9, "minnows": 0}}, {"winner": "sharks"}], ids=str)
def test_an_altered_standing_of_the_last_record_in_a_gap_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ends: bool, changes: dict[str, Any]
) -> None:
    table = Table(tmp_path)
    table.ticks(12)
    fill(monkeypatch, "evidence.bin")
    table.tag()
    table.ticks(3)
    monkeypatch.undo()
    if ends:
        table.journal.close()
        time, table = table.time, Table(tmp_path)
        table.time = time
    table.ticks(3)
    exhibits, records = told(table)
    assert judged(table, exhibits, records).disagreements == []
    at = next(exhibit.tick.after for exhibit in reversed(exhibits) if exhibit.tick.anew) - 1
    assert any(call.rule == "tag" for record in records[: at + 1] for call in record.calls)
    records[at] = edited(records[at], **changes)
    found = judged(table, exhibits, records).disagreements
    assert [one.time for one in found] == [records[at].time]


def test_a_record_that_the_journal_lacks_is_named_and_the_others_are_judged(table: Table, played: Played) -> None:
    exhibits, records = played
    at = next(i for i, record in enumerate(records) if any(call.rule == "tag" for call in record.calls))
    found = judged(table, exhibits, [*records[:at], *records[at + 1 :]])
    assert any("the journal lacks: " in one.what for one in found.disagreements)
    assert found.calls == sum(len(record.calls) for record in records) - len(records[at].calls)


@pytest.mark.parametrize("by", [-0.3, 0.3])
def test_a_record_whose_time_was_altered_is_found(table: Table, played: Played, by: float) -> None:
    exhibits, records = played
    at = next(i for i, record in enumerate(records) if any(call.rule == "tag" for call in record.calls))
    records[at] = structs.replace(records[at], time=records[at].time + by)
    (found,) = judged(table, exhibits, records).disagreements
    assert f"record {records[at].n} of the journal has the time {records[at].time:.1f} s" in found.what


def test_evidence_with_a_hole_is_told(table: Table, played: Played) -> None:
    exhibits, records = played
    left = [exhibit for exhibit in exhibits if exhibit.tick.after != 1]
    found = judged(table, left, records).disagreements
    assert any("is missing" in one.what for one in found)


def test_what_a_coordinator_decided_and_could_not_write_before_it_crashed_has_not_happened(tmp_path: Path) -> None:
    first = Table(tmp_path)
    first.ticks(12)
    first.tag()
    first.ticks(5)
    first.journal.close()
    lines = first.journal.path.read_bytes().splitlines(keepends=True)
    first.journal.path.write_bytes(b"".join(lines[:-1]))
    lost = len(read_journal(first.journal.path)[1]) + 1
    assert [e.tick.after for e in read_evidence(tmp_path / "evidence.bin")][-1] == lost
    second = Table(tmp_path)
    second.time = first.time
    second.ticks(3)
    exhibits, records = told(second)
    assert max(exhibit.tick.after for exhibit in exhibits) < lost
    judgement = judged(second, exhibits, records)
    assert judgement.disagreements == []
    assert judgement.calls == sum(len(record.calls) for record in records)


def test_the_memory_to_judge_a_match_does_not_grow_with_its_length(table: Table, tmp_path: Path) -> None:
    peaks = []
    for ticks in (60, 600):
        table.ticks(ticks)
        _, records = read_journal(table.journal.path)
        tracemalloc.start()
        assert judged(table, read_evidence(tmp_path / "evidence.bin"), records).ticks >= ticks
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0]


def test_evidence_that_is_missing_has_no_ticks(tmp_path: Path) -> None:
    assert list(read_evidence(tmp_path / "evidence.bin")) == []


def test_evidence_of_the_version_whose_undone_ticks_each_reader_left_out_is_refused(tmp_path: Path) -> None:
    began = TickEvidence(after=0, time=0.0, field=Observation({}), entries=[Began(format=2)])
    path = tmp_path / "evidence.bin"
    file = EvidenceFile(path, os.pwrite)
    file.open(0)
    file.piece(began)()
    file.close()
    with pytest.raises(JournalError, match="expected evidence of version 3, got 2: use the VRG that recorded it"):
        list(read_evidence(path))
