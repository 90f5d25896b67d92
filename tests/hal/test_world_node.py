"""The world as a node: commands, safety, requests, reports, snapshots."""

import logging
from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest

from tests.hal.world_bench import KEYS, Wire, config
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    Body,
    Clock,
    Drive,
    Estop,
    EstopRelease,
    MeasuredPose,
    PlayerStatus,
    Poses,
    RefereeState,
    RequestKind,
    RobotState,
    SensorMessage,
    SpeedLimit,
    Stage,
    WorldAnswer,
    WorldRequest,
)
from vrg.errors import ConfigError, WorldError
from vrg.hal.gate import REFEREE_TIMEOUT
from vrg.hal.models import MODELS, robot_model
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.touch import Touch
from vrg.hal.sim.config import check_setup
from vrg.hal.sim.ghost import EXTRAPOLATE
from vrg.hal.sim.node import WorldNode
from vrg.hal.sim.requests import grant
from vrg.types import STILL, Pose, Twist

S = TypeVar("S", bound=SensorMessage)
P2AT = robot_model("P2AT")
GO = (KEYS.drive("a"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0))))
GO_B = (KEYS.drive("b"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0))))
DISARM = Drive(twist=STILL, armed=False)


LASER_A, LASER_C, LASER_G = (KEYS.sensor(Laser, name, "front").key for name in "acg")
SENSORS = {
    "laser/front", "sonar/rings", "touch/main", "encoders/main", "odometry/main", "ins/main", "gps/main",
    "battery/main",
}  # fmt: skip


def sensed(wire: Wire, kind: type[S], name: str = "a") -> S:
    """What a sensor has said last."""
    body = wire.heard[KEYS.sensor(kind, name, "main").key]
    assert isinstance(body, kind)
    return body


def last_of(wire: Wire, kind: type[SensorMessage], name: str) -> object:
    """What a sensor would say now, but for the speed."""
    now = {(robot, type(said)): said for robot, _, said in wire.node.world._sensors.sense(wire.node.world._instant())}
    said = now.get((name, kind), wire.heard[KEYS.sensor(kind, name, "main").key])
    return said.pose if isinstance(said, Odometry) else said


def wire(**options: object) -> Wire:
    return Wire(config(("a", 0.0, 0.0, 0.0), ("b", 0.0, 3.0, 0.0), **options))


def state(wire: Wire, name: str = "a") -> RobotState:
    body = wire.heard[KEYS.robot_state(name).key]
    assert isinstance(body, RobotState)
    return body


def speed(wire: Wire, name: str = "a") -> float:
    poses = wire.heard[KEYS.poses.key]
    assert isinstance(poses, Poses)
    return next(abs(body.twist.v) + abs(body.twist.w) for body in poses.bodies if body.name == name)


def x_of(wire: Wire, name: str = "a") -> float:
    return wire.node.world.pose(name).x


def referee(halted: str | None = None, estop: bool = False, a_may: bool = True) -> RefereeState:
    players = [
        PlayerStatus(name=n, team="t", role="r", state="s", may_move=may, radius=0.35)
        for n, may in (("a", a_may), ("b", True))
    ]
    return RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=players, zones=(), estop=estop,
    )  # fmt: skip


class TestReports:
    def test_the_first_tick_reports_time_0_and_does_not_step(self) -> None:
        world = wire()
        world.tick()
        clock = world.heard[KEYS.clock.key]
        assert isinstance(clock, Clock)
        assert (clock.time, clock.tick, clock.epoch, clock.estop) == (0.0, 0, 0, False)
        assert x_of(world) == 0.0
        world.tick()
        assert world.heard[KEYS.clock.key].tick == 1  # type: ignore[attr-defined]

    def test_the_clock_is_said_last(self) -> None:
        world = wire()
        world.tick()
        keys = [key for key, _, _ in world.log]
        assert keys[-1] == KEYS.clock.key
        assert set(keys) == {
            KEYS.clock.key, KEYS.poses.key,
            *(KEYS.robot_state(name).key for name in "ab"),
            *(f"{KEYS.root}/robot/{name}/sensor/{sensor}" for name in "ab" for sensor in SENSORS),
        }  # fmt: skip

    def test_poses_are_true_and_the_ins_is_not(self) -> None:
        world = wire()
        world.tick(5)
        assert x_of(world) == 0.0
        assert sensed(world, Ins).pose.x != 0.0
        assert abs(sensed(world, Ins).pose.x) < 0.2

    def test_scans_come_at_the_lasers_rate(self) -> None:
        world = wire()
        world.tick(51)
        stamps = [stamp for key, stamp, _ in world.log if key == LASER_A]
        assert np.allclose(np.diff(stamps), 0.1)
        assert len(stamps) == 11
        scan = world.heard[LASER_A]
        assert isinstance(scan, Laser)
        assert scan.ranges.shape == (181,)

    def test_lasers_may_be_off(self) -> None:
        world = wire(lasers=False)
        world.tick(20)
        assert LASER_A not in world.heard

    def test_the_same_seed_says_the_same_byte_for_byte(self) -> None:
        def play(seed: int) -> list[object]:
            world = wire(seed=seed)
            world.tick(100, each=[GO])
            return world.log  # type: ignore[return-value]

        assert play(1) == play(1)
        assert play(1) != play(2)


class TestCommands:
    def test_it_drives_and_the_other_stands(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        assert speed(world) == pytest.approx(0.33, abs=0.01)
        assert speed(world, "b") == 0.0
        assert state(world).armed
        assert not state(world, "b").armed

    def test_silence_for_0_2_s_brakes(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        world.tick(9)
        assert speed(world) > 0.3
        assert state(world).fault is None
        world.tick(4)
        assert speed(world) == 0.0
        assert "no drive command" in (state(world).fault or "")
        world.tick(60, each=[GO])
        assert speed(world) > 0.3

    def test_an_unarmed_command_brakes_at_once(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        world.tick(4, each=[(KEYS.drive("a"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0)), armed=False))])
        assert speed(world) == 0.0
        assert not state(world).armed

    def test_a_speed_limit_caps_both_wheels_alike_and_nobody_is_told(self) -> None:
        world = wire(noise=False)
        world.say(KEYS.speed_limit("a"), SpeedLimit(v_max=0.22))
        world.tick(60, each=[(KEYS.drive("a"), Drive(twist=P2AT.drivetrain.twist((4.0, 2.0))))])
        assert sensed(world, Odometry).twist.v == pytest.approx(0.22 * 0.75, abs=0.005)
        assert state(world).fault is None

    def test_a_limit_above_the_models_top_speed_changes_nothing(self) -> None:
        world = wire()
        world.say(KEYS.speed_limit("a"), SpeedLimit(v_max=50.0))
        world.tick(100, each=[(KEYS.drive("a"), Drive(twist=P2AT.drivetrain.twist((900.0, 900.0))))])
        assert speed(world) == pytest.approx(P2AT.v_max)

    def test_a_limit_may_come_before_its_robot(self) -> None:
        world = wire()
        world.say(KEYS.speed_limit("c"), SpeedLimit(v_max=0.2))
        world.tick()
        spawn = WorldRequest(kind=RequestKind.SPAWN, robot="c", model="P2AT", pose=Pose(5, 5, 0))
        world.say(KEYS.world_request, spawn)
        world.tick(60, each=[(KEYS.drive("c"), Drive(twist=P2AT.drivetrain.twist((6.0, 6.0))))])
        assert speed(world, "c") == pytest.approx(0.2)

    def test_commands_for_a_robot_that_is_not_there_are_ignored(self) -> None:
        world = wire()
        world.tick(5, each=[(KEYS.drive("ghost"), Drive(twist=P2AT.drivetrain.twist((1.0, 1.0))))])
        assert state(world).fault is None


class TestEmergencyStop:
    def test_it_stops_every_robot_within_0_1_s_and_latches(self) -> None:
        world = wire()
        world.tick(100, each=[GO, GO_B])
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(5, each=[GO, GO_B])
        for name in "ab":
            assert speed(world, name) == 0.0
            assert state(world, name).estop
            assert not state(world, name).armed
        world.tick(100, each=[GO, GO_B])
        assert speed(world) == 0.0
        assert world.heard[KEYS.clock.key].estop  # type: ignore[attr-defined]

    def test_after_release_a_player_that_goes_on_as_before_moves_nothing(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(20, each=[GO])
        world.say(KEYS.estop_release, EstopRelease(by="me"))
        world.tick(60, each=[GO])
        assert not state(world).estop
        assert not state(world).armed
        assert speed(world) == 0.0

    def test_disarming_and_arming_after_release_moves_it_again(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(20, each=[GO])
        world.say(KEYS.estop_release, EstopRelease(by="me"))
        world.tick(2, each=[GO])
        world.tick(1, each=[(KEYS.drive("a"), DISARM)])
        world.tick(60, each=[GO])
        assert speed(world) > 0.3

    def test_a_robot_disarmed_during_the_stop_is_armed_by_the_first_command_after_it(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(2, each=[GO])
        world.tick(5, each=[(KEYS.drive("a"), DISARM)])
        world.say(KEYS.estop_release, EstopRelease(by="me"))
        world.tick(2)
        assert speed(world) == 0.0
        world.tick(60, each=[GO])
        assert speed(world) > 0.3

    def test_arming_during_the_stop_does_not_count(self) -> None:
        world = wire()
        world.say(KEYS.estop, Estop(by="me"))
        world.tick(5, each=[GO])
        world.say(KEYS.estop_release, EstopRelease(by="me"))
        world.tick(60, each=[GO])
        assert speed(world) == 0.0


class TestReferee:
    def test_without_a_referee_robots_may_move(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        assert speed(world) > 0.3

    @pytest.mark.parametrize("held", [referee(halted="by an official"), referee(estop=True), referee(a_may=False)])
    def test_it_holds_a_robot(self, held: RefereeState) -> None:
        world = wire()
        world.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(world) > 0.3
        world.tick(5, each=[GO, (KEYS.referee_state, held)])
        assert speed(world) == 0.0
        assert state(world).armed, "it is held, not disarmed"
        world.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(world) > 0.3

    def test_a_player_that_may_not_move_does_not_hold_the_others(self) -> None:
        world = wire()
        world.tick(60, each=[GO, GO_B, (KEYS.referee_state, referee(a_may=False))])
        assert speed(world) == 0.0
        assert speed(world, "b") > 0.3

    def test_a_referee_that_is_silent_for_too_long_is_dead_and_all_stop(self) -> None:
        world = wire()
        world.tick(60, each=[GO, (KEYS.referee_state, referee())])
        ticks = round(REFEREE_TIMEOUT / world.node.period)
        world.tick(ticks - 1, each=[GO])
        assert speed(world) > 0.3
        world.tick(6, each=[GO])
        assert speed(world) == 0.0


class TestRequests:
    def request(self, world: Wire, **fields: object) -> None:
        world.say(KEYS.world_request, WorldRequest(**fields))  # type: ignore[arg-type]
        world.tick()

    def test_spawn_adds_a_robot_that_drives_and_reports(self) -> None:
        world = wire()
        world.tick(60, each=[GO])
        odometry = sensed(world, Odometry).pose.x
        self.request(world, kind=RequestKind.SPAWN, robot="c", model="ATRV-Jr", pose=Pose(5, 5, 0))
        assert world.node.world.names == ["a", "b", "c"]
        assert sensed(world, Odometry).pose.x >= odometry
        world.tick(60, each=[(KEYS.drive("c"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0))))])
        assert speed(world, "c") > 0.3
        assert LASER_C in world.heard

    def answers(self, world: Wire) -> list[WorldAnswer]:
        answer = world.heard.get(KEYS.world_answer.key)
        return [answer] if isinstance(answer, WorldAnswer) else []

    def test_a_request_with_an_id_is_answered(self) -> None:
        world = wire()
        self.request(world, kind=RequestKind.PLACE, places={"a": Pose(5, 5, 0)}, id="7")
        assert self.answers(world) == [WorldAnswer(id="7", refused=None)]

    @pytest.mark.parametrize("number", ["7", None])
    def test_a_refusal_is_always_answered(self, number: str | None) -> None:
        world = wire()
        self.request(world, kind=RequestKind.PLACE, places={"a": Pose(500, 5, 0)}, id=number)
        (answer,) = self.answers(world)
        assert answer.id == number
        assert answer.refused is not None
        assert "inside map" in answer.refused

    def test_a_granted_request_without_an_id_is_not(self) -> None:
        world = wire()
        self.request(world, kind=RequestKind.PLACE, places={"a": Pose(5, 5, 0)})
        assert self.answers(world) == []

    def test_remove_takes_one_out(self) -> None:
        world = wire()
        world.tick(10)
        self.request(world, kind=RequestKind.REMOVE, robot="a")
        assert world.node.world.names == ["b"]
        world.tick(60, each=[GO, GO_B])
        assert speed(world, "b") > 0.3

    def test_reset_puts_all_at_their_start_with_zero_odometry(self) -> None:
        world = wire(noise=False)
        world.tick(100, each=[GO, GO_B])
        self.request(world, kind=RequestKind.RESET)
        for name, y in (("a", 0.0), ("b", 3.0)):
            pose = world.node.world.pose(name)
            assert (pose.x, pose.y) == pytest.approx((0.0, y), abs=0.02)
            assert sensed(world, Odometry, name).pose.x == pytest.approx(0.0, abs=0.02)
        assert speed(world) <= 0.03

    def test_reset_may_be_for_one(self) -> None:
        world = wire()
        world.tick(100, each=[GO, GO_B])
        self.request(world, kind=RequestKind.RESET, robot="b")
        assert x_of(world) > 0.4
        assert x_of(world, "b") == pytest.approx(0.0, abs=0.02)

    def test_place_moves_one(self) -> None:
        world = wire()
        world.tick()
        self.request(world, kind=RequestKind.PLACE, places={"a": Pose(4, 4, 1)})
        assert world.node.world.pose("a") == Pose(4, 4, 1)

    def test_two_robots_change_places_at_once(self) -> None:
        world = wire()
        world.tick()
        here, there = world.node.world.pose("a"), world.node.world.pose("b")
        self.request(world, kind=RequestKind.PLACE, places={"a": there, "b": here})
        assert (world.node.world.pose("a"), world.node.world.pose("b")) == (there, here)

    def test_as_many_are_placed_as_there_is_room_for_and_the_others_are_named(self) -> None:
        world = Wire(config(("a", 2.0, 2.0, 0.0), ("b", 4.0, 2.0, 0.0), ("c", 6.0, 2.0, 0.0), ("d", 8.0, 2.0, 0.0)))
        world.tick()
        # a cannot leave, so b cannot come to its place, and c cannot come to b's.
        places = {"a": Pose(500, 0, 0), "b": Pose(2, 2, 0), "c": Pose(4, 2, 0), "d": Pose(8, 5, 1)}
        self.request(world, kind=RequestKind.PLACE, places=places)
        (answer,) = self.answers(world)
        assert "robot a: " in (answer.refused or "")
        assert "place b: expected room, but it would overlap a" in (answer.refused or "")
        assert "place c: expected room, but it would overlap b" in (answer.refused or "")
        poses = {name: world.node.world.pose(name) for name in "abcd"}
        assert [poses[name].x for name in "abc"] == [2.0, 4.0, 6.0]
        assert poses["d"] == Pose(8, 5, 1)

    @pytest.mark.parametrize(
        ("fields", "why"),
        [
            ({"kind": RequestKind.REMOVE, "robot": "ghost"}, "ghost"),
            ({"kind": RequestKind.RESET, "robot": "ghost"}, "ghost"),
            ({"kind": RequestKind.PLACE}, "expected places"),
            ({"kind": RequestKind.PLACE, "places": {"ghost": Pose(5, -20, 0)}}, "ghost"),
            ({"kind": RequestKind.PLACE, "places": {"a": Pose(-12, -22, 0)}}, "wall or obstacle"),
            ({"kind": RequestKind.PLACE, "places": {"a": Pose(500, 0, 0)}}, "inside map"),
            ({"kind": RequestKind.PLACE, "places": {"a": Pose(20.0, -16.9, 0)}}, "overlap b"),
            ({"kind": RequestKind.SPAWN, "robot": "c", "pose": Pose(5, -20, 0)}, "expected a model"),
            ({"kind": RequestKind.SPAWN, "robot": "c", "model": "x", "pose": Pose(5, -20, 0)}, "P2AT"),
            ({"kind": RequestKind.SPAWN, "robot": "b", "model": "P2AT", "pose": Pose(5, -20, 0)}, "not in the world"),
        ],
    )
    def test_an_impossible_request_is_logged_and_changes_nothing(
        self, fields: dict[str, object], why: str, caplog: pytest.LogCaptureFixture
    ) -> None:
        world = Wire(config(("a", 20.0, -20.0, 0.0), ("b", 20.0, -17.0, 0.0), map="courtyard"))
        world.tick()
        before = world.node.snapshot()
        with caplog.at_level(logging.WARNING):
            self.request(world, **fields)
        assert why in caplog.text
        assert world.node.world.snapshot().robots == restored(world, before).world.snapshot().robots


def restored(world: Wire, snapshot: bytes) -> WorldNode:
    """A world of the same set-up, restored from a snapshot."""
    node = WorldNode(world.node.world.config, Mailbox(), KEYS)
    node.restore(snapshot)
    return node


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


class TestSnapshot:
    @pytest.mark.parametrize("engine", ["planar", "pybullet"])
    def test_a_restored_world_goes_on_where_the_snapshot_was_taken(self, engine: str) -> None:
        old = wire(engine=engine, noise=False)
        old.tick(1)
        old.say(KEYS.speed_limit("a"), SpeedLimit(v_max=0.4))
        old.tick(100, each=[GO, (KEYS.drive("b"), Drive(twist=P2AT.drivetrain.twist((1.0, 2.0))))])
        kept = old.node.snapshot()
        node = WorldNode(old.node.world.config, Mailbox(), KEYS)
        node.restore(kept)
        assert node.start_tick == 100
        new = Wire(config(), node=node)
        new.tick()
        clock = new.heard[KEYS.clock.key]
        assert isinstance(clock, Clock)
        assert (clock.tick, clock.epoch) == (100, 1)
        assert clock.time == pytest.approx(2.0)
        for name in "ab":
            after = state(new, name)
            for kind in (Odometry, Encoders, Battery):
                assert last_of(old, kind, name) == last_of(new, kind, name)
            assert old.node.world.pose(name) == new.node.world.pose(name)
            assert speed(new, name) == 0.0, "at rest"
            assert not after.armed
        new.tick(60, each=[(KEYS.drive("a"), Drive(twist=P2AT.drivetrain.twist((6.0, 6.0))))])
        assert speed(new) == pytest.approx(0.4, abs=0.01), "limits are kept"
        old.node.stop()
        new.node.stop()

    def test_a_restored_world_steps_from_its_second_tick(self) -> None:
        old = wire()
        old.tick(10)
        node = WorldNode(old.node.world.config, Mailbox(), KEYS)
        node.restore(old.node.snapshot())
        new = Wire(config(), node=node)
        new.tick(2)
        assert new.heard[KEYS.clock.key].tick == 10  # type: ignore[attr-defined]

    def test_the_emergency_stop_survives_a_restart(self) -> None:
        old = wire()
        old.tick(60, each=[GO])
        old.say(KEYS.estop, Estop(by="me"))
        old.tick(5, each=[GO])
        node = WorldNode(old.node.world.config, Mailbox(), KEYS)
        node.restore(old.node.snapshot())
        new = Wire(config(), node=node)
        new.tick(10, each=[GO])
        assert state(new).estop
        new.say(KEYS.estop_release, EstopRelease(by="me"))
        new.tick(60, each=[GO])
        assert speed(new) == 0.0, "it must still be disarmed and armed"

    def test_noise_goes_on_after_a_restart(self) -> None:
        whole = wire(seed=3)
        whole.tick(400)
        old = wire(seed=3)
        old.tick(200)
        node = WorldNode(old.node.world.config, Mailbox(), KEYS)
        node.restore(old.node.snapshot())
        new = Wire(config(), node=node)
        new.tick(201)
        assert sensed(new, Ins) == sensed(whole, Ins)

    def test_the_snapshot_of_another_set_up_is_refused(self) -> None:
        node = WorldNode(config(("z", 0.0, 0.0, 0.0)), Mailbox(), KEYS)
        with pytest.raises(WorldError, match="choose another run folder"):
            node.restore(wire().node.snapshot())

    def test_a_restored_world_that_had_a_referee_waits_for_it(self) -> None:
        old = wire()
        old.say(KEYS.referee_state, referee())
        old.tick(20, each=[GO])
        node = WorldNode(old.node.world.config, Mailbox(), KEYS)
        node.restore(old.node.snapshot())
        new = Wire(config(), node=node)
        new.tick(60, each=[GO])
        assert speed(new) == 0.0
        new.tick(60, each=[GO, (KEYS.referee_state, referee())])
        assert speed(new) > 0.3

    def test_damaged_bytes_are_refused(self) -> None:
        node = WorldNode(config(), Mailbox(), KEYS)
        with pytest.raises(WorldError, match="snapshot"):
            node.restore(b"\x00garbage")
        good = wire().node.snapshot()
        with pytest.raises(WorldError, match="snapshot"):
            node.restore(good[: len(good) // 2])


class TestSetup:
    def test_a_good_set_up_has_no_problems(self) -> None:
        assert check_setup(config(("a", 20, -20, 0), ("b", 20, -18, 0), map="courtyard", engine="pybullet")) == []

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

    def test_an_unknown_map_and_model_are_problems_not_exceptions(self) -> None:
        problems = check_setup(config(("a", 0, 0, 0), map="atlantis", model="tricycle"))
        assert len(problems) == 2

    def test_a_world_with_problems_is_not_built(self) -> None:
        with pytest.raises(ConfigError, match="a and b"):
            WorldNode(config(("a", 0, 0, 0), ("b", 0.1, 0, 0)), Mailbox(), KEYS)


def mixed(**options: object) -> Wire:
    """Virtual `a` and physical `g`, 3 m ahead of it."""
    return Wire(config(("a", 0.0, 0.0, 0.0), ("g", 3.0, 0.0, 0.0), physical="g", noise=False, **options))


def body(wire: Wire, name: str = "g") -> Body:
    poses = wire.heard[KEYS.poses.key]
    assert isinstance(poses, Poses)
    return next(body for body in poses.bodies if body.name == name)


def measure(wire: Wire, x: float, y: float = 0.0, v: float = 0.0, w: float = 0.0, name: str = "g") -> None:
    wire.say(KEYS.robot_pose(name), MeasuredPose(pose=Pose(x, y, 0.0), twist=Twist(v, w)))


class TestPhysicalRobots:
    def test_before_the_first_measurement_it_stands_at_its_start_and_its_age_is_counted(self) -> None:
        world = mixed()
        world.tick(26)
        assert body(world) == Body("g", Pose(3.0, 0.0, 0.0), STILL, True, pytest.approx(0.5))
        assert body(world, "a").age == 0.0
        assert not body(world, "a").physical

    def test_a_physical_robots_device_is_told_where_the_world_has_it(self) -> None:
        world = mixed()
        world.tick(2)
        seen = world.heard[KEYS.robot_seen("g").key]
        assert isinstance(seen, MeasuredPose)
        assert seen.pose == Pose(3.0, 0.0, 0.0)
        assert KEYS.robot_seen("a").key not in world.heard, "a virtual robot's device needs no such thing"

    def test_it_is_where_it_was_measured_and_goes_on_for_a_while(self) -> None:
        world = mixed()
        world.tick(2)
        measure(world, 5.0, 1.0, v=0.5)
        world.tick(6)
        now = body(world)
        assert now.age == pytest.approx(0.1)
        assert (now.pose.x, now.pose.y, now.twist.v) == pytest.approx((5.0 + 0.5 * 0.1, 1.0, 0.5))
        world.tick(20)
        now = body(world)
        assert now.age == pytest.approx(0.5)
        assert now.pose.x == pytest.approx(5.0 + 0.5 * EXTRAPOLATE), "nobody knows where it went"
        assert (now.twist.v, now.twist.w) == (0.0, 0.0)

    def test_a_late_measurement_does_not_set_it_back(self) -> None:
        world = mixed()
        world.tick(10)
        measure(world, 5.0)
        world.tick()
        world.node.world.measure("g", MeasuredPose(pose=Pose(4.0, 0.0, 0.0)), world.node.world.time - 0.1)
        world.tick()
        assert body(world).pose.x == 5.0

    def test_poses_that_cannot_be_are_told_once_and_ignored(self, caplog: pytest.LogCaptureFixture) -> None:
        world = mixed()
        world.tick(5)
        for name, why in (("a", "pose of a: expected one of the physical robots (g)"), ("x", "pose of x: ")):
            for _ in range(10):
                measure(world, 9.0, name=name)
                world.tick()
            assert caplog.text.count(why) == 1
        with pytest.raises(WorldError, match="pose of g: expected a pose of now"):
            world.node.world.measure("g", MeasuredPose(pose=Pose(9.0, 0.0, 0.0)), world.node.world.time + 0.3)
        world.tick(10)
        assert body(world).pose.x == 3.0
        assert body(world, "a").pose.x == 0.0
        caplog.clear()
        for n in range(300):
            measure(world, 9.0, name=f"x{n}")
        world.tick()
        assert len(caplog.records) < 101

    def test_it_has_no_simulated_state_and_takes_no_commands(self) -> None:
        world = mixed()
        world.tick(20, each=[GO, (KEYS.drive("g"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0))))])
        assert KEYS.robot_state("g").key not in world.heard
        assert state(world).armed
        assert body(world).pose.x == 3.0
        assert body(world, "a").pose.x > 0.0

    def test_it_is_scanned_and_has_scans(self) -> None:
        world = mixed()
        world.tick(2)
        measure(world, 2.0)
        world.tick(10)
        seen, sees = world.heard[LASER_A], world.heard[LASER_G]
        assert isinstance(seen, Laser)
        assert isinstance(sees, Laser)
        model = P2AT
        assert model.sensor(LaserSpec) is not None
        assert seen.ranges[90] == pytest.approx(2.0 - model.length / 2 - model.sensor(LaserSpec).x, abs=0.001)
        assert sees.ranges.min() == sees.range_max, "a is behind it"
        world.say(KEYS.world_request, WorldRequest(kind=RequestKind.PLACE, places={"a": Pose(4.0, 0.0, 0.0)}))
        world.tick(10)
        sees = world.heard[LASER_G]
        assert isinstance(sees, Laser)
        assert sees.ranges[90] == pytest.approx(2.0 - model.length / 2 - model.sensor(LaserSpec).x, abs=0.001)

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

    @pytest.mark.parametrize("engine", ["planar", "pybullet"])
    def test_a_virtual_robot_bumps_into_it_and_is_pushed(self, engine: str) -> None:
        world = mixed(engine=engine)
        world.tick(2)
        measure(world, 0.8)
        world.tick(100, each=[GO])
        assert sensed(world, Touch).pressed[0]
        assert x_of(world) == pytest.approx(0.8 - P2AT.length, abs=0.02)
        for n in range(20):
            measure(world, 0.8 - 0.05 * n, v=-0.5)
            world.tick(5)
        assert x_of(world) < -0.6

    @pytest.mark.parametrize(
        ("fields", "why"),
        [
            ({"kind": RequestKind.PLACE, "places": {"g": Pose(5, 5, 0)}}, "g is physical: carry"),
            ({"kind": RequestKind.RESET, "robot": "g"}, "g is physical: carry"),
            ({"kind": RequestKind.PLACE, "places": {"a": Pose(3.2, 0, 0)}}, "overlap g, a physical robot"),
            ({"kind": RequestKind.SPAWN, "robot": "b", "model": "P2AT", "pose": Pose(3.2, 0, 0)}, "overlap g"),
            ({"kind": RequestKind.SPAWN, "robot": "g", "model": "P2AT", "pose": Pose(5, 5, 0)}, "not in the world"),
        ],
    )
    def test_only_people_move_it(self, fields: dict[str, object], why: str) -> None:
        world = mixed()
        world.tick()
        before = world.node.snapshot()
        with pytest.raises(WorldError, match=why):
            grant(world.node.world, WorldRequest(**fields))  # type: ignore[arg-type]
        assert world.node.snapshot() == before

    def test_a_reset_of_all_is_one_of_the_virtual_ones(self) -> None:
        world = mixed()
        world.tick(2)
        measure(world, 5.0)
        world.tick(60, each=[GO])
        assert x_of(world) > 0.1
        world.say(KEYS.world_request, WorldRequest(kind=RequestKind.RESET))
        world.tick()
        assert x_of(world) == pytest.approx(0.0, abs=0.02)
        assert x_of(world, "g") == 5.0

    @pytest.mark.parametrize("gone", ["a", "g"])
    def test_robots_come_and_go_beside_it(self, gone: str) -> None:
        world = Wire(config(("v", 0, 5, 0), ("g", 3, 0, 0), ("a", 0, 0, 0), physical="g", noise=False))
        world.tick(2)
        world.say(KEYS.world_request, WorldRequest(kind=RequestKind.REMOVE, robot=gone))
        spawn = WorldRequest(kind=RequestKind.SPAWN, robot="b", model="P2AT", pose=Pose(5, 5, 0))
        world.say(KEYS.world_request, spawn)
        world.heard.clear()
        world.tick(60, each=[(KEYS.drive("b"), Drive(twist=P2AT.drivetrain.twist((3.0, 3.0))))])
        assert world.node.world.names == [n for n in ("v", "g", "a", "b") if n != gone]
        states = {key.split("/")[3] for key in world.heard if key.endswith("/state")}
        assert states == {"v", "a", "b"} - {gone}
        assert sensed(world, Odometry, "b").twist.v == pytest.approx(0.33, abs=0.02)
        assert sensed(world, Odometry, "b").pose.x > 0.1
        assert sensed(world, Odometry, "v").pose.x == 0.0

    def test_a_restored_world_has_it_where_it_was_and_counts_its_age_anew(self) -> None:
        old = mixed()
        old.tick(2)
        measure(old, 5.0, 1.0)
        old.tick(20, each=[GO])
        node = restored(old, old.node.snapshot())
        new = Wire(config(), node=node)
        new.tick(2)
        since = pytest.approx(node.world.time - 0.02)
        assert body(new) == Body("g", Pose(5.0, 1.0, 0.0), STILL, True, pytest.approx(0.02), since)
        assert node.world.virtual == ["a"]
        assert node.world.pose("a") == old.node.world.pose("a")
        measure(new, 6.0)
        new.tick()
        assert body(new).pose.x == 6.0

    def test_a_match_with_and_one_without_it_are_two_set_ups(self) -> None:
        virtual = Wire(config(("a", 0.0, 0.0, 0.0), ("g", 3.0, 0.0, 0.0), noise=False))
        with pytest.raises(WorldError, match="choose another run folder"):
            restored(virtual, mixed().node.snapshot())

    def test_its_start_must_be_free_like_any_other(self) -> None:
        problems = check_setup(config(("a", 20, -20, 0), ("g", 20.2, -20, 0), physical="g", map="courtyard"))
        assert [str(p) for p in problems] == ["players.a: expected room between a and g, but they overlap"]
