"""A match is the same whoever hears what the world publishes: what nobody takes is made when somebody reads it."""

from contextlib import ExitStack
from pathlib import Path

import pytest

import vrg
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.config.setup import MatchSetup
from vrg.hal.sensors import SENSORS
from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.hal.sim.sensors.base import Instant, Mounted
from vrg.hal.sim.sensors.simple import TouchSimulation
from vrg.launch.fork_server import fork_server
from vrg.playing.strategies import Strategies
from vrg.runs.step_log import Missed, StepLog, read_steps
from vrg.testing import matches
from vrg.testing.tiny import TINY

READER = """
import zlib
from vrg.agents import Strategy, Twist
from vrg.hal.sensors import SENSORS

class Reader(Strategy):
    "Turns by the bits of what it reads: now one sensor, now another, and now one of a view that it has kept."

    def __init__(self, name, robot):
        super().__init__(name, robot)
        self._kept = []

    def act(self, view):
        self._kept.append(view)
        count = len(self._kept)
        seen = self._kept[-1 - count % 4] if count > 4 else view
        kinds = sorted(spec.kind for spec in self.robot.sensors)
        sample = seen.readings.latest(SENSORS.get(kinds[count * 5 // 3 % len(kinds)]).message)
        bits = zlib.crc32(repr(sample).encode()) if count % 11 else len(view.readings.samples)
        return Twist(0.2 + bits % 32 / 64, (bits // 32 % 64 - 32) / 32)
"""
"""A strategy in whose motion the last bit of every reading shows."""
RATES = """
[sensors]
ins = {rate = 25.0, drop_out = 0.2}
odometry = {rate = 16.0}
encoders = {rate = 50.0, drop_out = 0.5}
laser = {rate = 12.0, drop_out = 0.3}
sonar = {rate = 7.0}
gps = {rate = 3.0, drop_out = 0.3}
"""
OWN = """
[players.sensors]
laser = {rate = 25.0, beams = 41}
sonar = {rate = 50.0}
"""
"""Another rate of the same kinds for one robot: a reading is then not due at the same tick for all."""


SLOW_AND_CURIOUS = """
import time
from vrg.agents import Strategy, Twist
from vrg.hal.sensors.touch import Touch

class Slow(Strategy):
    count = 0
    def act(self, view):
        self.count += 1
        time.sleep(0.8 if self.count == 20 else 0.0)
        return Twist(0.3, 0.1)

class Curious(Strategy):
    count = 0
    def act(self, view):
        self.count += 1
        if self.count >= 20:
            view.readings.latest(Touch)
        return Twist(0.3, 0.1)
"""
"""One that is late once, and one that looks at another kind of sensor in the same step."""


class Everything(Node):
    """Takes all that the world and the referee publish, tick by tick."""

    kind = "spectator"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("everything", Mailbox(), 0.02)
        keys, subscribe = setup.keys, self.mailbox.subscribe
        topics = [keys.clock, keys.poses, keys.referee_state, keys.robot_state()]
        topics += [keys.sensor(SENSORS.get(kind).message) for kind in SENSORS.names()]
        self.inlets = [subscribe(topic) for topic in topics]
        self.taken: dict[str, int] = {}

    def tick(self, tick: Tick) -> None:
        for received in (received for inlet in self.inlets for received in inlet.take()):
            self.taken[received.key] = self.taken.get(received.key, 0) + 1


def left(setup_text: str, folder: Path, way: str) -> tuple[bytes, bytes, bytes]:
    """What a match has left: journal, evidence, and the digests of what each node has published."""
    folder.mkdir()
    (folder / "reader.py").write_text(READER, encoding="utf-8")
    setup = matches.written(folder, setup_text)
    watcher = Everything(setup)
    with StepLog(folder / "steps.jsonl") as steps, ExitStack() as stack:
        apart = Strategies(stack.enter_context(fork_server()), every=True) if way == "apart" else Strategies()
        _, run = matches.played(
            setup, folder, *([watcher] if way == "watched" else []), steps=steps, strict=way == "strict", apart=apart,
            limit=8.0,
        )  # fmt: skip
    if way == "watched":
        assert min(watcher.taken.values()) >= 5
        assert len(watcher.taken) > 20
    return run.journal.read_bytes(), run.evidence.read_bytes(), (folder / "steps.jsonl").read_bytes()


def test_a_sensor_that_fails_is_no_fault_of_who_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def measure(_: TouchSimulation, mounted: Mounted[TouchSpec], now: Instant) -> Touch:
        if now.tick > 110:
            raise ValueError(f"the bumpers of {mounted.robot} are broken")
        return Touch(pressed=(False,))

    monkeypatch.setattr(TouchSimulation, "measure", measure)
    (tmp_path / "two.py").write_text(SLOW_AND_CURIOUS, encoding="utf-8")
    ann = 'name = "ann"'
    setup = matches.written(tmp_path, TINY.replace(ann, f'{ann}\nstrategy = "two.py:Curious"'))
    with pytest.raises(ValueError, match="the bumpers of shark are broken") as caught:
        matches.played(setup, tmp_path, limit=4.0)
    assert caught.value.__notes__ == ["raised by world world, for player ann, at match time 2.30 s"]


def test_one_that_is_slow_makes_nobody_else_forfeit(tmp_path: Path) -> None:
    (tmp_path / "two.py").write_text(SLOW_AND_CURIOUS, encoding="utf-8")
    ann, bob = ('name = "ann"', 'name = "bob"')
    text = TINY.replace(ann, f'{ann}\nstrategy = "two.py:Slow"').replace(bob, f'{bob}\nstrategy = "two.py:Curious"')
    setup = matches.written(tmp_path, text)
    with StepLog(tmp_path / "steps.jsonl") as steps, fork_server() as server:
        apart = Strategies(server, every=True, deadline=0.5)
        matches.played(setup, tmp_path, steps=steps, apart=apart, limit=4.0)
    late = {line.player for line in read_steps(tmp_path / "steps.jsonl") if isinstance(line, Missed)}
    assert late == {"ann"}


@pytest.mark.parametrize("rates", ["", RATES], ids=["rates of the model", "odd rates"])
def test_a_match_is_the_same_whoever_hears_it(rates: str, tmp_path: Path) -> None:
    rules, players = TINY.replace("lasers = false", f"lasers = true{rates}").split("[[players]]", 1)
    strategy = '[[players]]\nstrategy = "reader.py:Reader"'
    text = f"{rules}{strategy}{players.replace('[[players]]', strategy)}{OWN if rates else ''}"
    quiet, watched, strict, apart = (left(text, tmp_path / way, way) for way in ("quiet", "watched", "strict", "apart"))
    assert quiet == watched
    assert quiet == strict
    assert quiet == apart


def test_a_match_that_a_program_plays_draws_no_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_table(*_: object, **__: object) -> None:
        raise AssertionError("nobody looks at it")

    monkeypatch.setattr("vrg.playing.in_steps.TerminalTable", no_table)
    matches.written(tmp_path, TINY)
    assert vrg.play(tmp_path / "match.toml", record=False, runs=tmp_path).result["ended"] == "game over"
