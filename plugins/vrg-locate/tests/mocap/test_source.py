"""The node of a capture system: from its frames to fixes with the match time of the exposure."""

import math
import time

import pytest
from pydantic import ValidationError
from real_box import BOX

from mocap.natnet import Server, Shown
from mocap.test_tracking import body
from vrg.bus.messages import Fix
from vrg.bus.node import Tick
from vrg.errors import ConfigError
from vrg.geometry import compose
from vrg.hal.sim.config import BodySetup
from vrg.localisation.source import read_source
from vrg.testing.sources import HERE, FakeFeed, SourceBench
from vrg.testing.waiting import wait_until
from vrg.types import Pose
from vrg_locate.mocap import source as module
from vrg_locate.mocap.frames import MeasuredBody, MocapFrame
from vrg_locate.mocap.source import MocapSource

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


class Bench(SourceBench):
    """The node, and what its system shows."""

    def __init__(
        self, table: dict = TABLE, robots: tuple[str, ...] = ("ann", "bob"), things: tuple[BodySetup, ...] = ()
    ) -> None:
        super().__init__(MocapSource, table, "hall", *robots, things=things)
        self.stream = self.node._stream

    def shows(self, *bodies: MeasuredBody, ago: float = 0.01) -> None:
        self.stream.shown.append(MocapFrame(self.now - ago, list(bodies)))


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(module, "FrameStream", FakeFeed)
    made = Bench()
    made.tick(5.0)
    return made


def test_a_box_is_the_rigid_body_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FrameStream", FakeFeed)
    bench = Bench(things=(BOX,))
    bench.tick(5.0)
    bench.shows(body(Pose(1.0, 0.5, 0.25), UP, "box"))
    ((_, (fix,)),) = bench.tick()
    assert (fix.robot, fix.pose.x, fix.pose.y) == ("box", pytest.approx(2.0 - 0.5), pytest.approx(1.0 + 1.0))


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
    still, fallen = body(HERE, UP, "ann"), MeasuredBody("Robot 2", (1.0, 0.1, 2.0), (0.6, 0.8, 0.0, 0.0))
    assert len(bench.tick()) == 0
    for number in range(60):
        tipped = MeasuredBody(fallen.name, (1.0 + 1e-5 * number, 0.1, 2.0), fallen.rotation)
        bench.shows(still, tipped, body(HERE, UP, "chair"))
        assert len(bench.tick()) == (number == 0)
    bench.shows(MeasuredBody("ann", (math.nan, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), body(HERE, UP, ""))
    assert bench.tick() == []
    counted = bench.node.counted()
    assert counted["fixes"] == {"ann": 1}
    assert counted["unknown"] == {"": 1, "chair": 60}
    assert (counted["ignored"]["tipped"], counted["ignored"]["untracked"]) == (60, 1)
    assert counted["ignored"]["repeated"] + counted["ignored"]["frozen"] == 59
    assert [record.getMessage() for record in caplog.records] == [
        "hall: the rigid body Robot 2 of bob is tilted by more than 30 degrees: has the robot tipped over, or is `up` "
        "wrong?",
        "hall: rigid body chair is seen, which no robot has; robots have Robot 2, ann",
        "hall: the rigid body ann of ann does not change at all: its system has lost it, or hangs",
        "hall: rigid body without a name is seen, which no robot has; robots have Robot 2, ann",
    ]


def test_frames_that_are_old_give_no_fix_and_that_none_come_is_told(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.shows(body(HERE, UP, "ann"), ago=3.0)
    assert bench.tick() == []
    bench.shows(body(HERE, UP, "ann"))
    assert len(bench.tick()) == 1
    bench.stream.trouble = "it has shown nothing for 1 s"
    bench.tick()
    assert "hall: it has shown nothing for 1 s" in caplog.text


def test_names_that_do_not_fit_together_are_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "FrameStream", FakeFeed)
    bench = Bench(robots=("ann",))
    bench.node.start()
    assert bench.stream.running
    assert "nothing that is located here has the name bob" in caplog.text
    bench.tick(5.0)
    bench.shows(body(HERE, UP, "Robot 2"))
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
        found.extend(bench.published())
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
