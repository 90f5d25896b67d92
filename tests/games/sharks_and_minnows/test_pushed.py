"""A safe minnow that a heavier shark pushes out of the field is not called out, in every engine."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.hal.engine_bench import ENGINE_NAMES
from vrg.bus.messages import Call
from vrg.config.loading import load_match
from vrg.config.rules import rulebook_of
from vrg.coordinator.evidence import Exhibit, read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import Disagreement, judge_again
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.runs.run_folder import RunFolder

MATCH = """\
name = "push"
game = "sharks-and-minnows"
map = "open"
engine = "{engine}"
lasers = false
noise = false

[rules]
x = [-3.0, 3.0]
y = [-5.0, 5.0]
zone_depth = 2.0
passes = 1
pass_limit = 40.0
lineup = "place"
slowest = 1.0
"""
PLAYER = """
[[players]]
name = "{name}"
role = "{role}"
model = "{model}"
strategy = "players.py:{strategy}"
x = {x}
y = {y}
heading = {heading}
"""
PLAYERS = """
from vrg.agents import STILL, Strategy, Twist


class Pusher(Strategy):
    def act(self, view):
        return Twist(0.7 if view.time > 34.0 else 0.0, 0.0)


class Crosses(Strategy):
    def act(self, view):
        return STILL if view.position[1] < -4.0 else Twist(0.7, 0.0)


class Stays(Strategy):
    def act(self, view):
        return STILL
"""


def match_file(folder: Path, engine: str) -> Path:
    players = [
        ("shark", "shark", "ATRV-Jr", "Pusher", 1.5, -4.0, 180.0),
        ("ann", "minnow", "P2AT", "Crosses", -1.5, 4.0, -90.0),
        ("bob", "minnow", "P2AT", "Stays", 1.5, 4.0, -90.0),
    ]
    names = ("name", "role", "model", "strategy", "x", "y", "heading")
    text = MATCH.format(engine=engine) + "".join(
        PLAYER.format(**dict(zip(names, player, strict=True))) for player in players
    )
    (folder / "players.py").write_text(PLAYERS)
    (folder / "match.toml").write_text(text)
    return folder / "match.toml"


def calls_on(name: str, calls: list[Call]) -> list[str]:
    return [call.rule for call in calls if name in call.players]


def blind(exhibit: Exhibit) -> Exhibit:
    """The same evidence without who was pushed."""
    tick = exhibit.tick
    return replace(
        exhibit, tick=type(tick)(tick.after, tick.time, replace(tick.field, pushed=frozenset()), tick.entries)
    )


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_who_is_pushed_out_is_not_called_out(tmp_path: Path, engine: str) -> None:
    setup = load_match(match_file(tmp_path, engine)).at_rate(0.0)
    run = RunFolder(tmp_path)
    run.prepare()
    with open_journal(setup, run) as journal:
        play(setup, journal, limit=60.0)
    _, records = read_journal(run.journal)
    exhibits = list(read_evidence(run.evidence))
    assert min(exhibit.tick.field.poses["ann"].x for exhibit in exhibits if exhibit.tick.field.poses) < -3.0
    calls = [call for record in records for call in record.calls]
    assert calls_on("ann", calls) == ["pass_over"]
    assert "pass_limit" in calls_on("bob", calls), "play went on to its end"
    book = rulebook_of(setup)
    assert judge_again(book, exhibits, records).disagreements == []
    told: list[Disagreement] = list(judge_again(book, [blind(e) for e in exhibits], records).disagreements)
    assert any("ann is out of bounds" in str(disagreement) for disagreement in told)
