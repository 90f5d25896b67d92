"""The node of a capture system: from its frames to fixes with the match time of the exposure."""

import logging
import math
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pydantic import ValidationError

from tests.localisation.mocap.natnet import Server, Shown
from tests.localisation.mocap.test_tracking import body
from tests.system.harness import wait_until
from tests.tiny import TINY
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock, Fix
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.geometry import compose
from vrg.hal.models import robot_model
from vrg.localisation.mocap import source as module
from vrg.localisation.mocap.frames import Body, Frame
from vrg.localisation.mocap.source import MocapSource
from vrg.localisation.source import SOURCES, SourceContext, read_source
from vrg.types import Pose

KEYS = Keys("m")
TABLE = {
    "source": "mocap",
    "system": "optitrack",
    "host": "10.0.0.5",
    "up": "y",
    "origin": {"x": 2.0, "y": 1.0, "heading": 90.0},
    "bodies": {"bob": {"name": "Robot 2", "x": 0.1, "heading": 180.0}},
    "latency": 0.02,
}
UP = "y"


class FakeStream:
    """Hands over the frames that a test has put into it."""

    def __init__(self, *_: object) -> None:
        self.frames: list[Frame] = []
        self.trouble: str | None = None
        self.running = False

    def start(self) -> None:
        self.running = True

    def close(self) -> None:
        self.running = False

    def take(self) -> list[Frame]:
        found, self.frames = self.frames, []
        return found

    def problem(self) -> str | None:
        return self.trouble


class Bench:
    """The node, and a match clock that began 1000 s after the process' own."""

    def __init__(self, table: dict | None = None, robots: tuple[str, ...] = ("ann", "bob")) -> None:
        kind, settings = read_source(table or TABLE)
        assert kind is MocapSource
        self.mailbox, self.now, self._number = Mailbox(), 1000.0, 0
        context = SourceContext(
            name="hall",
            settings=settings,
            robots=dict.fromkeys(robots, robot_model("P2AT")),
            starts=dict.fromkeys(robots, Pose(0.0, 0.0, 0.0)),
            seed=1,
            base=Path(),
        )
        self.node = MocapSource(context, self.mailbox, KEYS, lambda: self.now)

    @property
    def stream(self) -> FakeStream:
        stream = self.node._stream
        assert isinstance(stream, FakeStream)
        return stream

    def tick(self, seconds: float = 0.02, rate: float = 1.0) -> list[tuple[float, tuple[Fix, ...]]]:
        self.now += seconds
        self._number += 1
        clock = Clock(time=self.now - 1000.0, tick=self._number, epoch=0, rate=rate, estop=False)
        for inlet in self.mailbox.inlets:
            inlet.offer(Received(KEYS.clock.key, clock.time, self._number, clock, "world/w"))
        self.mailbox.handover(clock.time)
        self.node.tick(Tick(clock.time))
        return [(out.message.stamp, out.message.body.fixes) for out in self.mailbox.collect()]

    def shows(self, *bodies: Body, ago: float = 0.01) -> None:
        self.stream.frames.append(Frame(self.now - ago, list(bodies)))


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(module, "Stream", FakeStream)
    made = Bench()
    made.tick(5.0)
    return made


def test_robots_are_located_at_the_time_of_the_exposure(bench: Bench) -> None:
    truth = Pose(3.0, -1.0, 0.5)
    bench.shows(body(Pose(1.0, 0.5, 0.25), UP, "ann"), body(compose(truth, Pose(0.1, 0.0, math.pi)), UP, "Robot 2"))
    ((stamp, (ann, bob)),) = bench.tick()
    assert stamp == pytest.approx(5.0 - 0.01 - 0.02)
    # The system's x is the map's y.
    assert (ann.robot, ann.pose.x, ann.pose.y) == ("ann", pytest.approx(2.0 - 0.5), pytest.approx(1.0 + 1.0))
    assert ann.pose.theta == pytest.approx(0.25 + math.pi / 2)
    assert (bob.robot, bob.pose.x, bob.pose.y) == ("bob", pytest.approx(2.0 + 1.0), pytest.approx(1.0 + 3.0))
    assert bob.pose.theta == pytest.approx(0.5 + math.pi / 2)
    assert (ann.position, ann.heading) == (0.005, pytest.approx(math.radians(0.5)))
    assert bench.tick() == [], "nothing is published twice"
    assert bench.node.counted() == {"frames": 1, "fixes": {"ann": 1, "bob": 1}, "unknown": {}, "ignored": {}}


def test_what_is_no_fix_is_counted_and_warned_of_once(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    still, fallen = body(Pose(0.0, 0.0, 0.0), UP, "ann"), Body("Robot 2", (1.0, 0.1, 2.0), (0.6, 0.8, 0.0, 0.0))
    assert len(bench.tick()) == 0
    for number in range(60):
        tipped = Body(fallen.name, (1.0 + 1e-5 * number, 0.1, 2.0), fallen.rotation)
        bench.shows(still, tipped, body(Pose(0.0, 0.0, 0.0), UP, "chair"))
        assert len(bench.tick()) == (number == 0)
    bench.shows(Body("ann", (math.nan, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), body(Pose(0.0, 0.0, 0.0), UP, ""))
    assert bench.tick() == []
    counted = bench.node.counted()
    assert counted["fixes"] == {"ann": 1}
    assert counted["unknown"] == {"": 1, "chair": 60}
    assert (counted["ignored"]["tipped"], counted["ignored"]["untracked"]) == (60, 1)
    assert counted["ignored"]["repeated"] + counted["ignored"]["frozen"] == 59
    assert [record.getMessage() for record in caplog.records] == [
        "hall: the rigid body Robot 2 of bob is tilted by more than 30 degrees: has the robot tipped over, or is `up` "
        "wrong?",
        "hall: the rigid body chair is seen, which no robot has; robots have Robot 2, ann",
        "hall: the rigid body ann of ann does not change at all: its system has lost it, or hangs",
        "hall: the rigid body without a name is seen, which no robot has; robots have Robot 2, ann",
    ]


def test_frames_that_are_old_or_from_before_the_match_or_of_a_faster_one_give_no_fix(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "Stream", FakeStream)
    bench, robot = Bench(), body(Pose(0.0, 0.0, 0.0), UP, "ann")
    bench.tick(0.2)
    bench.shows(robot, ago=0.5)
    assert bench.tick() == [], "the match had not begun"
    bench.tick(10.0)
    bench.shows(robot, ago=3.0)
    assert bench.tick() == []
    bench.shows(robot)
    assert len(bench.tick()) == 1
    bench.shows(body(Pose(1.0, 0.0, 0.0), UP, "ann"))
    assert bench.tick(rate=0.0) == []
    assert "the match needs `rate = 1`" in caplog.text


def test_a_system_that_shows_nothing_and_comes_back_is_told_once_each(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        for trouble in ("it has shown nothing for 1 s", "it has shown nothing for 2 s", None, None):
            bench.stream.trouble = trouble
            bench.tick()
    told = [record.getMessage() for record in caplog.records]
    assert told == ["hall: it has shown nothing for 1 s", "hall sees again"]


def test_names_that_do_not_fit_together_are_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "Stream", FakeStream)
    bench = Bench(robots=("ann",))
    bench.node.start()
    assert bench.stream.running
    assert "no robot that is located here has the name bob" in caplog.text
    bench.tick(5.0)
    bench.shows(body(Pose(0.0, 0.0, 0.0), UP, "Robot 2"))
    assert bench.tick() == []
    assert bench.node.counted()["unknown"] == {}
    bench.node.stop()
    assert not bench.stream.running
    with pytest.raises(ConfigError, match="expected a rigid body for each robot, got zoe for bob and for zoe"):
        Bench(TABLE | {"bodies": {"bob": {"name": "zoe"}}}, robots=("bob", "zoe"))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"system": "mock"}, "optitrack"),
        ({"host": ""}, "at least 1"),
        ({"up": "x"}, "up"),
        ({"interface": "eth0"}, "Expected 4 octets"),
        ({"system": "vicon", "interface": "10.0.0.2"}, "vicon has no interface"),
        ({"system": "vrpn", "port": 3883}, "vrpn has no port"),
        ({"bodies": {"ann": {"name": "A"}, "bob": {"name": "A"}}}, "got A for ann and for bob"),
        ({"rate": 0.0}, "greater than 0"),
        ({"hots": 1}, "hots"),
    ],
)
def test_wrong_settings_are_refused(wrong: dict, words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        read_source(TABLE | wrong)


def test_the_library_gets_the_settings_that_a_system_has() -> None:
    _, settings = read_source(TABLE | {"port": 1510, "interface": "10.0.0.2"})
    assert settings.options() == {"hostname": "10.0.0.5", "port_command": "1510", "interface_ip": "10.0.0.2"}
    _, settings = read_source({"source": "mocap", "system": "vicon", "host": "10.0.0.5:801"})
    assert settings.options() == {"hostname": "10.0.0.5:801"}


def test_it_is_found_by_its_name() -> None:
    assert SOURCES.get("mocap") is MocapSource
    assert MocapSource.sees_physical


def test_packets_of_an_emulated_server_become_fixes() -> None:
    """All of it, with the process that listens."""
    server = Server(["ann", "chair", "Robot 2"])
    # Half way round about the axis that points up: quaternion x, y, z, w.
    server.shown = {"ann": Shown((1.0, 0.2, -0.5)), "Robot 2": Shown((3.0, 0.2, 1.0), (0.0, 1.0, 0.0, 0.0))}
    bench = Bench(TABLE | {"host": "localhost", "port": server.port, "interface": "127.0.0.1"})
    began = bench.now = time.monotonic()
    bench.node._monotonic = bench.node._stream._monotonic = time.monotonic
    bench.node._offset.heard(100.0, began)
    bench.node.start()
    found: list[tuple[float, tuple[Fix, ...]]] = []

    def enough() -> bool:
        bench.node.tick(Tick(100.0))
        found.extend((out.message.stamp, out.message.body.fixes) for out in bench.mailbox.collect())
        return len(found) >= 5

    try:
        wait_until(enough, "fixes")
    finally:
        bench.node.stop()
        server.close()
    stamps = [stamp for stamp, _ in found]
    assert stamps == sorted(stamps)
    assert 100.0 - 0.02 <= stamps[0] <= 100.0 + time.monotonic() - began
    fixes = {fix.robot: fix for fix in found[-1][1]}
    ann, bob = fixes["ann"], fixes["bob"]
    assert (ann.pose.x, ann.pose.y, ann.pose.theta) == pytest.approx((2.0 - 0.5, 1.0 + 1.0, math.pi / 2), abs=2e-3)
    # Its body is 0.1 m ahead of its centre and looks back, as it stands now: so it looks along the system's x.
    assert (bob.pose.x, bob.pose.y, bob.pose.theta) == pytest.approx((2.0 + 1.0, 1.0 + 2.9, math.pi / 2), abs=2e-3)


def test_without_the_library_it_is_told_what_to_install() -> None:
    code = "import sys; sys.modules['motioncapture'] = None\nfrom vrg.localisation.source import SOURCES\n"
    code += "from vrg.errors import ConfigError\ntry: SOURCES.get('mocap')\nexcept ConfigError as error: print(error)"
    out = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert "expected the package motioncapture" in out.stdout
    assert "pip install -e '.[mocap]'" in out.stdout


def test_a_match_file_with_a_capture_system_is_checked_and_told_where_it_is_wrong(tmp_path: Path) -> None:
    source = '[localisation.hall]\nsource = "mocap"\nsystem = "optitrack"\nhost = "10.0.0.5"\n'
    text = TINY.replace('name = "ann"\n', 'name = "ann"\nlocalisation = "fusion"\n')
    (tmp_path / "tiny.toml").write_text(text.replace("[[players]]", f"{source}\n[[players]]", 1))
    setup = load_match(tmp_path / "tiny.toml")
    assert setup.localisation["hall"]["system"] == "optitrack"
    (tmp_path / "tiny.toml").write_text(text.replace("[[players]]", f'{source}upp = "y"\n[[players]]', 1))
    with pytest.raises(ConfigError, match="unknown field"):
        load_match(tmp_path / "tiny.toml")
