"""The backend `ros` against a robot of another implementation: the contract of drivers, and what only it can do."""

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from test_reported import odometry
from test_wire import definitions

from vrg.bus.session import Session, open_router, open_session
from vrg.errors import ConfigError, RobotError
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.laser import Laser
from vrg.hal.simulated_clock import SimulatedClock
from vrg.launch.endpoints import free_endpoint
from vrg.testing.driver import DriverBench, DriverContract, armed
from vrg.types import Twist
from vrg_ros.cdr import Message, encode
from vrg_ros.driver import RosDriver
from vrg_ros.graph import RosNode
from vrg_ros.meeting import commanders, graph_of
from vrg_ros.reported import Reported
from vrg_ros.settings import RosSettings
from vrg_ros.wire import data_key

DOMAIN, STEP, BOOT = 7, 0.05, 1000.0
"""The domain; the time between two readings, s; what the robot's clock reads as the match begins, s."""

AGAIN, PATIENCE = 0.5, 120.0
"""The real time in s after which readings that have not come are asked for again, and given up."""


class Robot:
    """The process of the robot, and the router that it uses."""

    def __init__(self, folder: Path, twist_type: str) -> None:
        self.endpoint = free_endpoint()
        self._router = open_router(self.endpoint)
        self._router.__enter__()
        command = [sys.executable, "-P", str(Path(__file__).parent / "robot.py"), self.endpoint.rpartition(":")[2]]
        self.process = subprocess.Popen(
            [*command, str(DOMAIN), "/tb1", str(definitions(folder)), twist_type],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1,
        )  # fmt: skip
        self._line()

    def ask(self, line: str) -> str:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        return self._line()

    def _line(self) -> str:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, "the robot's process has ended"
        return line

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(60)
        self._router.__exit__(None, None, None)


def options(endpoint: str, **robot: Any) -> dict[str, Any]:
    return {"router": endpoint, "domain": DOMAIN, "robots": {"r": {"namespace": "tb1", **robot}}}


def driver_at(endpoint: str, clock: SimulatedClock | None = None, **robot: Any) -> RosDriver:
    now = {} if clock is None else {"now": clock.now}
    context = DriverContext(name="r", model=robot_model("P2AT"), options=options(endpoint, **robot), **now)
    return RosDriver(context, **({} if clock is None else {"clock": clock}))


class RosBench(DriverBench):
    """Time is simulated, while commands and readings are on the wire: every step waits until they have come."""

    def __init__(self, robot: Robot, patch: pytest.MonkeyPatch) -> None:
        self.robot, self.clock, self.talks = robot, SimulatedClock(), True
        self.sent: tuple[float, float] = (0.0, 0.0)
        bench = self

        class Watched(RosNode):
            def publish(self, topic: str, of: str, message: Message, lasting: bool = False) -> None:
                super().publish(topic, of, message, lasting)
                if not topic.endswith("cmd_vel"):
                    return
                twist = message.get("twist", message)
                bench.sent = twist["linear"]["x"], twist["angular"]["z"]
                bench.published = message

        patch.setattr("vrg_ros.graph.RosNode", Watched)
        self.published: Message = {}
        self.driver = driver_at(robot.endpoint, self.clock)
        robot.ask(f"0 {BOOT} 0 0 0")
        robot.ask("reset")

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            self.clock.sleep(STEP)
            v, w = self.sent
            self.robot.ask(f"{STEP} {BOOT + self.clock.now()} {v} {w} {int(self.talks)}")
            began = again = time.monotonic()
            while self.talks and self._is_connected and not self._is_heard:
                time.sleep(0.001)
                assert time.monotonic() - began < PATIENCE, "the driver hears nothing of the robot"
                if time.monotonic() - again > AGAIN:
                    # What is published before a subscription has come to the router is lost, on a busy machine, too.
                    again = time.monotonic()
                    self.robot.ask(f"0 {BOOT + self.clock.now()} {v} {w} 1")

    def cut(self) -> None:
        self.talks = False

    @property
    def _is_connected(self) -> bool:
        return self.driver._open is not None

    @property
    def _is_heard(self) -> bool:
        try:
            readings = self.driver.read()
        except RobotError:
            return False
        return all(sample.age < 1e-6 for sample in readings.samples) and len(readings.samples) == 3


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    made = Robot(tmp_path_factory.mktemp("messages"), "geometry_msgs/msg/Twist")
    yield made
    made.close()


@pytest.fixture
def bench(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Iterator[RosBench]:
    made = RosBench(robot, monkeypatch)
    yield made
    made.driver.close()
    made.clock.close()


def drives(bench: RosBench, v: float = 0.3) -> None:
    """Arm it, and see that it drives."""
    armed(bench)
    bench.run(Twist(v, 0.0), 0.5)
    assert bench.speed == pytest.approx(v)
    assert bench.sent == (v, 0.0)


class TestRos(DriverContract):
    pass


def test_a_scan_and_a_charge_are_what_the_robot_measures(bench: RosBench) -> None:
    """A beam without an echo reads the longest range, one that is too near the shortest, and what is discarded 0."""
    bench.driver.connect()
    bench.advance(0.2)
    readings = bench.driver.read()
    scan, battery = readings.latest(Laser), readings.latest(Battery)
    assert scan is not None
    assert battery is not None
    np.testing.assert_allclose(scan.value.ranges, [1.0, 8.0, 2.0, 0.0, 0.0, 0.0, 0.1])
    assert (scan.value.angle_min, scan.value.angle_step, battery.value.charge) == (-1.5, 0.5, 0.75)


def test_a_robot_that_falls_silent_is_disarmed_and_armed_again_when_it_talks(bench: RosBench) -> None:
    drives(bench)
    bench.cut()
    bench.advance(1.0)
    readings = bench.driver.read()
    assert not readings.armed
    assert "no odometry on /tb1/odom for 1.0 s" in str(readings.fault)
    with pytest.raises(RobotError, match="no odometry"):
        bench.driver.drive(Twist(0.2, 0.0))
    assert bench.sent == (0.0, 0.0)
    bench.talks = True
    bench.advance(0.1)
    assert bench.driver.read().fault is None
    drives(bench)


def test_its_way_goes_on_where_its_odometry_begins_anew(bench: RosBench, caplog: pytest.LogCaptureFixture) -> None:
    armed(bench)
    bench.run(Twist(0.5, 0.0), 2.0)
    before = bench.odometry.pose
    bench.robot.ask("reset")
    bench.run(Twist(0.5, 0.0), 1.0)
    assert bench.odometry.pose.x - before.x == pytest.approx(0.5, abs=0.05)
    assert "restarted" in caplog.text


def test_who_is_disarmed_is_left_to_others_after_a_while(bench: RosBench) -> None:
    bench.driver.connect()
    bench.advance(1.5)
    bench.published = {}
    bench.advance(0.5)
    assert bench.published == {}
    bench.driver.emergency_stop()
    bench.advance(3.0)
    bench.published = {}
    bench.advance(0.2)
    assert bench.published != {}, "while the emergency stop is engaged it is commanded to stand"


def test_a_robot_that_wants_stamps_gets_them_by_its_own_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(tmp_path, "geometry_msgs/msg/TwistStamped")
    bench = RosBench(robot, monkeypatch)
    try:
        armed(bench)
        bench.run(Twist(0.3, 0.1), 1.0)
        assert bench.speed == pytest.approx(0.3)
        header = bench.published["header"]
        assert header["frame_id"] == "base_footprint"
        assert header["stamp"]["sec"] == int(BOOT + bench.clock.now())
    finally:
        bench.driver.close()
        robot.close()


def test_a_driver_that_fails_commands_zeros_and_can_be_recovered(
    bench: RosBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    drives(bench)
    before = bench.odometry.pose
    with monkeypatch.context() as broken:
        broken.setattr(Reported, "age", lambda *_: 1 / 0)
        bench.clock.sleep(0.5)
    assert bench.sent == (0.0, 0.0)
    readings = bench.driver.read()
    assert "ZeroDivisionError" in str(readings.fault)
    assert not readings.armed
    with pytest.raises(RobotError, match="its driver has failed"):
        bench.driver.drive(Twist(0.3, 0.0))
    bench.driver.recover()
    armed(bench)
    assert bench.odometry.pose == before, "it stands where it was"
    drives(bench)
    assert bench.odometry.pose.x > before.x + 0.1


def test_a_driver_whose_thread_hangs_is_a_fault(bench: RosBench, monkeypatch: pytest.MonkeyPatch) -> None:
    armed(bench)
    began = bench.clock.now()
    monkeypatch.setattr(RosDriver, "_hear", lambda _: bench.clock.sleep(5.0))
    bench.clock.sleep(1.0)
    monkeypatch.undo()
    assert bench.clock.now() > began
    assert "its driver has hung for" in str(bench.driver.read().fault)


def test_after_a_lost_link_a_robot_hears_zeros(robot: Robot, bench: RosBench) -> None:
    """Longer away than zeros are commanded: they are kept for the new link."""
    drives(bench)
    session = bench.driver._session
    assert session is not None
    session._link._up = False
    bench.clock.sleep(5.0)
    assert bench.driver.read().fault == f"the link to the router {robot.endpoint} was lost"
    session._link._up = True
    bench.published = {}
    bench.clock.sleep(0.2)
    assert (bench.published != {}, bench.sent) == (True, (0.0, 0.0))


def test_a_node_that_is_no_robot_harms_nothing(robot: Robot, bench: RosBench, caplog: pytest.LogCaptureFixture) -> None:
    """Numbers out of bounds, bytes that are no message, and megabytes are left out one by one, and logged seldom."""
    drives(bench)
    node = bench.driver._node
    assert node is not None
    bench.cut()
    wild = {"header": {"stamp": {"sec": 2**31 - 1}}, "range_max": 1e30, "range_min": math.inf, "ranges": [-math.inf]}
    odd = {"pose": {"pose": {"orientation": {"y": 1e200}}}}
    with open_session(robot.endpoint) as session:
        for topic, of, message in (
            ("/tb1/odom", "nav_msgs/Odometry", odd),
            ("/tb1/scan", "sensor_msgs/LaserScan", wild),
        ):
            for payload in (encode(of, message), b"x" * 50, bytes(2_000_000), b""):
                before, sent, deadline = node._left_out[topic], -math.inf, time.monotonic() + PATIENCE
                while node._left_out[topic] == before and time.monotonic() < deadline:
                    if time.monotonic() > sent + AGAIN:  # one of which the newest counts may be lost
                        session.put_raw(data_key(DOMAIN, topic, of), payload, b"")
                        sent = time.monotonic()
                    bench.driver.read()
                assert node._left_out[topic] > before
    assert len([line for line in caplog.messages if "dropped" in line]) == 2
    bench.talks = True
    bench.run(Twist(0.2, 0.0), 0.3)
    assert bench.driver.read().armed
    assert bench.speed == pytest.approx(0.2)


@pytest.fixture
def driver(endpoint: str) -> Iterator[RosDriver]:
    """One whose router runs, and no robot."""
    clock = SimulatedClock()
    yield driver_at(endpoint, clock)
    clock.close()


def test_two_nodes_that_publish_odometry_are_refused_and_another_commander_is_named(
    driver: RosDriver, session: Session, caplog: pytest.LogCaptureFixture
) -> None:
    base, teleop = RosNode(session, DOMAIN, "base"), RosNode(session, DOMAIN, "teleop")
    base.subscribe("/tb1/cmd_vel", "geometry_msgs/Twist")
    base.advertise("/tb1/odom", "nav_msgs/Odometry")
    teleop.advertise("/tb1/cmd_vel", "geometry_msgs/Twist")
    with open_session(driver._router) as other:  # until the router knows it, too
        deadline = time.monotonic() + PATIENCE
        while "/teleop" not in commanders(graph_of(other, DOMAIN), "/tb1/cmd_vel"):
            assert time.monotonic() < deadline, "the router does not know of it"
            time.sleep(0.05)
    with driver:
        assert "r: /tb1/cmd_vel is commanded by /teleop, too: stop it" in caplog.text
        driver._clock.sleep(0.2)
        assert "/tb1/vrg_r" in commanders(graph_of(session, DOMAIN), "/tb1/cmd_vel")
        lacks = RosSettings.model_validate(options(driver._router)).missing_here(["r"])
        assert lacks == ["r: it is commanded by /teleop: stop that before the match"]
    teleop.advertise("/tb1/odom", "nav_msgs/Odometry")
    with pytest.raises(RobotError, match="expected one node that publishes /tb1/odom, got /base and /teleop"):
        driver.connect()


def test_odometry_that_is_old_when_it_comes_is_told_from_silence() -> None:
    """The robot's clock has stood still for 2 s, as far as stamps tell."""
    plain, simulated = (driver_at("tcp/127.0.0.1:1", use_sim_time=simulated) for simulated in (False, True))
    for driver in (plain, simulated):
        driver._reported.odometry(odometry(100.0), 0.0)
        driver._reported.odometry(odometry(100.1), 2.1)
        assert "no odometry on /tb1/odom for" in str(driver._silence(5.0))
    assert "the odometry on /tb1/odom is 2.0 s old when it arrives" in str(plain._silence(2.2))
    assert simulated._silence(2.2) is None


def test_a_robot_that_another_node_begins_to_command_is_left_to_it(robot: Robot, bench: RosBench) -> None:
    bench.driver.connect()
    with open_session(robot.endpoint) as session:
        teleop, deadline = RosNode(session, DOMAIN, "teleop"), time.monotonic() + PATIENCE

        def command() -> None:
            while bench.driver.read().fault is None and time.monotonic() < deadline:
                teleop.publish("/tb1/cmd_vel", "geometry_msgs/TwistStamped", {})
                bench.advance(STEP)
            assert "another node commands /tb1/cmd_vel" in str(bench.driver.read().fault)
            assert not bench.driver.read().armed

        bench.advance(0.1)
        command()
        assert not bench.driver.read().latched, "it was not armed"
        bench.advance(1.5)
        drives(bench)
        assert bench.driver.read().armed, "the driver's own commands are no other's"
        command()
        assert bench.sent == (0.0, 0.0)
    bench.advance(3.0)
    with pytest.raises(RobotError, match="another node"):
        bench.driver.drive(Twist(0.3, 0.0))
    assert bench.driver.read().latched
    bench.driver.recover()
    drives(bench)


def test_what_is_missing_in_the_graph_is_named(driver: RosDriver, session: Session) -> None:
    node = RosNode(session, DOMAIN, "other")
    node.publish("/tb2/odom", "nav_msgs/Odometry", {})
    with pytest.raises(RobotError, match=r"expected a node that obeys /tb1/cmd_vel and .* got the topics /tb2/odom"):
        driver.connect()


def test_a_robot_of_humble_is_refused_in_words(driver: RosDriver, session: Session) -> None:
    token = "@ros2_lv/7/a/0/{}/{}/%/%/base/%tb1%{}/{}_/TypeHashNotSupported/::,10:,:,:,,"
    session.declare_alive(token.format(1, "MS", "cmd_vel", "geometry_msgs::msg::dds_::Twist"))
    session.declare_alive(token.format(2, "MP", "odom", "nav_msgs::msg::dds_::Odometry"))
    with pytest.raises(RobotError, match=r"/base runs Humble, which has no hashes of types: use Jazzy or later"):
        driver.connect()


def test_without_a_router_it_says_what_to_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.bus.session.open_session", lambda endpoint, **_: open_session(endpoint, patience=0.0))
    with pytest.raises(RobotError, match="expected the router of its ROS nodes"):
        driver_at(free_endpoint()).connect()


def test_mistakes_in_the_match_file_are_found() -> None:
    other = {"cmd_vel": "/tb1/cmd_vel", "router": "tcp/localhost:7447"}
    settings = RosSettings.model_validate({"robots": {"a": {"namespace": "tb1"}, "b": other, "c": {}}})
    assert settings.problems(dict.fromkeys("abd", robot_model("P2AT")), Path()) == [
        "expected a table [backends.ros.robots.d] with its topics, found none",
        "robots.b: a obeys /tb1/cmd_vel, too: give each a `namespace`",
    ]
    assert settings.endpoints(["a"]) == ["tcp/127.0.0.1:7447"]
    with pytest.raises(ValidationError, match="expected a router such as"):
        RosSettings.model_validate({"router": "tcp/127.0.0.1:99999"})
    with pytest.raises(ConfigError, match=r"robots\.r"):
        RosDriver(DriverContext(name="r", model=robot_model("P2AT"), options={}))


def test_a_robot_without_a_laser_leaves_it_to_the_world() -> None:
    assert driver_at("tcp/127.0.0.1:1", scan="").measures == {"odometry", "battery"}
    model = robot_model("P2AT")
    bare = replace(model, sensors=tuple(spec for spec in model.sensors if spec.kind == "odometry"))
    assert RosDriver(DriverContext(name="r", model=bare, options=options("tcp/127.0.0.1:1"))).measures == {"odometry"}
