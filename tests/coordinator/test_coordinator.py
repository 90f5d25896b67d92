"""The coordinator among its messages: halts, limits, resuming, and a journal that is always ahead of the calls."""

import errno
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.games.sharks_and_minnows.test_rules import SETTINGS, contestants
from vrg.bus import messages as m
from vrg.bus.codec import Received, decode, encode
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, Topic
from vrg.coordinator.attendance import ABSENCE_TIMEOUT
from vrg.coordinator.coordinator import STALL_TICKS, Coordinator
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import Journal, JournalHeader, read_journal
from vrg.coordinator.judging import judge_again
from vrg.coordinator.rulebook import Contestant
from vrg.games.sharks_and_minnows import MINNOW, SHARK
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.games.sharks_and_minnows.settings import Settings
from vrg.types import STILL, Pose

KEYS = Keys("m")
HEADER = JournalHeader(match="m", game="sharks-and-minnows", seed=3)


class Table:
    """A coordinator with the world and the players played by the test."""

    def __init__(
        self,
        folder: Path,
        players: Sequence[Contestant] | None = None,
        *,
        disqualify: bool = True,
        rate: float = 1.0,
        settings: Settings = SETTINGS,
        aside: bool = False,
    ) -> None:
        self.rate = rate
        self.journal = Journal(folder / "journal.jsonl", HEADER, aside=aside)
        self.mailbox = Mailbox()
        self.book = SharksAndMinnows(settings, players or contestants())
        self.node = Coordinator(self.mailbox, KEYS, self.book, self.journal, disqualify=disqualify)
        self.places = {c.name: c.start for c in self.book.contestants.values()}
        self.silent: set[str] = set()
        self.blind = False
        self.stopped: set[str] = set()
        self.faults: dict[str, str] = {}
        self.ages: dict[str, float] = {}
        self.recovers: list[tuple[str, str]] = []
        self.time = 0.0
        self.world_tick = 0
        self.calls: list[m.Call] = []
        self.requests: list[m.WorldRequest] = []
        self.limits: dict[str, float] = {}
        self.state: m.RefereeState | None = None

    def hear(self, topic: Topic[m.Message], body: m.Message, sequence: int = 0) -> None:
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is type(body):
                inlet.offer(Received(topic.key, self.time, sequence, body))

    def tick(self, *, live: bool = True, estop: bool = False, frozen: float = 0.0) -> m.RefereeState:
        if live:
            self.time = round(self.time + 0.1, 6)
            bodies = [
                m.Body(name=n, pose=p, twist=STILL, physical=n in self.ages, age=self.ages.get(n, 0.0))
                for n, p in self.places.items()
            ]
            if not self.blind:
                self.hear(KEYS.poses, m.Poses(bodies=bodies))
            self.world_tick += 5
            self.hear(KEYS.clock, m.Clock(time=self.time, tick=self.world_tick, epoch=0, rate=self.rate, estop=estop))
            for name in self.places:
                if name not in self.silent:
                    report = m.Report(mode="-", armed=True, estop=name in self.stopped, fault=self.faults.get(name))
                    self.hear(KEYS.report(name), report)
        self.mailbox.handover(self.time)
        self.node.tick(Tick(self.time, live, frozen))
        for out in self.mailbox.collect():
            body = out.message.body
            arrives = decode(encode(out.message), out.topic.type, out.message.key)
            assert arrives.body == body, "nothing in it can be changed"
            if isinstance(body, m.Call):
                self.calls.append(body)
            elif isinstance(body, m.WorldRequest):
                self.requests.append(body)
            elif isinstance(body, m.Recover):
                self.recovers.append((out.message.key, body.by))
            elif isinstance(body, m.SpeedLimit):
                self.limits[out.message.key] = body.v_max
            elif isinstance(body, m.RefereeState):
                self.state = body
        assert self.state is not None
        return self.state

    def ticks(self, number: int) -> m.RefereeState:
        for _ in range(number):
            state = self.tick()
        return state

    def decide(self, action: m.OfficialAction, subject: str | None = None) -> m.RefereeState:
        """An official decides; the call that answers is the last one."""
        self.hear(KEYS.official, m.Official(action=action, by="ann", subject=subject, id="7"))
        state = self.tick()
        assert self.calls[-1].answers == "7"
        return state

    def tag(self) -> None:
        """Put shark s0 beside minnow m0 in the open."""
        self.places["s0"] = Pose(1.0, 5.0, 0.0)
        self.places["m0"] = Pose(1.0, 5.7, 0.0)

    def standing(self, name: str) -> tuple[str, bool]:
        """The state of a player, and whether it may move."""
        (found,) = [player for player in self.state.players if player.name == name]  # type: ignore[union-attr]
        return found.state, found.may_move

    def rules(self) -> list[str]:
        return [c.rule for c in self.calls]

    def disqualified(self) -> list[str]:
        return [c.text for c in self.calls if c.rule == "disqualified"]


@pytest.fixture
def early(tmp_path: Path) -> Table:
    """One whose round has not begun."""
    return Table(tmp_path)


@pytest.fixture
def table(early: Table) -> Table:
    """One in play."""
    early.ticks(2)
    return early


def test_the_round_begins_when_all_report_and_stand_still(early: Table) -> None:
    early.silent = {"m1"}
    assert early.ticks(3).waiting == ("starting: m1 (4 of 5 players are ready)",)
    early.silent = set()
    assert early.tick().stage is m.Stage.PLAY_ROUND


def test_who_has_reported_and_falls_silent_before_the_round_is_waited_for(early: Table) -> None:
    early.places["m1"] = Pose(5.0, 10.0, 0.0)
    early.ticks(3)
    early.silent = {"m1"}
    assert "m1 does not report" in early.ticks(15).waiting


def test_each_robot_gets_its_own_limit_for_the_time_of_play(early: Table) -> None:
    def limits() -> dict[str, float]:
        return {k.split("/")[3]: v for k, v in early.limits.items()}

    early.silent = {"m1"}
    early.ticks(3)
    own = {name: contestant.v_max for name, contestant in early.book.contestants.items()}
    assert limits() == own, "before the round everybody may drive to its mark as fast as its robot can"
    early.silent = set()
    assert early.tick().stage is m.Stage.PLAY_ROUND
    assert limits() == early.book.speed_limits() != own
    early.node.match.end("sharks")
    early.tick()
    assert limits() == own


def test_a_tag_is_called_journalled_and_published(table: Table) -> None:
    table.tag()
    assert table.tick().score == {"sharks": 1, "minnows": 0}
    assert table.rules() == ["begin", "tag"]
    assert table.standing("m0")[0] == "inactive"
    _, records = read_journal(table.journal.path)
    assert records[-1].calls == [table.calls[-1]]
    assert records[-1].standing.game["states"]["m0"] == "inactive"


def test_a_clock_that_stops_halts_a_match_of_virtual_robots_and_one_that_stalls_does_not(table: Table) -> None:
    before = table.tick()
    for _ in range(2):
        for _ in range(STALL_TICKS):
            assert table.tick(live=False).halted is None
        after = table.tick()
    assert after.halted is None
    assert after.clock == pytest.approx(before.clock + 0.2)
    for _ in range(STALL_TICKS + 1):
        state = table.tick(live=False)
    assert state.halted == "the world's clock has stopped"
    assert table.tick().halted, "and only an official ends it"


def test_a_stopped_clock_halts_physical_robots_at_once(early: Table) -> None:
    early.ages["m1"] = 0.0
    early.ticks(2)
    assert early.tick(live=False).halted == "the world's clock has stopped"


def test_a_referee_that_did_not_run_halts_physical_robots_and_names_itself(early: Table) -> None:
    early.ages["m1"] = 0.0
    early.ticks(2)
    assert early.tick(live=False, frozen=1.23).halted == "the referee did not run for 1.2 s"
    assert early.tick().halted == "the referee did not run for 1.2 s", "and only an official ends it"


def test_an_emergency_stop_halts_and_holds_until_released_and_resumed(table: Table) -> None:
    table.hear(KEYS.estop, m.Estop(by="ann", reason="smoke"))
    table.faults = dict.fromkeys(table.places, "its wheels are held by the emergency stop")
    state = table.tick()
    assert (state.estop, state.halted) == (True, "emergency stop by ann: smoke")
    assert state.way_out == (
        "An official continues play as soon as this is solved: the emergency stop is engaged: an official releases it"
    ), "and not what follows from it for each robot"
    assert table.decide(m.OfficialAction.RESUME).halted
    assert "an official releases it" in table.calls[-1].text
    table.hear(KEYS.estop_release, m.EstopRelease(by="ann"), 1)
    table.faults = {}
    state = table.tick(estop=True)  # the world has not heard it yet
    assert (state.estop, state.halted is None) == (False, False)
    assert table.decide(m.OfficialAction.RESUME).halted is None


def test_a_player_that_is_gone_for_long_halts_the_match_if_it_is_to(tmp_path: Path) -> None:
    table = Table(tmp_path, disqualify=False)
    table.ticks(2)
    table.silent = {"m1"}
    assert table.ticks(int(ABSENCE_TIMEOUT / 0.1) - 2).halted is None
    assert table.ticks(5).halted == "m1 has not reported for 5 s"


def test_a_player_that_floods_the_bus_is_out_at_once_and_named_and_no_other_where_nobody_reports(table: Table) -> None:
    said = ["m1 is disqualified: it floods the bus with more than 2000 messages a second"]
    table.mailbox.flooded = frozenset({KEYS.bid("m1").key, KEYS.poses.key})
    table.ticks(2)
    assert table.disqualified() == said
    table.silent = set(table.places)
    assert table.ticks(int(ABSENCE_TIMEOUT / 0.1) + 3).halted == "no player reports"
    assert table.disqualified() == said


def test_a_player_that_is_gone_for_long_is_out_until_the_next_round_in_which_it_reports(table: Table) -> None:
    table.silent = {"m1"}
    state = table.ticks(int(ABSENCE_TIMEOUT / 0.1) + 3)
    assert state.halted is None
    assert table.calls[-1].text == "m1 is disqualified: it has not reported for 5 s"
    assert table.standing("m1") == (m.DISQUALIFIED, False)
    table.silent = set()
    table.ticks(10)
    assert table.calls[-1].text == "m1 plays again from the next pass"
    assert table.rules().count("reinstated") == 1


def test_nobody_is_out_after_a_stall_of_the_bus_nor_where_nobody_reports(table: Table) -> None:
    """The clock has gone on meanwhile, and every report is old: that is nobody's silence."""
    table.time += 20.0
    table.silent = set(table.places)
    table.ticks(3)
    table.silent = set()
    assert table.ticks(5).stage is m.Stage.PLAY_ROUND
    assert table.disqualified() == []
    table.silent = set(table.places)
    assert table.ticks(80).halted == "no player reports"
    assert table.disqualified() == []


def test_at_a_higher_rate_a_player_has_as_much_real_time(tmp_path: Path) -> None:
    table = Table(tmp_path, rate=4.0)
    table.ticks(2)
    table.silent = {"m1"}
    table.ticks(int(4 * ABSENCE_TIMEOUT / 0.1) - 5)
    assert "disqualified" not in table.rules()
    table.ticks(10)
    assert table.rules()[-1] == "disqualified"


def test_a_robot_whose_player_is_out_but_runs_is_still_watched(early: Table) -> None:
    early.ages = {"m1": 0.0}
    early.ticks(2)
    early.decide(m.OfficialAction.DISQUALIFY, "m1")
    early.silent = {"m1"}
    early.hear(KEYS.report("m1"), m.Report(mode="-", armed=False, fault="node 1: it is on", latched=True))
    assert early.tick().halted == "m1: node 1: it is on"
    early.decide(m.OfficialAction.RESUME)
    assert early.calls[-1].rule == "refused"


def test_whoever_is_reinstated_before_a_round_plays_in_it(tmp_path: Path) -> None:
    table = Table(tmp_path, contestants(sharks=1, minnows=6))
    table.ticks(2)
    table.decide(m.OfficialAction.DISQUALIFY, "m1")
    for name in table.places:
        if name.startswith("m") and name != "m1":
            table.places[name] = Pose(table.places[name].x, 2.0, 0.0)
    table.ticks(40)
    assert table.tick().stage is m.Stage.INITIALIZE
    table.decide(m.OfficialAction.REINSTATE, "m1")
    assert table.calls[-1].text == "m1 plays again"
    table.places = {p.name: p.mark for p in table.tick().players if p.mark is not None}
    assert table.ticks(3).stage is m.Stage.PLAY_ROUND
    assert table.standing("m1") == ("active", True)


def test_whom_a_person_has_disqualified_does_not_come_back_by_reporting(table: Table) -> None:
    said = []
    for action in (m.OfficialAction.DISQUALIFY, m.OfficialAction.REINSTATE):
        for _ in range(2):
            table.decide(action, "m1")
            said.append(table.calls[-1].text if table.calls[-1].rule != "refused" else "")
            table.ticks(30)
    assert said == ["m1 is disqualified: by ann", "", "m1 plays again from the next pass", ""]


@pytest.mark.parametrize("halted", [True, False])
@pytest.mark.parametrize("over", [True, False])
def test_a_match_in_which_everybody_is_disqualified_ends_unless_one_returns_at_once(
    table: Table, over: bool, halted: bool
) -> None:
    if halted:
        table.silent = set(table.places)
        assert table.ticks(int(ABSENCE_TIMEOUT / 0.1) + 3).halted == "no player reports"
    for name in table.places:
        table.hear(KEYS.official, m.Official(action=m.OfficialAction.DISQUALIFY, by="ann", subject=name))
    if not over:
        table.hear(KEYS.official, m.Official(action=m.OfficialAction.REINSTATE, by="ann", subject="m1"))
    assert (table.ticks(2).stage is m.Stage.GAME_OVER) is over
    assert (table.calls[-1].text == "game over: everybody is disqualified") is over


def test_a_player_with_a_fault_that_is_not_latched_halts_nobody_but_keeps_a_halt_from_ending(table: Table) -> None:
    table.silent = {"m1"}
    report = m.Report(mode="-", armed=False, fault="battery empty")
    table.hear(KEYS.report("m1"), report)
    assert table.tick().halted is None
    table.decide(m.OfficialAction.HALT)
    table.hear(KEYS.report("m1"), report)
    table.decide(m.OfficialAction.RESUME)
    assert "m1: battery empty" in table.calls[-1].text


def test_stragglers_are_put_on_their_marks_and_one_near_its_own_exactly_there(early: Table) -> None:
    """It may stand on another's mark, which would then never be free."""
    marks = {name: c.start for name, c in early.book.contestants.items()}
    early.places["m0"] = Pose(5.0, 10.0, 0.0)
    early.places["m1"] = Pose(marks["m1"].x - 0.35, marks["m1"].y, 0.0)
    early.ticks(605)
    assert [r.places for r in early.requests] == [marks]
    assert early.calls[-1].text == "put on their marks after 60 s: m0"


def test_in_a_match_that_wants_it_so_all_are_put_on_their_marks_at_once(tmp_path: Path) -> None:
    table = Table(tmp_path, settings=SETTINGS.model_copy(update={"lineup": "place"}))
    table.places["m0"] = Pose(5.0, 10.0, 0.0)
    table.ticks(2)
    assert len(table.requests) == 1


def test_nobody_asks_the_world_to_carry_a_physical_robot(early: Table) -> None:
    early.ages = {"m1": 0.0}
    early.places["m0"] = early.places["m1"] = Pose(5.0, 10.0, 0.0)
    early.ticks(605)
    assert [sorted(r.places) for r in early.requests] == [["m0", "m2", "m3", "s0"]]
    assert early.calls[-1].rule == "placed"
    assert "on their marks after 60 s: m0; " in early.calls[-1].text
    assert (
        "drive them there by hand, or carry each there, and let an official confirm its place" in early.calls[-1].text
    )
    early.places["m0"] = early.book.contestants["m0"].start
    early.ticks(100)
    assert len(early.requests) == 1
    assert early.calls[-1].text.startswith("not on their marks after 70 s: m1; drive them there")


def test_a_physical_robot_whose_pose_is_too_old_halts_the_match_and_is_waited_for(early: Table) -> None:
    early.ages = {"m1": 0.6}
    said = "m1: it has not been located for 0.5 s"
    assert early.ticks(3).waiting == (said,)
    early.ages = {"m1": 0.5}
    assert early.ticks(3).stage is m.Stage.PLAY_ROUND
    for age in (0.52, 0.62, 0.72):
        early.ages = {"m1": age}
        assert early.tick().halted == said
    assert early.rules() == ["begin", "halt"], "it is told once"
    assert early.decide(m.OfficialAction.RESUME).halted
    assert said in early.calls[-1].text
    early.ages = {"m1": 0.1}
    assert early.tick().halted == said, "an official ends it"
    assert early.decide(m.OfficialAction.RESUME).halted is None


def test_a_physical_robot_that_starts_is_not_yet_missed(early: Table) -> None:
    early.silent, early.ages = {"m1"}, {"m1": 0.6}
    assert early.ticks(3).waiting == ("starting: m1 (4 of 5 players are ready)",)
    early.silent = set()
    assert early.ticks(3).waiting == ("m1: it has not been located for 0.5 s",)


@pytest.mark.parametrize(("physical", "longest"), [(False, 2.0), (True, 0.5)])
def test_a_match_without_new_poses_is_halted_and_not_resumed(early: Table, physical: bool, longest: float) -> None:
    if physical:
        early.ages = {"m1": 0.0}
    assert early.ticks(3).stage is m.Stage.PLAY_ROUND
    early.blind = True
    assert early.ticks(round(longest / 0.1)).halted is None
    said = f"no poses arrive: the newest are older than {longest:g} s"
    assert early.tick().halted == said
    assert early.decide(m.OfficialAction.RESUME).halted == said
    early.blind = False
    assert early.tick().halted == said, "an official ends it"
    assert early.decide(m.OfficialAction.RESUME).halted is None


def test_a_round_does_not_begin_by_old_poses(early: Table) -> None:
    early.silent = {"m1"}
    early.ticks(3)
    early.blind = True
    early.ticks(25)
    early.silent = set()
    state = early.ticks(3)
    assert state.stage is m.Stage.INITIALIZE
    assert state.waiting == ("no poses arrive: the newest are older than 2 s",)


def full(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the disk be full until `monkeypatch.undo()`."""

    def refuse(_file: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)


def test_a_disk_that_stalls_holds_nobody_up_and_nothing_is_announced_before_it_is_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = Table(tmp_path, aside=True)
    wait_until(lambda: table.tick().stage is m.Stage.PLAY_ROUND)
    works, stalls, goes_on = os.fsync, threading.Event(), threading.Event()

    def stall(file: int) -> None:
        stalls.set()
        assert goes_on.wait(60.0)
        works(file)

    monkeypatch.setattr(os, "fsync", stall)
    table.tag()
    table.tick()
    assert stalls.wait(60.0)
    table.places["m2"] = Pose(-1.0, 5.0, 0.0)
    for _ in range(8):
        state = table.tick()
        assert (state.halted, state.score["sharks"]) == (None, 0)
        assert any(player.may_move for player in state.players), "play goes on"
    state = table.ticks(5)
    assert state.halted == "the journal waits for the disk"
    assert not any(player.may_move for player in state.players)
    table.hear(KEYS.estop, m.Estop(by="bob"))
    assert "bob" in (table.tick().halted or ""), "a halt holds everybody at once"
    assert table.rules() == ["begin"]
    goes_on.set()
    wait_until(lambda: table.tick() and len(table.rules()) == 4)
    assert table.rules() == ["begin", "tag", "out_of_bounds", "halt"]
    assert [call.number for call in table.calls] == [1, 2, 3, 4]
    table.journal.close()
    _, records = read_journal(table.journal.path)
    judgement = judge_again(table.book, read_evidence(tmp_path / "evidence.bin"), records)
    assert (judgement.disagreements, judgement.calls) == ([], 4)


def wait_until(condition: Callable[[], object]) -> None:
    """Wait for a thread that writes, which takes real time."""
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


class TestLatchedFaults:
    FAULT = "axis 2: overvoltage"

    def report(self, table: Table, fault: str | None = FAULT, *, pressed: bool = False) -> None:
        table.silent = {"m1"}  # but for this
        report = m.Report(mode="-", armed=False, fault=fault, latched=True, pressed=pressed)
        table.hear(KEYS.report("m1"), report)

    def test_one_halts_play_and_keeps_it_halted_until_it_is_cleared(self, table: Table) -> None:
        for _ in range(3):
            self.report(table)
            assert table.tick().halted == f"m1: {self.FAULT}"
        assert table.rules() == ["begin", "halt"]
        self.report(table)
        table.decide(m.OfficialAction.RESUME)
        assert f"m1: {self.FAULT}" in table.calls[-1].text
        self.report(table)
        assert table.decide(m.OfficialAction.RECOVER, "m1").halted, "it does not end the halt"
        assert table.recovers == [(KEYS.recover("m1").key, "ann")]
        table.silent = set()
        table.tick()
        assert table.decide(m.OfficialAction.RESUME).halted is None

    @pytest.mark.parametrize(
        ("fault", "pressed", "said"),
        [
            (None, False, "m1: its robot has latched a fault (an official recovers the robot)"),
            ("somebody has pressed it", True, "m1: somebody has pressed it"),
            ("m12 amperes are too much", True, "m1: m12 amperes are too much"),
        ],
        ids=["without words", "a button is released and not recovered", "words like a name"],
    )
    def test_one_keeps_a_round_from_beginning(self, early: Table, fault: str | None, pressed: bool, said: str) -> None:
        for _ in range(3):
            self.report(early, fault, pressed=pressed)
            state = early.tick()
        assert (state.waiting, state.halted) == ((said,), None)

    def test_the_longest_fault_still_fits_into_a_call(self, table: Table) -> None:
        self.report(table, "x" * 2000)
        table.tick()
        assert len(table.calls[-1].text) <= 2000

    def test_all_robots_may_be_asked_to_recover_and_it_is_journalled_first(self, table: Table) -> None:
        table.decide(m.OfficialAction.RECOVER)
        assert [key for key, _ in table.recovers] == [KEYS.recover(name).key for name in table.places]
        assert (table.calls[-1].rule, table.calls[-1].text) == ("recover", "recover all robots: asked by ann")
        _, records = read_journal(table.journal.path)
        assert records[-1].calls == [table.calls[-1]]

    @pytest.mark.parametrize(
        ("action", "rule"), [(m.OfficialAction.RECOVER, "recover"), (m.OfficialAction.END, "ended")]
    )
    def test_nothing_is_done_or_announced_before_it_is_journalled(
        self, table: Table, monkeypatch: pytest.MonkeyPatch, action: m.OfficialAction, rule: str
    ) -> None:
        full(monkeypatch)
        table.hear(KEYS.official, m.Official(action=action, by="ann"))
        assert table.ticks(3).stage is m.Stage.PLAY_ROUND
        assert (table.recovers, table.rules()) == ([], ["begin"])
        monkeypatch.undo()
        assert (table.ticks(2).stage is m.Stage.GAME_OVER) is (rule == "ended")
        assert table.rules()[1] == rule
        assert len(table.recovers) == (0 if rule == "ended" else len(table.places))

    def test_neither_who_is_no_player_nor_anybody_after_the_end_can_recover(self, table: Table) -> None:
        table.decide(m.OfficialAction.RECOVER, "sue")
        assert table.calls[-1].rule == "refused"
        assert "expected a player of this match (" in table.calls[-1].text
        assert "got 'sue'" in table.calls[-1].text
        table.decide(m.OfficialAction.END)
        table.decide(m.OfficialAction.RECOVER)
        assert table.calls[-1].rule == "refused"
        assert table.recovers == []


def test_what_cannot_be_journalled_halts_unannounced_and_is_kept(table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    full(monkeypatch)
    table.tag()
    state = table.ticks(5)
    assert "No space left on device" in (state.halted or "")
    assert state.score == {"sharks": 0, "minnows": 0}, "nobody is told what is not on disk"
    assert not any(p.may_move for p in state.players)
    assert table.rules() == ["begin"]
    monkeypatch.undo()
    table.ticks(2)
    assert table.rules() == ["begin", "tag", "halt"]
    assert [c.number for c in table.calls] == [1, 2, 3]
    assert table.decide(m.OfficialAction.RESUME).halted is None


def test_an_emergency_stop_and_a_resume_in_one_tick_leave_play_halted(table: Table) -> None:
    table.decide(m.OfficialAction.HALT)
    table.hear(KEYS.estop, m.Estop(by="bob"))
    state = table.decide(m.OfficialAction.RESUME)
    assert state.estop
    assert state.halted
    assert table.rules()[-1] == "refused"


@pytest.mark.parametrize("way", [1, -1], ids=["engaged first", "released first"])
def test_of_two_estops_in_one_tick_the_engaging_one_wins(table: Table, way: int) -> None:
    for sequence, (topic, body) in enumerate(
        [(KEYS.estop, m.Estop(by="x")), (KEYS.estop_release, m.EstopRelease(by="x"))][::way]
    ):
        table.hear(topic, body, sequence)
    assert table.tick().estop


def test_a_halt_and_a_resume_in_one_tick_leave_play_halted(table: Table) -> None:
    table.hear(KEYS.official, m.Official(action=m.OfficialAction.RESUME, by="ann"), 0)
    table.hear(KEYS.official, m.Official(action=m.OfficialAction.HALT, by="bob"), 1)
    assert table.tick().halted


def test_a_world_that_steps_back_in_time_halts(table: Table) -> None:
    table.ticks(20)
    table.world_tick = 3
    assert table.tick().halted == "the world was restarted and continues from its snapshot"


def test_a_coordinator_that_is_there_before_the_world_does_not_halt(early: Table) -> None:
    assert early.tick(live=False).halted is None
    assert early.ticks(2).stage is m.Stage.PLAY_ROUND


def test_reports_of_a_time_to_come_count_as_silence(table: Table) -> None:
    """They are of before the world stepped back."""
    table.silent = {"m1"}
    table.time += 20.0
    table.hear(KEYS.report("m1"), m.Report(mode="-", armed=True))
    table.time -= 20.0
    table.decide(m.OfficialAction.HALT)
    table.decide(m.OfficialAction.RESUME)
    assert "m1 does not report" in table.calls[-1].text


def test_a_restarted_coordinator_goes_on_with_the_same_score_stage_and_clock(tmp_path: Path) -> None:
    table = Table(tmp_path)
    table.ticks(2)
    table.tag()
    before = table.ticks(27)
    table.journal.close()
    again = Table(tmp_path)
    again.time = table.time
    again.places = table.places
    after = again.tick()
    assert after.halted == "the coordinator was restarted"
    assert (after.score, after.stage, after.clock) == (before.score, before.stage, pytest.approx(before.clock))
    assert again.decide(m.OfficialAction.RESUME).halted is None
    assert again.calls[-1].number == len(table.calls) + 1, "calls go on counting"
    again.places["m1"] = Pose(1.0, 5.7, 0.0)
    assert again.tick().score == {"sharks": 2, "minnows": 0}, "and so does the score"


class TestStopsThatWereMissed:
    """The coordinator takes over an emergency stop that others have latched and that it has not heard."""

    @pytest.mark.parametrize(
        ("ticks", "latched"),
        [(0, "the world"), (3, "the world"), (3, "m1")],
        ids=["the world before the round", "the world", "a player"],
    )
    def test_one_that_the_world_or_a_player_has_latched(self, early: Table, ticks: int, latched: str) -> None:
        for _ in range(ticks):
            early.tick()
        early.stopped = {latched}
        state = early.tick(estop=latched == "the world")
        assert (state.estop, state.halted) == (True, f"emergency stop, latched in {latched}")
        assert next(call.cause for call in early.calls if call.rule == "halt") == m.EMERGENCY_STOP

    def test_one_that_players_have_latched_where_no_clock_tells_how_old_their_word_is(self, early: Table) -> None:
        """The world and the referee have both died, and the referee is back first."""
        early.stopped = {"m1"}
        early.time = 60.0
        report = m.Report(mode="-", armed=False, estop=True)
        early.hear(KEYS.report("m1"), report)
        early.time = 0.0
        assert early.tick(live=False).estop

    def test_also_a_second_one_after_a_first_was_heard_and_released(self, table: Table) -> None:
        table.hear(KEYS.estop, m.Estop(by="ann"))
        assert table.tick(estop=True).estop
        table.hear(KEYS.estop_release, m.EstopRelease(by="ann"))
        assert not table.tick(estop=True).estop, "the world hears of the release a moment later"
        assert not table.ticks(20).estop
        assert table.tick(estop=True).estop

    @pytest.mark.parametrize("hears", [True, False])
    def test_a_robot_may_take_a_moment_to_hear_of_a_release_and_no_longer(self, table: Table, hears: bool) -> None:
        table.hear(KEYS.estop, m.Estop(by="ann"))
        table.stopped = {"m1"}
        table.tick(estop=True)
        table.hear(KEYS.estop_release, m.EstopRelease(by="ann"))
        assert not table.ticks(5).estop
        table.stopped = set() if hears else {"m1"}
        state = table.ticks(20)
        assert state.estop is not hears
        assert ("m1" in (state.halted or "")) is not hears


def test_what_forty_faulty_players_say_can_be_read_again_after_a_restart(tmp_path: Path) -> None:
    crowd = [
        Contestant(name=f"m{i}", role=MINNOW, start=Pose(1.0 + 0.2 * i, 18.0, 0.0), size=(0.1, 0.1), v_max=0.7)
        for i in range(40)
    ]
    crowd.append(Contestant(name="s0", role=SHARK, start=Pose(5.0, 1.0, 0.0), size=(0.1, 0.1), v_max=0.7))
    table = Table(tmp_path, crowd)
    table.ticks(3)
    assert table.decide(m.OfficialAction.HALT).halted
    table.faults = {f"m{i}": f"its strategy fails: {'x' * 300}" for i in range(40)}
    table.decide(m.OfficialAction.RESUME)
    refused = table.calls[-1]
    assert refused.rule == "refused"
    assert len(refused.text) == 2000
    table.journal.close()
    again = Journal(tmp_path / "journal.jsonl", HEADER)
    assert again.standing is not None
    assert again.last is not None
    assert again.last.calls[-1].rule == "refused"
    again.close()


class TestPlacing:
    """What the world has done is announced when it has done it, and what it refuses is never announced as done."""

    def ask(self, table: Table, number: str | None = "7") -> str:
        table.calls.clear()
        place = m.Official(action=m.OfficialAction.PLACE, by="ann", subject="m0", value="2 3 0", id=number)
        table.hear(KEYS.official, place)
        table.tick()
        assert table.calls == []
        (request,) = table.requests
        assert request.places == {"m0": Pose(2.0, 3.0, 0.0)}
        assert request.id is not None
        return request.id

    @pytest.mark.parametrize("number", ["7", None])
    def test_what_is_granted_is_called_and_journalled(self, table: Table, number: str | None) -> None:
        table.hear(KEYS.world_answer, m.WorldAnswer(id=self.ask(table, number), refused=None))
        table.tick()
        (call,) = table.calls
        assert (call.rule, call.answers) == ("place", number)
        assert call.text == "m0 is put at (2.00, 3.00), 0 degrees: by ann"
        _, records = read_journal(table.journal.path)
        assert records[-1].calls == [call]

    def test_what_is_refused_is_said_with_the_reason(self, table: Table) -> None:
        table.hear(KEYS.world_answer, m.WorldAnswer(id=self.ask(table), refused="a wall is there"))
        table.tick()
        assert [(c.rule, c.text, c.answers) for c in table.calls] == [
            ("refused", "the world refuses: a wall is there", "7")
        ]

    def test_who_asks_for_nothing_hears_of_refusals_only(self, table: Table) -> None:
        table.calls.clear()
        table.hear(KEYS.world_answer, m.WorldAnswer(id=None, refused="robots on marks would overlap"))
        table.hear(KEYS.world_answer, m.WorldAnswer(id="9", refused=None), sequence=1)
        table.tick()
        assert [(c.rule, c.answers) for c in table.calls] == [("refused", None)]
