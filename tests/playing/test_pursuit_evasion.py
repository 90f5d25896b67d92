"""Whole matches of pursuit-evasion in one process: who knows what, how they end, and what a bad radio does."""

import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from vrg.bus.access import hears
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, Stage
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, Topic
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import cases_of, judge_again, refuted
from vrg.games.pursuit_evasion import CROSSING, INTRUDERS, PURSUERS
from vrg.games.pursuit_evasion.proof import prove
from vrg.hal.sensors import SENSORS
from vrg.playing.in_process import Ending
from vrg.runs.run_folder import RunFolder
from vrg.seats.seat import Roster, Seat, SeatKind
from vrg.testing import matches
from vrg.testing.matches import calls_of

TOO_NEAR = 0.35
"""The distance in m to an intruder in play at which a place in a message would tell where it is."""


class Eavesdropper(Node):
    """Hears everything that `pursuer1` may hear, and looks for the places of intruders in it.

    What it may hear is what the key map says that all, or players, hear; of robots its own; and of teams its own.
    """

    kind = "eavesdropper"

    def __init__(self, setup: MatchSetup, *more: Topic[Any]) -> None:
        super().__init__("eavesdropper", Mailbox(), 0.02)
        keys = setup.keys
        self._truth = self.mailbox.subscribe(keys.poses)
        self._state = self.mailbox.subscribe(keys.referee_state)
        self._heard = [self.mailbox.subscribe(topic) for topic in (*audible(keys, "pursuer1", PURSUERS), *more)]
        self.told: list[str] = []
        self.messages: dict[str, int] = {}

    def tick(self, tick: Tick) -> None:
        """Compare every place in every message with where the intruders in play truly are."""
        state, truth = self._state.latest, self._truth.latest
        if state is None or truth is None:
            return
        crossing = {p.name for p in state.body.players if p.state == CROSSING}
        true = {b.name: (b.pose.x, b.pose.y) for b in truth.body.bodies if b.name in crossing}
        for inlet in self._heard:
            for received in inlet.take():
                self.messages[received.key] = self.messages.get(received.key, 0) + 1
                for place in places(msgspec.to_builtins(received.body)):
                    self.told += [
                        f"{tick.time:.2f} s: {received.key} tells {place}, and {name} is at {at}"
                        for name, at in true.items()
                        if math.dist(place, at) < TOO_NEAR
                    ]


def audible(keys: Keys, player: str, team: str) -> Iterator[Any]:
    """The topics that a player may hear."""
    roster, seat = Roster(keys.match, {player: team}), Seat(SeatKind.PLAYER, player)
    for line in Keys.lines():
        for path in hears(seat, line, roster):
            yield Topic(f"{keys.root}/{path}", line.message, line.qos)
    for kind in SENSORS.names():
        yield keys.sensor(SENSORS.get(kind).message, player)


def places(value: Any, name: str = "") -> Iterator[tuple[float, float]]:
    """Every pair of numbers x and y in a message, at any depth, but not what pursuers have seen themselves."""
    if name == "evidence":
        return
    if isinstance(value, dict):
        if isinstance(value.get("x"), float) and isinstance(value.get("y"), float):
            yield value["x"], value["y"]
        for key, inner in value.items():
            yield from places(inner, key)
    elif isinstance(value, list | tuple):
        if len(value) == 2 and all(isinstance(number, float) for number in value):
            yield value[0], value[1]
        for inner in value:
            yield from places(inner, name)


def setup_of(folder: Path, more: str = "", **overrides: Any) -> MatchSetup:
    """The match of the thesis on the planar engine, with more lines at the top of its file."""
    text = match_path("pursuit-evasion-table-4-1").read_text()
    text = text.replace("[rules]", f"{more}\n[rules]")
    return matches.written(folder, text, **{"engine": "planar", **overrides}).at_rate(0)


def played(setup: MatchSetup, folder: Path, *watchers: Node, strict: bool = False) -> tuple[Ending, list[Call]]:
    ending, run = matches.played(setup, folder / "run", *watchers, limit=300.0, strict=strict)
    return ending, calls_of(run)


@pytest.mark.parametrize("engine", ["pybullet", pytest.param("mujoco", marks=pytest.mark.thorough)])
def test_the_match_of_the_thesis_ends_with_every_intruder_accounted_for(tmp_path: Path, engine: str) -> None:
    ending, calls = played(setup_of(tmp_path, engine=engine), tmp_path, strict=True)
    assert ending.state.stage is Stage.GAME_OVER
    assert sum(ending.state.score.values()) == 2
    rules = [call.rule for call in calls]
    assert rules.count("launch") == 2
    assert rules.count("auction") == rules.count("dispatch") == 2
    first = {rule: rules.index(rule) for rule in ("launch", "auction", "dispatch", "capture")}
    assert sorted(first, key=lambda rule: first[rule]) == ["launch", "auction", "dispatch", "capture"]


def test_a_pursuer_that_hears_all_it_may_is_never_told_where_an_intruder_is(tmp_path: Path) -> None:
    setup = setup_of(tmp_path)
    spy, informed = Eavesdropper(setup), Eavesdropper(setup, setup.keys.poses)
    ending, _ = played(setup, tmp_path, spy, informed)
    assert ending.state.stage is Stage.GAME_OVER
    assert spy.told == []
    heard = set(spy.messages)
    root = setup.keys.root
    assert {f"{root}/referee/state", f"{root}/referee/event"} <= heard
    assert f"{root}/robot/pursuer1/sensor/laser/front" in heard
    assert not any("intruder" in key for key in heard), "nothing that it hears is of an intruder"
    assert f"{root}/poses" not in heard
    assert informed.told, "a place that is told would be found"


def test_the_same_seed_gives_the_same_journal_also_with_a_bad_radio(tmp_path: Path) -> None:
    radio = "[radio]\nloss = 0.4\ndelay = 0.1\njitter = 0.2\nrange = 12.0\nbandwidth = 3000"
    journals = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        played(setup_of(tmp_path / name, radio), tmp_path / name)
        journals.append((tmp_path / name / "run" / "journal.jsonl").read_bytes())
    assert journals[0] == journals[1]


@pytest.mark.parametrize(
    "radio",
    [
        "loss = 0.3\ndelay = 0.2",
        *(pytest.param(one, marks=pytest.mark.thorough) for one in ("loss = 1.0", "range = 0.5", "bandwidth = 100")),
    ],
)
def test_a_match_with_a_bad_radio_ends_by_its_rules(tmp_path: Path, radio: str) -> None:
    ending, calls = played(setup_of(tmp_path, f"[radio]\n{radio}"), tmp_path)
    assert ending.state.stage is Stage.GAME_OVER
    assert calls[-1].rule == "game_over"
    assert "time_up" not in [call.rule for call in calls]


def test_what_the_radio_lost_is_counted_for_each_link(tmp_path: Path) -> None:
    setup = setup_of(tmp_path, "[radio]\nloss = 0.5\n[[radio.links]]\nbetween = ['pursuer1', 'pursuer2']\nloss = 1.0")
    played(setup, tmp_path)
    counts = {
        name: msgspec.json.decode((tmp_path / "run" / "logs" / f"{name}.json").read_bytes())["radio"]
        for name in ("pursuer1", "pursuer2", "pursuer3", "intruder1")
    }
    assert counts["intruder1"] == {}, "the other team is not heard"
    assert counts["pursuer1"]["pursuer2"]["arrived"] == counts["pursuer2"]["pursuer1"]["arrived"] == 0
    said = sum(counts["pursuer1"]["pursuer3"][what] for what in ("arrived", "lost"))
    assert 0.3 < counts["pursuer1"]["pursuer3"]["lost"] / said < 0.7


def test_nobody_is_detected_where_nobody_has_a_laser_and_the_game_still_ends(tmp_path: Path) -> None:
    ending, calls = played(setup_of(tmp_path, "lasers = false", seed=2), tmp_path)
    assert ending.state.stage is Stage.GAME_OVER
    rules = [call.rule for call in calls]
    assert "auction" not in rules
    assert ending.state.score[INTRUDERS] + ending.state.score[PURSUERS] == 2
    assert any("fewer than two detections" in call.text for call in calls)


@pytest.mark.thorough
def test_the_harder_match_of_the_examples_ends_by_its_rules(tmp_path: Path) -> None:
    path = Path(__file__).parents[2] / "examples" / "night_watch.toml"
    ending, calls = played(load_match(path).at_rate(0), tmp_path)
    assert ending.state.stage is Stage.GAME_OVER
    assert {"launch", "enter", "auction", "dispatch", "capture"} <= {call.rule for call in calls}
    assert sum(ending.state.score.values()) == 4 or "time_up" in [call.rule for call in calls]


def test_the_model_of_the_radio_is_that_of_the_match_file(tmp_path: Path) -> None:
    assert setup_of(tmp_path).radio.settings.perfect
    setup = setup_of(tmp_path, "[radio]\ndelay = 0.3\n[[radio.links]]\nbetween = ['pursuer1', 'pursuer2']\nloss = 0.9")
    assert not setup.radio.settings.perfect
    assert setup.radio.settings.between("pursuer2", "pursuer1").loss == 0.9
    assert setup.radio.settings.between("pursuer2", "pursuer1").delay == 0.3, "what a link leaves out is as for all"
    assert setup.radio.settings.between("pursuer2", "pursuer3").loss == 0.0


PLAYERS = """
import math
import random
from dataclasses import replace
from vrg.agents.strategy import Action, Strategy
from vrg.bus.messages import Sighting
from vrg.games.pursuit_evasion.intruder import Intruder
from vrg.types import STILL, Twist

class Blind(Strategy):  # tells of eight places by chance at every tick, and looks at nothing
    def act(self, view):
        rng = random.Random(f"{self.name} {view.time:.1f}")
        x0, y0, x1, y1 = view.zone("area").bounds
        places = [(rng.uniform(x0, x1), rng.uniform(y0, y1)) for _ in range(8)]
        return Action(STILL, sightings=[Sighting(x=x, y=y, time=view.time, xx=1, xy=0, yy=1) for x, y in places])

class Stands(Intruder):
    def act(self, view):
        return STILL

class Stops(Intruder):
    def act(self, view):
        return super().act(view) if view.referee.clock % 10.0 < 7.0 else STILL

class Weaves(Intruder):
    def act(self, view):
        return Twist(super().act(view).v, math.cos(view.time))
"""


def with_players(folder: Path) -> str:
    """The name of a file with the players above."""
    (folder / "players.py").write_text(PLAYERS)
    return "players.py"


def test_a_team_that_guesses_detects_nobody(tmp_path: Path) -> None:
    text = match_path("pursuit-evasion").read_text()
    strategy = f'role = "pursuer"\nstrategy = "{with_players(tmp_path)}:Blind"'
    (tmp_path / "match.toml").write_text(text.replace('role = "pursuer"', strategy))
    _, calls = played(load_match(tmp_path / "match.toml", engine="planar", lasers=False).at_rate(0), tmp_path)
    rules = [call.rule for call in calls]
    assert rules.count("launch") == 9
    assert rules.count("false_alarm") == 3
    assert "auction" not in rules


def wild_match(folder: Path, seed: int) -> MatchSetup:
    """A match on random courses, where some intruders do not drive as they should."""
    rng, file = random.Random(seed), with_players(folder)
    lines = [
        f'name = "wild"\ngame = "pursuit-evasion"\nmap = "open"\nengine = "planar"\nseed = {seed}\n[rules]',
        f"area = [[-6, -6], [6, -6], [6, 6], [-6, 6]]\nlaunch_window = 10.0\ntime = {rng.choice((25.0, 60.0))}",
    ]
    for i in range(rng.randint(1, 3)):
        lines.append(f'[[players]]\nname = "p{i}"\nrole = "pursuer"\nx = {3.0 * i - 3.0}\ny = {rng.uniform(-4.0, 4.0)}')
        if rng.random() < 0.2:
            lines.append(f'strategy = "{file}:Blind"')
    for i in range(rng.randint(1, 5)):
        bearing = math.tau * (i + rng.uniform(0.0, 0.7)) / 5
        x, y, heading = 10.0 * math.cos(bearing), 10.0 * math.sin(bearing), bearing + math.pi + rng.uniform(-0.4, 0.4)
        lines.append(f'[[players]]\nname = "i{i}"\nrole = "intruder"\nmodel = "ATRV-Jr"\nx = {x}\ny = {y}')
        lines.append(f"heading = {math.degrees(heading)}")
        if rng.random() < 0.5:
            lines.append(f'strategy = "{file}:{rng.choice(("Stands", "Stops", "Weaves"))}"')
    (folder / "wild.toml").write_text("\n".join(lines))
    return load_match(folder / "wild.toml").at_rate(0)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in (0, *range(2, 12)))])
def test_every_match_ends_with_each_intruder_accounted_for_or_the_time_up(tmp_path: Path, seed: int) -> None:
    setup = wild_match(tmp_path, seed)
    ending, calls = played(setup, tmp_path)
    assert ending.state.stage is Stage.GAME_OVER
    rules = [call.rule for call in calls]
    ends = sum(rules.count(rule) for rule in ("capture", "escape", "off_course", "slow", "collision", "missed"))
    assert ending.failures == ()
    assert ends == sum(player.role == "intruder" for player in setup.players) or "time_up" in rules
    run, book = RunFolder(tmp_path / "run"), rulebook_of(setup)
    exhibits, records = list(read_evidence(run.evidence)), read_journal(run.journal)[1]
    assert judge_again(book, exhibits, records).disagreements == []
    assert refuted(prove, book, cases_of(book, exhibits, records)) == []
