"""The stop certificate of run folders: of matches in one process, and of folders in which something is missing."""

import itertools
import json
import math
import shutil
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message, Official, OfficialAction, Poses, at_rest
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Topic
from vrg.commands.runs.stops import rows
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup, write_setup
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.recording import reader
from vrg.recording.recorded import RecordedMatch, read_recorded
from vrg.recording.stops import Incident, IncidentKind, Rest, RobotStop, StopOutcome, Trajectory
from vrg.runs.certificate import Certificate, certificate_of, data_of, summary_line
from vrg.runs.events import Event, EventKind, EventLog
from vrg.runs.result import write_result
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.processes.match import long_match

TICK = 0.02


class Official_(Node):  # noqa: N801 - the message has the name
    """Decides at given match times, and watches the robots at each tick of the world."""

    kind = "official"

    def __init__(self, setup: MatchSetup, plan: Sequence[tuple[float, Topic[Message], Message]]) -> None:
        super().__init__("eve", Mailbox(), TICK)
        self._plan = list(plan)
        self._poses = self.mailbox.subscribe(setup.keys.poses)
        self.seen: list[tuple[float, Poses]] = []

    def tick(self, tick: Tick) -> None:
        self.seen += [(received.stamp, received.body) for received in self._poses.take()]
        while self._plan and tick.time >= self._plan[0][0] - 1e-9:
            _, topic, message = self._plan.pop(0)
            self.mailbox.publish(topic, message)

    def stood(self, name: str, since: float) -> float:
        """The match time of the first tick from which a robot stood for a while."""
        later = [(time, next(b for b in p.bodies if b.name == name)) for time, p in self.seen if time >= since]
        rests = [at_rest(body.twist) for _, body in later]
        return next(time for i, (time, _) in enumerate(later) if all(rests[i : i + 10]))


def decide(action: OfficialAction) -> Official:
    return Official(action=action, by="eve", reason="a test")


Played = tuple[RunFolder, MatchSetup, Official_]


def played(folder: Path, plan: str, *, record: bool = True, until: float = 12.0) -> Played:
    """Play a match in one process to a match time, with what an official does: `halt@3 resume@5 estop@7 ...`."""
    (folder / "match.toml").write_text(long_match("certified"), encoding="utf-8")
    setup = load_match(folder / "match.toml").at_rate(0.0)
    keys = setup.keys
    said = {
        "halt": (keys.official, decide(OfficialAction.HALT)),
        "resume": (keys.official, decide(OfficialAction.RESUME)),
        "estop": (keys.estop, Estop(by="eve", reason="a dog")),
        "release": (keys.estop_release, EstopRelease(by="eve")),
    }
    words = [word.split("@") for word in plan.split()]
    eve = Official_(setup, [(float(at), *said[what]) for what, at in words])  # type: ignore[misc]
    run = RunFolder.create(folder / "runs", setup.name, datetime(2026, 11, 22))
    run.match_file.write_text(setup.text)
    write_setup(setup, run.setup)
    watchers: list[Node] = [eve, *([recorder_node(setup, run)] if record else [])]
    with open_journal(setup, run) as journal:
        play(setup, journal, watchers=watchers, limit=until, resumable=True)
    return run, setup, eve


PLAN = "halt@5.05 resume@7 estop@9.04 release@10 resume@11"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Played:
    return played(tmp_path_factory.mktemp("match"), PLAN, until=13.0)


def test_a_match_in_one_process_is_certified_from_its_journal_and_its_recording(run: Played) -> None:
    folder, setup, eve = run
    certificate = certificate_of(setup, folder)
    halt, estop = certificate.incidents
    assert (halt.kind, halt.time, halt.until) == ("halt", pytest.approx(5.1), pytest.approx(7.0, abs=0.11))
    assert "called by eve (a test)" in halt.what
    assert (estop.kind, estop.time, estop.until) == ("estop", pytest.approx(9.04), pytest.approx(11.0, abs=0.11))
    assert "a dog" in estop.what
    minnows = [stop for stop in certificate.stops if stop.robot != "shark"]
    assert len(minnows) == 6
    for stop in minnows:
        began = certificate.incidents[stop.incident].time
        assert stop.outcome is StopOutcome.STOPPED
        assert began + stop.seconds == pytest.approx(eve.stood(stop.robot, began), abs=1e-6), "to the tick"
        places = [next(b for b in p.bodies if b.name == stop.robot).pose for t, p in eve.seen
                  if began - 1e-6 <= t <= began + stop.seconds + 1e-6]  # fmt: skip
        rolled = sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(places))
        assert stop.distance == pytest.approx(rolled, abs=0.02)
        assert stop.resolution <= 0.1 + TICK + 1e-6
    assert [note.split(",")[0] for note in certificate.notes] == ["There is no events.jsonl"]
    assert summary_line(certificate).startswith("worst stop: ")


def test_the_result_holds_the_certificate(run: Played) -> None:
    folder, setup, _ = run
    result = write_result(setup, folder, None, "interrupted")
    told = json.loads(folder.result.read_text(encoding="utf-8"))["stops"]
    assert told == as_json(result["stops"]) == as_json(data_of(certificate_of(setup, folder)))
    assert [i["kind"] for i in told["incidents"]] == ["halt", "estop"]
    assert told["worst"]["seconds"] == max(r["seconds"] for i in told["incidents"] for r in i["robots"].values())


def vrg(*arguments: str) -> str:
    done = invoke(*arguments)
    assert done.exit_code == 0, done.output
    return done.stdout


def as_json(data: object) -> object:
    return json.loads(json.dumps(data))


def test_the_command_prints_a_table_whose_last_line_names_the_worst(run: Played) -> None:
    folder, setup, _ = run
    said = vrg("run", "stops", str(folder.path))
    assert said.strip().splitlines()[-1] == summary_line(certificate_of(setup, folder))
    assert all(words in said for words in ("called by eve", "a dog", "ann", "bob", "cid"))
    assert json.loads(vrg("run", "stops", str(folder.path), "--json")) == as_json(
        data_of(certificate_of(setup, folder))
    )


def test_a_match_in_which_nothing_happened_has_nothing_to_tell_unless_its_launcher_was_killed(tmp_path: Path) -> None:
    folder, setup, _ = played(tmp_path, "", until=2.0)
    certificate = certificate_of(setup, folder)
    assert (certificate.incidents, certificate.stops, certificate.worst) == ([], [], None)
    assert summary_line(certificate) == ""
    said = vrg("run", "stops", str(folder.path))
    assert "no known HALT, emergency stop, death of a process or lost machine" in said
    EventLog(folder.events).write(Event(what=EventKind.BEGAN, monotonic=0.0, time=0.0))
    certificate = certificate_of(setup, folder)
    [incident] = certificate.incidents
    assert incident.process == "vrg play"
    assert any("did not end by itself" in note for note in certificate.notes)
    assert certificate.resolution < incident.resolution, "how late it was noticed is told by itself"
    assert "vrg play" in summary_line(certificate)


def test_a_stop_that_is_known_roughly_is_told_so() -> None:
    drives = Incident(IncidentKind.DEATH, "the drives died", 5.0, 12.0, process="drives", resolution=5.6)
    stops = [RobotStop(0, "ann", StopOutcome.STOPPED, 5.56, 0.2, 0.6, 5.62)]
    assert summary_line(Certificate([drives], stops, 1.0)).startswith("worst stop: ann 5.56 s (± 5.62 s), 0.20 m after")


def test_a_robot_that_moved_again_is_in_the_table_and_in_the_last_line() -> None:
    estop = Incident(IncidentKind.ESTOP, "emergency stop by eve", 5.0, 12.0)
    stops = [
        RobotStop(0, "ann", StopOutcome.STOPPED, 7.0, 0.1, 0.6, TICK),
        RobotStop(0, "bob", StopOutcome.MOVED_AGAIN, 6.5, 4.6, 0.0, TICK, again=0.4),
    ]
    certificate = Certificate([estop], stops, 1.0)
    assert summary_line(certificate) == "worst stop: bob moved again 0.40 s after the emergency stop: 4.60 m in 6.50 s"
    assert [row[2:5] for row in rows(certificate)] == [
        ("ann", "7.00 ± 0.02", "0.100"),
        ("bob", "moved again after 0.40 (6.50)", "4.600"),
    ]
    assert data_of(certificate)["worst"]["again"] == 0.4


def test_without_a_recording_the_incidents_are_told_and_that_no_stop_is_known(tmp_path: Path) -> None:
    folder, setup, _ = played(tmp_path, "halt@2", record=False, until=3.0)
    certificate = certificate_of(setup, folder)
    assert len(certificate.incidents) == 1
    assert {stop.outcome for stop in certificate.stops} == {StopOutcome.UNKNOWN}
    assert any("--no-record" in note for note in certificate.notes)
    assert summary_line(certificate) == "no stop is known: the robots were not recorded"
    assert "is not known" in vrg("run", "stops", str(folder.path))


def test_a_recording_that_is_torn_is_good_up_to_where_it_is_torn(run: Played, tmp_path: Path) -> None:
    setup, folder = run[1], RunFolder(tmp_path / "torn")
    shutil.copytree(run[0].path, folder.path)
    whole = certificate_of(setup, folder)
    data = folder.recording.read_bytes()
    folder.recording.write_bytes(data[: round(len(data) * 0.6)])
    torn = certificate_of(setup, folder)
    first = [[stop for stop in c.stops if stop.incident == 0] for c in (whole, torn)]
    assert first[0] == first[1]
    assert {stop.outcome for stop in torn.stops if stop.incident == 1} <= {StopOutcome.UNKNOWN, StopOutcome.CUT}
    folder.recording.write_bytes(b"no recording at all, but long enough")
    assert any("cannot be read" in note for note in certificate_of(setup, folder).notes)
    folder.recording.write_bytes(b"")
    assert any("holds no pose" in note for note in certificate_of(setup, folder).notes)


def test_robots_that_were_not_seen_to_stand_are_named_first_and_without_a_journal_no_halt_is_known(
    tmp_path: Path,
) -> None:
    folder, setup, _ = played(tmp_path, "halt@3", until=5.0)
    certificate = certificate_of(setup, folder)
    known = summary_line(certificate)
    cut = RobotStop(0, "ghost", StopOutcome.CUT)
    more = replace(certificate, stops=[*certificate.stops, cut])
    assert summary_line(more) == f"not seen to stand before the recording ended: ghost; {known}"
    folder.journal.unlink()
    certificate = certificate_of(setup, folder)
    assert certificate.incidents == []
    assert any("Without the journal" in note for note in certificate.notes)


def stop_in_a_dead_world(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    measured: Sequence[tuple[float, float, float]],
    *,
    at: float = 2.0,
    back: float | None = None,
) -> tuple[RobotStop, Trajectory]:
    """How ann, a physical robot, stopped when the world died at a match time, and how it was recorded before.

    Args:
        measured: what the launcher heard of ann: (the real time since the last clock, s; how far it had rolled since
            then, m; its speed, m/s).
        at: the match time of the last clock, s. back: that from which the next world goes on, if it is another one.
    """
    run, setup, _ = played(folder, "", until=at + TICK)
    ann = reader.motions_of(read_recorded(run.recordings()))["ann"]
    log = EventLog(run.events)
    log.write(Event(what=EventKind.BEGAN, monotonic=50.0))
    for after, rolled, v in measured:
        y = ann.y[-1] - rolled
        place = {"x": ann.x[-1], "y": y, "v": v}
        log.write(Event(what=EventKind.MEASURED, process="ann", monotonic=100.0 + after, time=at, **place))
    log.write(Event(what=EventKind.DIED, process="world", monotonic=100.4, time=at, clock=100.0, newest={"world": at}))
    log.write(Event(what=EventKind.STEPPED_BACK, process="world", monotonic=102.0, time=at if back is None else back))
    log.write(Event(what=EventKind.ENDED, monotonic=103.0, time=at))
    virtual = certificate_of(setup, run)
    assert [stop.real for stop in virtual.stops] == [False] * 4, "virtual robots stand because the world stands"
    read, since = reader.motions_of, at if back is None else back

    def as_recorded(recorded: RecordedMatch) -> dict[str, Trajectory]:
        """The next world has begun with every robot at rest."""
        motions = read(recorded)
        v = [v if t < since - TICK / 2 else 0.0 for t, v in zip(ann.times, ann.v, strict=True)]
        rests = [rest if rest.end < since else Rest(rest.begin) for rest in ann.rests if rest.begin < since - TICK / 2]
        if not any(rest.end > since for rest in rests):
            rests.append(Rest(since))
        return {**motions, "ann": replace(ann, physical=True, v=v, rests=rests)}

    monkeypatch.setattr(reader, "motions_of", as_recorded)
    return next(stop for stop in certificate_of(setup, run).stops if stop.robot == "ann"), ann


ROLLS = ((0.1, 0.06, 0.6), (0.2, 0.1, 0.4))
STANDS = ((0.3, 0.12, 0.0), (0.4, 0.12, 0.0), (0.5, 0.12, 0.0))


def test_a_physical_robot_rolls_on_in_real_time_while_the_world_is_dead(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop, _ = stop_in_a_dead_world(tmp_path, monkeypatch, (*ROLLS, *STANDS))
    assert (stop.real, stop.outcome) == (True, StopOutcome.STOPPED)
    assert stop.seconds == pytest.approx(0.3)
    assert stop.distance == pytest.approx(0.12, abs=0.02)
    assert stop.resolution == pytest.approx(0.1)
    assert stop.speed == pytest.approx(0.6, abs=0.1), "as it was before, although the next world begins with it at rest"


def rests(*times: float, rolled: float = 0.1) -> tuple[tuple[float, float, float], ...]:
    return tuple((time, rolled, 0.0) for time in times)


@pytest.mark.parametrize(
    ("measured", "at", "found"),
    [
        (rests(0.45, 0.55, 0.66), 2.0, {"outcome": StopOutcome.STOPPED, "seconds": 0.45, "resolution": 0.45}),
        (
            (*ROLLS, (0.25, 0.11, 0.0), (0.28, 0.12, 0.4), (0.32, 0.13, 0.4), *rests(0.6, 0.7, 0.8, rolled=0.2)),
            2.0,
            {"outcome": StopOutcome.STOPPED, "seconds": 0.6},
        ),
        ((*ROLLS, *STANDS[:1]), 2.0, {"outcome": StopOutcome.CUT, "seconds": 0.3}),
        (
            (*ROLLS, *STANDS, (1.0, 0.12, 0.5), (1.1, 0.2, 0.5)),
            2.0,
            {"outcome": StopOutcome.MOVED_AGAIN, "real": True, "again": 1.0, "distance": 0.2},
        ),
        (rests(0.12, rolled=0.0), 0.1, {"outcome": StopOutcome.STOOD, "real": True}),
    ],
    ids=["was heard of late", "has no speed for a moment", "is at rest only once", "rolls on after it stood", "stood"],
)
def test_in_a_dead_world_a_physical_robot(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    measured: Sequence[tuple[float, float, float]],
    at: float,
    found: dict[str, object],
) -> None:
    stop, _ = stop_in_a_dead_world(tmp_path, monkeypatch, measured, at=at)
    for what, value in found.items():
        expected = pytest.approx(value, abs=0.02 if what == "distance" else None) if type(value) is float else value
        assert getattr(stop, what) == expected, what


def test_a_physical_robot_rolls_from_the_instant_from_which_the_next_world_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop, ann = stop_in_a_dead_world(tmp_path, monkeypatch, (*ROLLS, *STANDS), back=1.9)
    before = math.dist(ann.place(1.9), ann.place(2.0))
    assert before > 0.04
    assert stop.seconds == pytest.approx(0.4), "from the place at 1.9 s, so also from the time"
    assert stop.distance == pytest.approx(before + 0.12, abs=0.02)
