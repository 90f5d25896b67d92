"""The world as a node: commands, safety, requests, reports, snapshots."""

import logging
from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest

from tests.hal.device_bench import referee_state, status
from tests.hal.engine_bench import ENGINE_NAMES
from tests.hal.world_bench import KEYS, Wire, config
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    Body,
    Drive,
    Estop,
    EstopRelease,
    MeasuredPose,
    RefereeState,
    RobotState,
    SensorMessage,
    SpeedLimit,
    WorldAnswer,
    WorldRequest,
)
from vrg.bus.topics import Topic
from vrg.errors import ConfigError, WorldError
from vrg.hal.models import MODELS, robot_model
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.touch import Touch
from vrg.hal.sim.config import check_setup
from vrg.hal.sim.node import WorldNode, place
from vrg.hal.sim.robot import EXTRAPOLATE
from vrg.types import STILL, Pose, Twist

S = TypeVar("S", bound=SensorMessage)
P2AT = robot_model("P2AT")
DISARM = (KEYS.drive("a"), Drive(twist=STILL, armed=False))


def go(name: str = "a", left: float = 3.0, right: float = 3.0) -> tuple[Topic[Drive], Drive]:
    """A command for a robot: the speeds of its wheels, rad/s."""
    return KEYS.drive(name), Drive(twist=P2AT.drivetrain.twist((left, right)))


GO, GO_B = go(), go("b")
LASER_A, LASER_G = (KEYS.sensor(Laser, name, "front") for name in "ag")
SENSORS = {
    "laser/front", "sonar/rings", "touch/main", "encoders/main", "odometry/main", "ins/main", "gps/main",
    "battery/main",
}  # fmt: skip


def sensed(wire: Wire, kind: type[S], name: str = "a") -> S:
    """What a sensor has said last."""
    return wire.last(KEYS.sensor(kind, name, "main"))


def last_of(wire: Wire, kind: type[SensorMessage], name: str) -> object:
    """What a sensor would say now, but for the speed."""
    now = {(robot, type(said)): said for robot, _, said in wire.node.world._sensors.sense(wire.node.world._instant())}
    said = now.get((name, kind), wire.heard[KEYS.sensor(kind, name, "main").key])
    return said.pose if isinstance(said, Odometry) else said


def wire(**options: object) -> Wire:
    return Wire(config(("a", 0.0, 0.0, 0.0), ("b", 0.0, 3.0, 0.0), **options))


@pytest.fixture
def world() -> Wire:
    """Robots a and b on open ground."""
    return wire()


@pytest.fixture
def moving(world: Wire) -> Wire:
    """The same; a drives."""
    world.tick(60, each=[GO])
    assert speed(world) > 0.3
    return world


@pytest.fixture
def stopped(moving: Wire) -> Wire:
    """The same; somebody has engaged the emergency stop."""
    moving.say(KEYS.estop, Estop(by="me"))
    moving.tick(2, each=[GO])
    return moving


def release(world: Wire) -> None:
    world.say(KEYS.estop_release, EstopRelease(by="me"))


def state(wire: Wire, name: str = "a") -> RobotState:
    return wire.last(KEYS.robot_state(name))


def body(wire: Wire, name: str = "a") -> Body:
    return next(body for body in wire.last(KEYS.poses).bodies if body.name == name)


def speed(wire: Wire, name: str = "a") -> float:
    twist = body(wire, name).twist
    return abs(twist.v) + abs(twist.w)


def x_of(wire: Wire, name: str = "a") -> float:
    return wire.node.world.pose(name).x


def referee(a_may: bool = True, **options: object) -> RefereeState:
    return referee_state([status("a", a_may), status("b")], **options)  # type: ignore[arg-type]


class TestReports:
    def test_the_first_tick_reports_time_0_and_does_not_step_and_the_clock_is_said_last(self, world: Wire) -> None:
        world.tick()
        clock = world.last(KEYS.clock)
        assert (clock.time, clock.tick, clock.epoch, clock.estop) == (0.0, 0, 0, False)
        assert x_of(world) == 0.0
        keys = [key for key, _, _ in world.log]
        assert keys[-1] == KEYS.clock.key
        assert set(keys) == {
            KEYS.clock.key, KEYS.poses.key,
            *(KEYS.robot_state(name).key for name in "ab"),
            *(f"{KEYS.root}/robot/{name}/sensor/{sensor}" for name in "ab" for sensor in SENSORS),
        }  # fmt: skip
        world.tick()
        assert world.last(KEYS.clock).tick == 1

    def test_poses_are_true_and_the_ins_is_not(self, world: Wire) -> None:
        world.tick(5)
        assert x_of(world) == 0.0
        assert 0.0 < abs(sensed(world, Ins).pose.x) < 0.2

    def test_scans_come_at_the_lasers_rate(self, world: Wire) -> None:
        world.tick(51)
        stamps = [stamp for key, stamp, _ in world.log if key == LASER_A.key]
        assert np.allclose(np.diff(stamps), 0.1)
        assert len(stamps) == 11
        assert world.last(LASER_A).ranges.shape == (181,)

    def test_lasers_may_be_off(self) -> None:
        world = wire(lasers=False)
        world.tick(20)
        assert LASER_A.key not in world.heard

    def test_the_same_seed_says_the_same_byte_for_byte(self) -> None:
        def play(seed: int) -> list[object]:
            world = wire(seed=seed)
            world.tick(100, each=[GO])
            return world.log  # type: ignore[return-value]

        assert play(1) == play(1)
        assert play(1) != play(2)


class TestCommands:
    def test_it_drives_and_the_other_stands_and_one_that_is_not_there_is_ignored(self, world: Wire) -> None:
        world.tick(60, each=[GO, go("ghost")])
        assert speed(world) == pytest.approx(0.33, abs=0.01)
        assert speed(world, "b") == 0.0
        assert state(world).armed
        assert not state(world, "b").armed
        assert state(world).fault is None

    def test_silence_for_0_2_s_brakes(self, moving: Wire) -> None:
        moving.tick(9)
        assert speed(moving) > 0.3
        assert state(moving).fault is None
        moving.tick(4)
        assert speed(moving) == 0.0
        assert "no drive command" in (state(moving).fault or "")
        moving.tick(60, each=[GO])
        assert speed(moving) > 0.3

    def test_an_unarmed_command_brakes_at_once(self, moving: Wire) -> None:
        moving.tick(4, each=[(GO[0], Drive(twist=GO[1].twist, armed=False))])
        assert speed(moving) == 0.0
        assert not state(moving).armed

    def test_a_speed_limit_caps_both_wheels_alike_and_nobody_is_told(self) -> None:
        world = wire(noise=False)
        world.say(KEYS.speed_limit("a"), SpeedLimit(v_max=0.22))
        world.tick(60, each=[go("a", 4.0, 2.0)])
        assert sensed(world, Odometry).twist.v == pytest.approx(0.22 * 0.75, abs=0.005)
        assert state(world).fault is None

    def test_a_limit_above_the_models_top_speed_changes_nothing(self, world: Wire) -> None:
        world.say(KEYS.speed_limit("a"), SpeedLimit(v_max=50.0))
        world.tick(100, each=[go("a", 900.0, 900.0)])
        assert speed(world) == pytest.approx(P2AT.v_max)

    def test_a_limit_for_a_robot_that_is_not_there_is_ignored(self, world: Wire) -> None:
        world.say(KEYS.speed_limit("c"), SpeedLimit(v_max=0.2))
        world.tick(100, each=[go("a", 900.0, 900.0)])
        assert speed(world) == pytest.approx(P2AT.v_max)


class TestEmergencyStop:
    def test_it_stops_every_robot_within_0_1_s_and_latches(self, world: Wire) -> None:
        world.tick(100, each=[GO, GO_B])
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(5, each=[GO, GO_B])
        for name in "ab":
            assert speed(world, name) == 0.0
            assert state(world, name).estop
            assert not state(world, name).armed
        world.tick(100, each=[GO, GO_B])
        assert speed(world) == 0.0
        assert world.last(KEYS.clock).estop

    def test_after_release_a_player_must_disarm_before_it_arms(self, stopped: Wire) -> None:
        release(stopped)
        stopped.tick(60, each=[GO])
        assert not state(stopped).estop
        assert not state(stopped).armed
        assert speed(stopped) == 0.0, "a player that goes on as before moves nothing"
        stopped.tick(1, each=[DISARM])
        stopped.tick(60, each=[GO])
        assert speed(stopped) > 0.3

    def test_a_robot_disarmed_during_the_stop_is_armed_by_the_first_command_after_it(self, stopped: Wire) -> None:
        stopped.tick(5, each=[DISARM])
        release(stopped)
        stopped.tick(2)
        assert speed(stopped) == 0.0
        stopped.tick(60, each=[GO])
        assert speed(stopped) > 0.3

    def test_arming_during_the_stop_does_not_count(self, world: Wire) -> None:
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(5, each=[GO])
        release(world)
        world.tick(60, each=[GO])
        assert speed(world) == 0.0


class TestReferee:
    @pytest.mark.parametrize("held", [referee(halted="by an official"), referee(estop=True), referee(a_may=False)])
    def test_it_holds_a_robot(self, moving: Wire, held: RefereeState) -> None:
        """Which may move until there is a referee."""
        moving.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(moving) > 0.3
        moving.tick(5, each=[GO, (KEYS.referee_state, held)])
        assert speed(moving) == 0.0
        assert state(moving).armed, "it is held, not disarmed"
        moving.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(moving) > 0.3

    def test_a_player_that_may_not_move_does_not_hold_the_others(self, world: Wire) -> None:
        world.tick(60, each=[GO, GO_B, (KEYS.referee_state, referee(a_may=False))])
        assert speed(world) == 0.0
        assert speed(world, "b") > 0.3

    def test_a_referee_that_is_silent_for_too_long_is_dead_and_all_stop(self, world: Wire) -> None:
        world.tick(60, each=[GO, (KEYS.referee_state, referee())])
        ticks = round(REFEREE_TIMEOUT / world.node.period)
        world.tick(ticks - 1, each=[GO])
        assert speed(world) > 0.3
        world.tick(6, each=[GO])
        assert speed(world) == 0.0


class TestRequests:
    def request(self, world: Wire, places: dict[str, Pose], number: str | None = None) -> WorldAnswer | None:
        """Ask for places; the answer."""
        world.say(KEYS.world_request, WorldRequest(places=places, id=number))
        world.tick()
        return world.last(KEYS.world_answer) if KEYS.world_answer.key in world.heard else None

    def test_a_request_that_is_granted_is_answered_if_it_has_an_id(self, world: Wire) -> None:
        assert self.request(world, {"a": Pose(5, 5, 0)}) is None
        answer = self.request(world, {"a": Pose(5, 5, 0)}, "7")
        assert answer == WorldAnswer(id="7", refused=None)

    @pytest.mark.parametrize("number", ["7", None])
    def test_a_refusal_is_always_answered(self, world: Wire, number: str | None) -> None:
        answer = self.request(world, {"a": Pose(500, 5, 0)}, number)
        assert answer is not None
        assert answer.id == number
        assert "inside map" in (answer.refused or "")

    def test_a_placed_robot_is_at_rest_with_zero_odometry_and_the_others_drive_on(self) -> None:
        world = wire(noise=False)
        world.tick(100, each=[GO, GO_B])
        self.request(world, {"b": Pose(0.0, 3.0, 0.0)})
        assert x_of(world) > 0.4
        assert x_of(world, "b") == pytest.approx(0.0, abs=0.02)
        assert speed(world, "b") <= 0.03
        world.tick(99, each=[GO, GO_B])
        self.request(world, {"a": Pose(0.0, 0.0, 0.0), "b": Pose(0.0, 3.0, 0.0)})
        for name, y in (("a", 0.0), ("b", 3.0)):
            pose = world.node.world.pose(name)
            assert (pose.x, pose.y) == pytest.approx((0.0, y), abs=0.02)
            assert sensed(world, Odometry, name).pose.x == pytest.approx(0.0, abs=0.02)
        assert speed(world) <= 0.03

    @pytest.mark.parametrize(
        "places", [{"a": Pose(4, 4, 1)}, {"a": Pose(0, 3, 0), "b": Pose(0, 0, 0)}], ids=["one moves", "two change"]
    )
    def test_robots_are_placed_at_once(self, world: Wire, places: dict[str, Pose]) -> None:
        world.tick()
        self.request(world, places)
        assert {name: world.node.world.pose(name) for name in places} == places

    def test_as_many_are_placed_as_there_is_room_for_and_the_others_are_named(self) -> None:
        world = Wire(config(("a", 2.0, 2.0, 0.0), ("b", 4.0, 2.0, 0.0), ("c", 6.0, 2.0, 0.0), ("d", 8.0, 2.0, 0.0)))
        world.tick()
        # a cannot leave, so b cannot come to its place, and c cannot come to b's.
        places = {"a": Pose(500, 0, 0), "b": Pose(2, 2, 0), "c": Pose(4, 2, 0), "d": Pose(8, 5, 1)}
        answer = self.request(world, places)
        room = "expected room, but it would overlap"
        for words in ("robot a: ", f"place b: {room} a", f"place c: {room} b"):
            assert words in (answer.refused if answer else "")
        poses = {name: world.node.world.pose(name) for name in "abcd"}
        assert [poses[name].x for name in "abc"] == [2.0, 4.0, 6.0]
        assert poses["d"] == Pose(8, 5, 1)

    @pytest.mark.parametrize(
        ("places", "why"),
        [
            ({}, "expected places"),
            ({"ghost": Pose(5, -20, 0)}, "ghost"),
            ({"a": Pose(-12, -22, 0)}, "wall or obstacle"),
            ({"a": Pose(500, 0, 0)}, "inside map"),
            ({"a": Pose(20.0, -16.9, 0)}, "overlap b"),
        ],
    )
    def test_an_impossible_request_is_logged_and_changes_nothing(
        self, places: dict[str, Pose], why: str, caplog: pytest.LogCaptureFixture
    ) -> None:
        world = Wire(config(("a", 20.0, -20.0, 0.0), ("b", 20.0, -17.0, 0.0), map="courtyard"))
        world.tick()
        before = world.node.world.snapshot().robots
        with caplog.at_level(logging.WARNING):
            self.request(world, places)
        assert why in caplog.text
        assert world.node.world.snapshot().robots == before


class TestBattery:
    def test_an_empty_battery_stops_the_robot_and_says_so(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(MODELS._found, "flat", replace(P2AT, name="flat", battery_wh=0.03))
        world = Wire(config(("a", 0.0, 0.0, 0.0), model="flat"))
        world.tick(60, each=[GO])
        assert 0.0 < sensed(world, Battery).charge < 1.0
        assert speed(world) > 0.3
        world.tick(200, each=[GO])
        assert sensed(world, Battery).charge == 0.0
        assert speed(world) == 0.0
        assert "battery empty" in (state(world).fault or "")
        world.tick()  # so that the next energy balance after the restart is 10 ticks away
        new = world.restarted()
        new.tick(8, each=[GO])
        assert speed(new) == 0.0, "nor does it move after a restart"
        assert "battery empty" in (state(new).fault or "")


class TestSnapshot:
    @pytest.mark.parametrize("engine", ENGINE_NAMES)
    def test_a_restored_world_goes_on_where_the_snapshot_was_taken(self, engine: str) -> None:
        old = wire(engine=engine, noise=False)
        old.tick(1)
        old.say(KEYS.speed_limit("a"), SpeedLimit(v_max=0.4))
        old.tick(100, each=[GO, go("b", 1.0, 2.0)])
        new = old.restarted()
        assert new.node.start_tick == 100
        new.tick()
        clock = new.last(KEYS.clock)
        assert (clock.tick, clock.epoch) == (100, 1)
        assert clock.time == pytest.approx(2.0)
        for name in "ab":
            after = state(new, name)
            for kind in (Odometry, Encoders, Battery):
                assert last_of(old, kind, name) == last_of(new, kind, name)
            assert old.node.world.pose(name) == new.node.world.pose(name)
            assert speed(new, name) == 0.0, "at rest"
            assert not after.armed
        new.tick(60, each=[go("a", 6.0, 6.0)])
        assert speed(new) == pytest.approx(0.4, abs=0.01), "limits are kept"
        old.node.stop()
        new.node.stop()

    def test_a_restored_world_steps_from_its_second_tick(self, world: Wire) -> None:
        world.tick(10)
        new = world.restarted()
        new.tick(2)
        assert new.last(KEYS.clock).tick == 10

    def test_the_emergency_stop_survives_a_restart(self, stopped: Wire) -> None:
        new = stopped.restarted()
        new.tick(10, each=[GO])
        assert state(new).estop
        release(new)
        new.tick(60, each=[GO])
        assert speed(new) == 0.0, "it must still be disarmed and armed"

    def test_noise_goes_on_after_a_restart(self) -> None:
        whole, old = wire(seed=3), wire(seed=3)
        whole.tick(400)
        old.tick(200)
        new = old.restarted()
        new.tick(201)
        assert sensed(new, Ins) == sensed(whole, Ins)

    def test_a_restored_world_that_had_a_referee_waits_for_it(self, world: Wire) -> None:
        world.say(KEYS.referee_state, referee())
        world.tick(20, each=[GO])
        new = world.restarted()
        new.tick(60, each=[GO])
        assert speed(new) == 0.0
        new.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(new) > 0.3

    def test_damaged_bytes_and_the_snapshot_of_another_set_up_are_refused(self, world: Wire) -> None:
        good = world.node.snapshot()
        for kept, words in (
            (b"\x00garbage", "snapshot"),
            (good[: len(good) // 2], "snapshot"),
            (good, "choose another run folder"),
        ):
            with pytest.raises(WorldError, match=words):
                WorldNode(config(("z", 0.0, 0.0, 0.0)), Mailbox(), KEYS, kept)


class TestSetup:
    def test_all_problems_are_told_at_once(self) -> None:
        bad = config(
            ("a", 20, -20, 0),
            ("b", 20.2, -20, 1.0),
            ("wall", -12, -22, 0),
            ("far", 300, 0, 0),
            ("a", 22, -22, 0),
            ("no/name", 24, -24, 0),
            map="courtyard",
            engine="steam",
            tick=0.0,
            seed=-1,
            rate=-2.0,
        )
        problems = check_setup(bad)
        text = "\n".join(map(str, problems))
        for words in (
            "a and b", "players.wall: expected a free place", "players.far: expected a pose inside",
            "a name of its own", "no/name", "engine", "tick", "seed", "rate",
        ):  # fmt: skip
            assert words in text
        assert len(problems) == 9

    def test_an_unknown_map_and_model_are_problems_and_a_good_set_up_has_none(self) -> None:
        assert len(check_setup(config(("a", 0, 0, 0), map="atlantis", model="tricycle"))) == 2
        assert check_setup(config(("a", 20, -20, 0), ("b", 20, -18, 0), map="courtyard", engine="pybullet")) == []

    def test_a_world_with_problems_is_not_built(self) -> None:
        with pytest.raises(ConfigError, match="a and b"):
            WorldNode(config(("a", 0, 0, 0), ("b", 0.1, 0, 0)), Mailbox(), KEYS)


def measure(wire: Wire, x: float, y: float = 0.0, v: float = 0.0, w: float = 0.0, name: str = "g") -> None:
    wire.say(KEYS.robot_pose(name), MeasuredPose(pose=Pose(x, y, 0.0), twist=Twist(v, w)))


def mixed(**options: object) -> Wire:
    """Virtual `a` and physical `g`, 3 m ahead of it, after two ticks."""
    world = Wire(config(("a", 0.0, 0.0, 0.0), ("g", 3.0, 0.0, 0.0), physical="g", noise=False, **options))
    world.tick(2)
    return world


class TestPhysicalRobots:
    @pytest.fixture
    def world(self) -> Wire:
        return mixed()

    def test_before_the_first_measurement_it_stands_at_its_start_as_its_device_is_told(self, world: Wire) -> None:
        assert world.last(KEYS.robot_seen("g")).pose == Pose(3.0, 0.0, 0.0)
        assert KEYS.robot_seen("a").key not in world.heard, "a virtual robot's device needs no such thing"
        world.tick(24)
        assert body(world, "g") == Body("g", Pose(3.0, 0.0, 0.0), STILL, True, pytest.approx(0.5))
        assert body(world, "a").age == 0.0
        assert not body(world, "a").physical

    def test_it_is_where_it_was_measured_and_goes_on_for_a_while(self, world: Wire) -> None:
        measure(world, 5.0, 1.0, v=0.5)
        world.tick(6)
        now = body(world, "g")
        assert now.age == pytest.approx(0.1)
        assert (now.pose.x, now.pose.y, now.twist.v) == pytest.approx((5.0 + 0.5 * 0.1, 1.0, 0.5))
        world.tick(20)
        now = body(world, "g")
        assert now.age == pytest.approx(0.5)
        assert now.pose.x == pytest.approx(5.0 + 0.5 * EXTRAPOLATE), "nobody knows where it went"
        assert (now.twist.v, now.twist.w) == (0.0, 0.0)

    def test_poses_that_cannot_be_are_told_once(self, world: Wire, caplog: pytest.LogCaptureFixture) -> None:
        world.tick(5)
        for name, why in (("a", "pose of a: expected one of the physical robots and things (g)"), ("x", "pose of x: ")):
            for _ in range(10):
                measure(world, 9.0, name=name)
                world.tick()
            assert caplog.text.count(why) == 1
        with pytest.raises(WorldError, match="pose of g: expected a pose of now"):
            world.node.world.measure("g", MeasuredPose(pose=Pose(9.0, 0.0, 0.0)), world.node.world.time + 0.3)
        world.tick(10)
        assert body(world, "g").pose.x == 3.0
        assert body(world, "a").pose.x == 0.0
        caplog.clear()
        for n in range(300):
            measure(world, 9.0, name=f"x{n}")
        world.tick()
        assert len(caplog.records) < 101

    def test_it_has_no_simulated_state_and_takes_no_commands(self, world: Wire) -> None:
        world.tick(20, each=[GO, go("g")])
        assert KEYS.robot_state("g").key not in world.heard
        assert state(world).armed
        assert body(world, "g").pose.x == 3.0
        assert body(world, "a").pose.x > 0.0

    def test_it_is_scanned_and_has_scans(self, world: Wire) -> None:
        measure(world, 2.0)
        world.tick(10)
        nearest = 2.0 - P2AT.length / 2 - P2AT.sensor(LaserSpec).x  # type: ignore[union-attr]
        assert world.last(LASER_A).ranges[90] == pytest.approx(nearest, abs=0.001)
        sees = world.last(LASER_G)
        assert sees.ranges.min() == sees.range_max, "a is behind it"
        world.say(KEYS.world_request, WorldRequest(places={"a": Pose(4.0, 0.0, 0.0)}))
        world.tick(10)
        assert world.last(LASER_G).ranges[90] == pytest.approx(nearest, abs=0.001)

    def test_nobodys_noise_depends_on_it(self) -> None:
        def readings(*robots: tuple[str, float, float, float]) -> dict[str, list[object]]:
            world = Wire(config(*robots, physical="g", seed=4, lasers=False))
            world.tick(300, each=[GO])
            said: dict[str, list[object]] = {}
            for key, _, message in world.log:
                if "/robot/a/" in key:
                    said.setdefault(key, []).append(message)
            return said

        assert readings(("a", 0, 0, 0)) == readings(("g", 9, 9, 0), ("a", 0, 0, 0))

    @pytest.mark.parametrize("engine", ENGINE_NAMES)
    def test_a_virtual_robot_bumps_into_it_and_is_pushed(self, engine: str) -> None:
        world = mixed(engine=engine)
        measure(world, 0.8)
        world.tick(100, each=[GO])
        assert sensed(world, Touch).pressed[0]
        assert x_of(world) == pytest.approx(0.8 - P2AT.length, abs=0.02)
        for n in range(20):
            measure(world, 0.8 - 0.05 * n, v=-0.5)
            world.tick(5)
        assert x_of(world) < -0.6

    @pytest.mark.parametrize(
        ("places", "why"),
        [
            ({"g": Pose(5, 5, 0)}, "g is physical: carry"),
            ({"a": Pose(3.2, 0, 0)}, "overlap g, a physical robot"),
        ],
    )
    def test_only_people_move_it(self, world: Wire, places: dict[str, Pose], why: str) -> None:
        before = world.node.snapshot()
        with pytest.raises(WorldError, match=why):
            place(world.node.world, places)
        assert world.node.snapshot() == before

    def test_it_may_stand_between_virtual_robots_in_the_list(self) -> None:
        world = Wire(config(("v", 0, 5, 0), ("g", 3, 0, 0), ("b", 5, 5, 0), physical="g", noise=False))
        world.tick(62, each=[GO_B])
        assert world.node.world.names == ["v", "g", "b"]
        states = {key.split("/")[3] for key in world.heard if key.endswith("/state")}
        assert states == {"v", "b"}
        assert sensed(world, Odometry, "b").twist.v == pytest.approx(0.33, abs=0.02)
        assert sensed(world, Odometry, "b").pose.x > 0.1
        assert sensed(world, Odometry, "v").pose.x == 0.0

    def test_a_restored_world_has_it_where_it_was_and_counts_its_age_anew(self, world: Wire) -> None:
        measure(world, 5.0, 1.0)
        world.tick(20, each=[GO])
        new = world.restarted()
        new.tick(2)
        since = pytest.approx(new.node.world.time - 0.02)
        assert body(new, "g") == Body("g", Pose(5.0, 1.0, 0.0), STILL, True, pytest.approx(0.02), since)
        assert new.node.world.virtual == ["a"]
        assert new.node.world.names == ["a", "g"], "in the order of the set-up"
        assert new.node.world.pose("a") == world.node.world.pose("a")
        measure(new, 6.0)
        new.tick()
        assert body(new, "g").pose.x == 6.0

    def test_a_match_with_and_one_without_it_are_two_set_ups(self, world: Wire) -> None:
        virtual = config(("a", 0.0, 0.0, 0.0), ("g", 3.0, 0.0, 0.0), noise=False)
        with pytest.raises(WorldError, match="choose another run folder"):
            Wire(virtual, world.node.snapshot())

    def test_its_start_must_be_free_like_any_other(self) -> None:
        problems = check_setup(config(("a", 20, -20, 0), ("g", 20.2, -20, 0), physical="g", map="courtyard"))
        assert [str(p) for p in problems] == ["players.a: expected room between a and g, but they overlap"]
