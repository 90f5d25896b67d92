"""A whole match in one process: it ends, it is repeatable, and its players behave."""

import functools
import itertools
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from mcap.reader import make_reader
from msgspec import structs

from tests.hal.engine_bench import ENGINE_NAMES
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Official, OfficialAction, Stage
from vrg.bus.node import Node, Tick
from vrg.bus.stopping import Stop
from vrg.commands import playing
from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import read_journal
from vrg.geometry import outline_distance
from vrg.hal.models import robot_model
from vrg.hal.sensors.camera import Camera
from vrg.hal.sim.map import load_map
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.windows import spectator_node
from vrg.playing import in_steps, match
from vrg.playing.in_process import LINGER, Ending
from vrg.recording.reader import read_tracks
from vrg.regions import Rectangle
from vrg.runs.run_folder import RunFolder
from vrg.testing import matches
from vrg.testing.command_line import invoke
from vrg.testing.matches import calls_of
from vrg.testing.tiny import TINY


class Witness(Node):
    """Watches where everybody is, from the world's own mouth."""

    kind = "witness"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("witness", Mailbox(), 0.1)
        self.poses = self.mailbox.subscribe(setup.keys.poses)
        self.states = self.mailbox.subscribe(setup.keys.referee_state)
        self.field = Rectangle(16.0, -32.0, 26.0, -13.0)
        self.out: list[str] = []
        self.touches: list[tuple[str, str]] = []
        self.inactive_moves: list[str] = []
        self.stood = 0
        self._stood: dict[str, tuple[float, float]] = {}

    def tick(self, tick: Tick) -> None:
        assert self.poses.latest is not None
        bodies = self.poses.latest.body.bodies
        size = (robot_model("P2AT").length, robot_model("P2AT").width)
        self.out += [b.name for b in bodies if not self.field.contains(b.pose.x, b.pose.y)]
        for i, a in enumerate(bodies):
            for b in bodies[:i]:
                near = math.dist((a.pose.x, a.pose.y), (b.pose.x, b.pose.y)) < 0.8
                if near and outline_distance(a.pose, b.pose, size, size) < 0.005 and not self._hunt(a.name, b.name):
                    self.touches.append((a.name, b.name))
        state = self.states.latest
        if state is None or state.body.stage is not Stage.PLAY_ROUND:
            self._stood.clear()
            return
        for body in bodies:
            status = state.body.player(body.name)
            if status is None or status.state != "inactive":
                continue
            here = body.pose.x, body.pose.y
            if body.name in self._stood:
                self.stood += 1
                if math.dist(self._stood[body.name], here) > 0.1:
                    self.inactive_moves.append(body.name)
            elif abs(body.twist.v) < 0.02:
                self._stood[body.name] = here

    def _hunt(self, a: str, b: str) -> bool:
        """Whether one is a shark and the other a minnow: they meet within 0.3 m, and a tag is no time to brake."""
        assert self.states.latest is not None
        return {p.role for p in self.states.latest.body.players if p.name in (a, b)} == {"shark", "minnow"}


def setup_for(engine: str, seed: int) -> MatchSetup:
    return load_match(match_path("sharks-and-minnows-table-4-2"), engine=engine, seed=seed, lasers=False)


Played = tuple[Ending, RunFolder, Witness]
EVERY = ("planar", *(pytest.param(engine, marks=pytest.mark.thorough) for engine in ("pybullet", "mujoco")))


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, int], Played]:
    """Plays the match of the thesis to its end, each once only: how it ended, its run, and what was seen."""

    @functools.cache
    def whole(engine: str, seed: int) -> Played:
        setup = setup_for(engine, seed)
        witness = Witness(setup)
        ending, run = matches.played(setup, tmp_path_factory.mktemp("match"), witness, limit=900.0, strict=True)
        return ending, run, witness

    return whole


@pytest.mark.parametrize(
    ("engine", "seed"),
    [("planar", 2), *(pytest.param(engine, 3, marks=pytest.mark.thorough) for engine in ("pybullet", "mujoco"))],
)
def test_the_match_of_the_thesis_is_played_to_its_end(
    played: Callable[[str, int], Played], engine: str, seed: int
) -> None:
    """With these seeds somebody is tagged for good."""
    ending, _, witness = played(engine, seed)
    state = ending.state
    assert state.stage is Stage.GAME_OVER
    assert state.winner in ("sharks", "minnows")
    inactive_or_shark = sum(p.role == "shark" or p.state == "inactive" for p in state.players)
    assert state.score["sharks"] == inactive_or_shark - 1
    assert witness.out == [], "nobody leaves the field"
    assert witness.inactive_moves == [], "whoever is tagged stands"
    assert witness.stood > 100


SHORT = TINY.replace("passes = 1", "passes = 1\npass_limit = 8.0")
ONE_PASS = {"sharks-and-minnows": "[rules]\npasses = 1"}


@pytest.mark.parametrize(
    ("engine", "game"),
    [
        ("planar", "tiny"),
        *(pytest.param(engine, "sharks-and-minnows", marks=pytest.mark.thorough) for engine in ENGINE_NAMES),
        *(pytest.param("mujoco", game, marks=pytest.mark.thorough) for game in ("roboflag", "pursuit-evasion")),
    ],
)
def test_one_seed_gives_one_journal_byte_for_byte_in_every_process(tmp_path: Path, engine: str, game: str) -> None:
    journals = []
    match = tmp_path / "match.toml"
    text = SHORT if game == "tiny" else match_path(game).read_text()
    match.write_text(text.replace("[rules]", ONE_PASS.get(game, "[rules]")))
    for seed, hashes in ((4, "1"), (4, "2"), (5, "")):
        runs = tmp_path / f"{seed} {hashes}"
        command = ["play", str(match), "--in-process", "--engine", engine, "--seed", str(seed), "--no-record"]
        command += ["--runs", str(runs)]
        if hashes:
            environment = {**os.environ, "PYTHONHASHSEED": hashes}
            subprocess.run(
                [sys.executable, "-m", "vrg", *command], env=environment, check=True, timeout=600, capture_output=True
            )
        else:
            assert invoke(*command).exit_code == 0
        journals.append(next(runs.glob("*/journal.jsonl")).read_bytes())
    assert journals[0] == journals[1]
    assert journals[0] != journals[2], "another seed gives another match"


@pytest.mark.parametrize("engine", EVERY)
def test_a_match_goes_the_same_way_with_cameras_and_without(tmp_path: Path, engine: str) -> None:
    pytest.importorskip("pybullet", reason="it draws the pictures")
    found = []
    for camera in (False, True):
        setup = setup_for(engine, 3)
        small = {"camera": {"columns": 64, "rows": 48}}
        players = [structs.replace(player, camera=camera, sensors=small) for player in setup.players]
        setup, witness = structs.replace(setup, players=players), Witness(setup)
        seen = witness.mailbox.subscribe(setup.keys.sensor(Camera))
        _, run = matches.played(setup, tmp_path / str(camera), witness, pace=lambda time: time < 12.0, strict=True)
        assert len(seen.by_key) == (len(players) if camera else 0)
        poses = witness.poses.latest
        assert poses is not None
        found.append((run.journal.read_bytes(), poses.body))
    assert found[0] == found[1]


@pytest.mark.parametrize("seeds", [1, pytest.param(3, marks=pytest.mark.thorough)])
def test_nobody_runs_into_anybody_but_a_shark_into_its_prey(played: Callable[[str, int], Played], seeds: int) -> None:
    """Two that flee may brush against each other for a moment."""
    touches = [touch for seed in range(seeds) for touch in played("planar", seed)[2].touches]
    assert len(touches) <= 5, "each counts for a tenth of a second"


def test_the_journal_tells_the_whole_story(played: Callable[[str, int], Played]) -> None:
    ending, run, _ = played("planar", 0)
    calls = calls_of(run)
    assert [c.number for c in calls] == list(range(1, len(calls) + 1))
    tags = [c for c in calls if c.rule in ("tag", "out_of_bounds") and c.players[0] != "player1"]
    assert len(tags) == ending.state.score["sharks"]
    assert [c.rule for c in calls if c.rule in ("begin", "pass_over", "game_over")][-1] == "game_over"
    assert read_journal(run.journal)[1][-1].standing.winner == ending.state.winner


class ClockWatch(Node):
    """Remembers the rate that the world tells."""

    kind = "watch"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("rates", Mailbox(), 0.02)
        self._clock = self.mailbox.subscribe(setup.keys.clock)
        self.rates: set[float] = set()

    def tick(self, tick: Tick) -> None:
        self.rates |= {message.body.rate for message in self._clock.take()}


@pytest.mark.parametrize(("paced", "rate"), [(True, 2.5), (False, 0.0)], ids=["paced", "as fast as possible"])
def test_the_clock_tells_how_fast_a_match_is_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, paced: bool, rate: float
) -> None:
    watch: list[ClockWatch] = []

    def watched(setup: MatchSetup, folder: RunFolder) -> ClockWatch:
        watch.append(ClockWatch(setup))
        return watch[0]

    ticks = itertools.count()
    monkeypatch.setattr(in_steps, "_pace", lambda _stop, _rate: lambda _time: next(ticks) < 20)
    monkeypatch.setattr(in_steps, "recorder_node", watched)
    monkeypatch.setattr(match, "plot", lambda *_: None)
    typed = "2.5" if paced else None
    options = playing.PlayOptions(in_process=True, engine="planar", rate=typed, seed=0, headless=True, runs=tmp_path)
    with pytest.raises(typer.Exit):
        playing.play_match("sharks-and-minnows", options, ForkServer())
    assert watch[0].rates == {rate}


def test_a_match_can_be_broken_off(tmp_path: Path) -> None:
    ending, _ = matches.played(setup_for("planar", 0), tmp_path, pace=lambda time: time < 5.0)
    assert ending.time == pytest.approx(5.0, abs=0.05)
    assert ending.state.stage is not Stage.GAME_OVER


class Halting(Node):
    """Halts play after a second of match time."""

    kind = "official"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("eve", Mailbox(), 1.0)
        self._topic = setup.keys.official

    def tick(self, tick: Tick) -> None:
        if tick.time == 1.0:
            self.mailbox.publish(self._topic, Official(action=OfficialAction.HALT, by="eve"))


@pytest.mark.parametrize("resumable", [False, True])
def test_a_halt_that_nobody_can_resume_is_the_end(tmp_path: Path, resumable: bool) -> None:
    setup = setup_for("planar", 0)
    ending, _ = matches.played(setup, tmp_path, Halting(setup), limit=4.0, resumable=resumable)
    assert ending.state.halted == "called by eve"
    assert ending.time == pytest.approx(4.0 if resumable else 1.1 + LINGER, abs=0.05)


def test_where_nobody_can_resume_a_halt_no_command_is_advised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(in_steps, "recorder_node", lambda setup, _: Halting(setup))
    options = playing.PlayOptions(in_process=True, engine="planar", seed=0, headless=True, runs=tmp_path)
    with pytest.raises(typer.Exit) as end:
        playing.play_match("sharks-and-minnows", options, ForkServer())
    said = capsys.readouterr().out
    assert end.value.exit_code == 1
    assert "HALT: called by eve" in said
    assert "Broken off: play stood still, and here nobody can resume it: called by eve" in said
    assert "vrg official" not in said


CIRCLER = """
from vrg.agents import Strategy, Twist

class Circler(Strategy):
    def act(self, view):
        return Twist(v=0.5, w=1.0)
"""


@pytest.mark.thorough
def test_a_player_that_never_lines_up_does_not_keep_the_others_from_playing(tmp_path: Path) -> None:
    (tmp_path / "circler.py").write_text(CIRCLER)
    text = match_path("sharks-and-minnows").read_text()
    minnow = 'name = "player7"\nrole = "minnow"'
    assert minnow in text
    text = text.replace(minnow, minnow + '\nstrategy = "circler.py:Circler"').replace("[rules]", "[rules]\npasses = 2")
    # With this seed it does not happen to circle over its mark in the second pass.
    setup = matches.written(tmp_path, text, engine="planar", lasers=False, seed=0)
    ending, run = matches.played(setup, tmp_path, limit=900.0)
    assert ending.state.stage is Stage.GAME_OVER
    placed = calls_of(run, "placed")
    assert 1 <= len(placed) <= 3
    assert "player7" in placed[0].text


def test_a_recording_and_a_window_show_the_walls_of_the_map(tmp_path: Path) -> None:
    setup = setup_for("planar", 0)
    _, run = matches.played(setup, tmp_path, recorded=True, pace=lambda time: time < 1.0)
    with run.recording.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert "/view/map" in {channel.topic for channel in summary.channels.values()}
    window = spectator_node(setup, "window", tmp_path)
    assert window._builder.build(True).obstacles == load_map("courtyard").obstacles


def test_players_may_have_names_in_their_own_language(tmp_path: Path) -> None:
    text = TINY.replace('"ann"', '"Ольга"').replace('"bob"', '"José"')
    ending, run = matches.played(matches.written(tmp_path, text), tmp_path, recorded=True, strict=True)
    assert ending.state.stage is Stage.GAME_OVER
    assert {"Ольга", "José"} < set(read_tracks(run.recording))


def test_a_match_at_the_rate_of_a_clock_does_not_hurry_after_a_stall() -> None:
    now = 0.0
    pauses: list[float] = []

    class Waits(Stop):
        def wait(self, timeout: float | None = None) -> bool:
            nonlocal now
            pauses.append(timeout or 0.0)
            now += pauses[-1]
            return False

    pace = in_steps._pace(Waits(), 2.0, lambda: now)
    now = 9.0  # a long start
    assert all(pace(0.1 * tick) for tick in range(5))
    assert pauses == pytest.approx([0.05] * 4)
    now += 9.0  # a stall
    assert all(pace(0.1 * tick) for tick in range(5, 20))
    assert pauses[-10:] == pytest.approx([0.05] * 10)
