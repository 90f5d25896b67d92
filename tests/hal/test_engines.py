"""What all engines promise."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import astuple

from tests.hal.engine_bench import (
    ENGINE_NAMES,
    ON_WHEELS,
    body_of,
    carry,
    deepest_overlap,
    drive,
    footprint,
    forward,
    run,
)
from vrg.errors import ConfigError, WorldError
from vrg.geometry import along_arc
from vrg.hal.models import robot_model
from vrg.hal.models.drivetrain import Wheel, skid_steer
from vrg.hal.sim import engines
from vrg.hal.sim.engines import BULLET, ENGINES, MUJOCO, PLANAR, check_installed, default_engine, installed
from vrg.hal.sim.engines.engine import Engine, Floats, Start
from vrg.hal.sim.map import load_map
from vrg.hal.sim.shapes import box_gap
from vrg.testing.omni import OMNI
from vrg.types import STILL, Pose, Twist

P2AT = robot_model("P2AT")
Make = Callable[..., Engine]


@pytest.fixture(params=ENGINE_NAMES)
def make(request: pytest.FixtureRequest) -> Iterator[Make]:
    """A builder of engines with P2ATs by their names and poses, of which g and h are kinematic, and other robots."""
    made: list[Engine] = []

    def build(map_name: str = "open", *robots: Start, **poses: tuple[float, float, float]) -> Engine:
        starts = [Start(name, P2AT, Pose(*pose), kinematic=name in "gh") for name, pose in poses.items()]
        made.append(ENGINES.get(request.param)(load_map(map_name), [*starts, *robots]))
        return made[-1]

    yield build
    for engine in made:
        engine.close()


def test_without_the_package_of_an_engine_a_match_has_another_one_or_names_what_is_missing(monkeypatch) -> None:
    assert default_engine() == (BULLET if installed(BULLET) else MUJOCO)
    monkeypatch.setattr(engines, "find_spec", lambda package: None if package == "pybullet" else package)
    assert default_engine() == MUJOCO
    monkeypatch.setattr(engines, "find_spec", lambda package: None)
    assert default_engine() == PLANAR
    check_installed(PLANAR)
    with pytest.raises(
        ConfigError, match=r"engine pybullet: the package of that name is not installed.*--engine planar"
    ):
        check_installed(BULLET)


def test_robots_are_known_by_name(make: Make) -> None:
    run(make(), 0.1)
    engine = make(a=(0, 0, 0), b=(3, 0, 4.0))
    assert body_of(engine, "b").pose.theta == pytest.approx(4.0 - 2 * math.pi)
    with pytest.raises(WorldError, match=r"\(a, b\).*'c'"):
        engine.command("c", STILL)
    assert engine.names == ["a", "b"]
    drive(engine, "b", 0.5, seconds=1.0)
    assert body_of(engine, "b").twist.v == pytest.approx(0.5, rel=0.02)
    with pytest.raises(WorldError):
        engine.row("c")


def test_straight_is_straight_and_acceleration_is_the_models(make: Make) -> None:
    heading = 0.7
    engine = make(a=(0, 0, heading))
    drive(engine, "a", 0.7, seconds=0.4)
    assert body_of(engine, "a").twist.v == pytest.approx(0.4 * P2AT.a_max, rel=0.15)
    run(engine, 1.0)
    assert body_of(engine, "a").twist.v == pytest.approx(0.7, rel=0.02)
    run(engine, 6.6)
    x, y, theta = engine.poses[0]
    assert x * math.cos(heading) + y * math.sin(heading) > 5.0
    assert abs(y * math.cos(heading) - x * math.sin(heading)) < 0.02
    assert theta == pytest.approx(heading, abs=0.01)


@pytest.mark.parametrize("name", ON_WHEELS)
@pytest.mark.parametrize(("v", "w"), [(0, 0.3), (0, -1.0), (0, 2.0), (0.3, 0.5), (0.5, -0.5), (0.3, 1.0)])
def test_the_turn_rate_is_what_the_effective_track_predicts(make: Make, name: str, v: float, w: float) -> None:
    engine = make("open", Start("a", robot_model(name), Pose(0, 0, 0.2)))
    drive(engine, "a", v, w, seconds=3.0)
    rates, speeds = [], []
    for _ in range(50):
        run(engine, 0.02)
        speeds.append(engine.velocities[0, 0])
        rates.append(engine.velocities[0, 1])
    assert np.mean(rates) == pytest.approx(w, rel=0.05)
    assert np.std(rates) < 0.05 * abs(w)
    assert np.mean(speeds) == pytest.approx(v, abs=0.02)


@pytest.mark.parametrize("name", ON_WHEELS)
def test_the_stored_effective_track_is_what_the_engine_measures(make: Make, name: str) -> None:
    drivetrain = robot_model(name).drivetrain
    engine = make("open", Start("a", robot_model(name), Pose(0, 0, 0)))
    engine.command("a", drivetrain.twist((-3.0, 3.0)))
    run(engine, 3.0)
    measured = 6.0 * drivetrain.wheel_radius / body_of(engine, "a").twist.w
    assert drivetrain.effective_track == pytest.approx(measured, rel=0.01)
    wheel = drivetrain.wheels[0]
    assert drivetrain.effective_track == pytest.approx(2 * (wheel.y + wheel.x**2 / wheel.y), rel=0.01)


def test_one_with_more_axes_far_away_changes_nothing_for_the_others(make: Make) -> None:
    def driven(*guests: str) -> Floats:
        others = [Start(guest, OMNI, Pose(9, 9 + 2 * n, 0)) for n, guest in enumerate(guests)]
        engine = make("open", *others, a=(0, 0, 0), b=(0.51, 0.1, 0.2))
        forward(engine, "b", -0.1, 0.2)
        drive(engine, "a", 0.5, 0.2, seconds=2.0)
        return engine.poses[:2]

    assert driven("c", "d") == pytest.approx(driven(), abs=1e-6)


def test_locked_wheels_stop_it_within_the_models_brake(make: Make) -> None:
    engine = make(a=(0, 0, 0))
    drive(engine, "a", P2AT.v_max, seconds=2.0)
    at = engine.poses[0, 0]
    engine.command("a", None)
    run(engine, 0.1)
    assert abs(body_of(engine, "a").twist.v) < 0.03
    run(engine, 1.0)
    assert engine.poses[0, 0] - at < 1.5 * P2AT.v_max**2 / 2 / P2AT.brake + 0.01


def test_at_rest_it_stays(make: Make) -> None:
    engine = make(a=(1, 2, 0.5))
    run(engine, 0.5)
    before = engine.poses[0].copy()
    run(engine, 10.0)
    assert np.abs(engine.poses[0] - before).max() < 1e-3


def test_one_with_its_wheels_at_its_corners_comes_to_rest(make: Make) -> None:
    drivetrain = skid_steer(wheel_radius=0.11, wheel_width=0.08, wheelbase=0.49, track=0.48, effective_track=0.98)
    engine = make("open", Start("a", replace(P2AT, drivetrain=drivetrain), Pose(0, 0, 0.3)))
    drive(engine, "a", 0.5, 0.4, seconds=2.0)
    engine.command("a", None)
    run(engine, 0.5)
    for _ in range(20):
        run(engine, 0.02)
        assert abs(body_of(engine, "a").twist.w) < 1e-3


def test_two_engines_do_not_meet(make: Make) -> None:
    a, b = make(a=(0, 0, 0)), make(b=(0.4, 0, 0))
    drive(a, "a", 0.5, seconds=2.0)
    run(b, 0.1)
    assert body_of(a, "a").pose.x > 0.7
    assert body_of(b, "b").pose.x == pytest.approx(0.4, abs=1e-3)


def test_the_heading_stays_within_half_a_turn(make: Make) -> None:
    engine = make(a=(0, 0, 3.1))
    forward(engine, "a", 0.0, 1.5)
    for _ in range(100):
        run(engine, 0.1)
        assert abs(engine.poses[0, 2]) <= math.pi + 1e-9


def test_a_wall_stops_it_and_presses_the_front_bumper_and_it_can_drive_and_turn_away(make: Make) -> None:
    engine = make("marhes_lab", a=(-3.5, -1.0, math.pi))
    drive(engine, "a", 0.7, seconds=3.0)
    state = body_of(engine, "a")
    assert state.pose.x == pytest.approx(-4.4 + P2AT.length / 2, abs=0.02)
    assert state.touch[0]
    assert not state.touch[4]
    drive(engine, "a", -0.5, seconds=2.0)
    assert not any(body_of(engine, "a").touch)
    assert body_of(engine, "a").pose.x > -4.0
    for v, w, seconds in ((0.7, 0.0, 3.0), (0.0, 1.0, 4.0), (0.5, 0.0, 2.0)):
        drive(engine, "a", v, w, seconds=seconds)
    assert body_of(engine, "a").pose.x > -3.9
    assert deepest_overlap(engine) < 0.005


def test_nothing_is_tunnelled_at_2_m_per_s(make: Make) -> None:
    fast = replace(P2AT, name="fast", v_max=2.0, a_max=8.0)
    engine = make("marhes_lab", Start("a", fast, Pose(0.0, -1.0, 0.3)), Start("b", fast, Pose(-2.0, -1.5, 0.0)))
    for turn in range(40):
        for row, name in enumerate(engine.names):
            forward(engine, name, 2.0 if (turn + row) % 5 else -2.0, (-1) ** turn * 1.3)
        run(engine, 0.4)
        assert np.abs(engine.poses[:, 0]).max() < 4.5
        assert np.abs(engine.poses[:, 1]).max() < 3.0
        assert deepest_overlap(engine) < 0.02


def test_robots_block_each_other(make: Make) -> None:
    engine = make(a=(-1, 0, 0), b=(1, 0, math.pi))
    for name in engine.names:
        forward(engine, name, 0.5)
    run(engine, 4.0)
    a, b = body_of(engine, "a"), body_of(engine, "b")
    assert b.pose.x - a.pose.x == pytest.approx(P2AT.length, abs=0.02)
    assert a.pose.x + b.pose.x == pytest.approx(0.0, abs=0.02), "neither is favoured"
    assert a.touch[0]
    assert b.touch[0]


def test_a_moving_robot_loses_the_contact_of_one_that_stands(make: Make) -> None:
    engine = make(a=(0, 0, 0), b=(1, 0, 0))
    drive(engine, "a", 0.5, seconds=2.0)
    assert body_of(engine, "b").touch[4], "hit from behind"
    drive(engine, "a", -0.5, seconds=1.0)
    assert not any(body_of(engine, "b").touch)


def test_a_placed_robot_is_there_and_at_rest_and_one_may_begin_with_its_wheels_turned(make: Make) -> None:
    engine = make(a=(0, 0, 0))
    drive(engine, "a", 0.7, seconds=1.0)
    engine.command("a", None)
    engine.place("a", Pose(5, 5, 1.0))
    run(engine, 0.2)
    assert body_of(engine, "a").pose.x == pytest.approx(5.0, abs=0.001)
    assert body_of(engine, "a").pose.theta == pytest.approx(1.0, abs=0.001)
    engine = make("open", Start("a", P2AT, Pose(2, 3, 0.5), angles=(10.0, 20.0)))
    run(engine, 0.1)
    assert body_of(engine, "a").angles == (10.0, 20.0)
    assert astuple(body_of(engine, "a").pose) == pytest.approx((2.0, 3.0, 0.5, 0.0), abs=0.001)


def test_the_same_commands_give_the_same_poses_bit_for_bit(make: Make) -> None:
    def play() -> bytes:
        engine = make("marhes_lab", **{f"r{n}": (-1.5 + n, -0.5 * (n % 2), n * 1.0) for n in range(4)})
        rng = np.random.default_rng(5)
        trace = b""
        for _ in range(40):
            for name in engine.names:
                engine.command(name, None if rng.random() < 0.1 else Twist(*rng.uniform(-0.6, 0.6, 2)))
            run(engine, 0.2)
            trace += engine.poses.tobytes()
        return trace

    assert play() == play()


def test_a_scrum_leaves_no_overlap(make: Make) -> None:
    engine = make("courtyard", **{f"r{n}": (19.5 + (n % 4), -22 + n // 4, n * 0.8) for n in range(8)})
    for _ in range(60):
        for row, name in enumerate(engine.names):
            x, y, theta = engine.poses[row]
            bearing = math.remainder(math.atan2(-21.5 - y, 21 - x) - theta, 2 * math.pi)
            forward(engine, name, 0.6, bearing)
        run(engine, 0.2)
        assert deepest_overlap(engine) < 0.02
        if type(engine).__name__ == "PlanarEngine":
            assert deepest_overlap(engine) == 0.0
    assert sum(any(body_of(engine, n).touch) for n in engine.names) >= 4


def gap(engine: Engine, first: str, second: str) -> float:
    """m between two bodies; negative where they overlap."""
    return box_gap(*(footprint(engine, engine.row(name)) for name in (first, second))).distance


class TestKinematicBodies:
    def test_one_is_where_it_is_put_also_in_a_wall_and_outside_the_map(self, make: Make) -> None:
        engine = make("marhes_lab", g=(-4.4, 0, 0), a=(0, -1, 0))
        for pose in (Pose(-4.4, 0, 0), Pose(-4.3, 0.1, 1.0), Pose(50.0, 50.0, -3.0), Pose(-9e4, 9e4, 2.0)):
            engine.move("g", pose, Twist(0.5, -0.2))
            run(engine, 0.1)
            state = body_of(engine, "g")
            assert (state.pose, state.twist, state.angles) == (pose, Twist(0.5, -0.2), (0.0, 0.0))
            assert not any(state.touch), "walls are no contact of a kinematic body"
        assert np.abs(engine.poses[1] - (0, -1, 0)).max() < 1e-3

    def test_it_takes_no_commands_and_the_others_are_not_carried(self, make: Make) -> None:
        engine = make(g=(0, 0, 0), a=(3, 0, 0))
        with pytest.raises(WorldError, match=r"command g: .*kinematic"):
            engine.command("g", Twist(0.1, 0.0))
        with pytest.raises(WorldError, match=r"move a: .*kinematic"):
            engine.move("a", Pose(0, 0, 0), STILL)
        with pytest.raises(WorldError, match="'b'"):
            engine.move("b", Pose(0, 0, 0), STILL)

    def test_a_robot_that_drives_at_one_stops_and_both_feel_it(self, make: Make) -> None:
        engine = make(g=(1.5, 0, 0), a=(0, 0, 0))
        drive(engine, "a", 0.7, seconds=4.0)
        assert body_of(engine, "a").pose.x == pytest.approx(1.0, abs=0.02)
        assert body_of(engine, "g").pose == Pose(1.5, 0, 0)
        assert body_of(engine, "a").touch[0]
        assert body_of(engine, "g").touch[4], "hit from behind"
        drive(engine, "a", -0.5, seconds=1.0)
        assert not any(body_of(engine, "a").touch + body_of(engine, "g").touch)

    def test_one_that_drives_into_a_resting_robot_pushes_it_before_it(self, make: Make) -> None:
        engine = make(g=(0, 0, 0), a=(1.0, 0, 0))
        carry(engine, "g", 0.7, 3.0)
        assert body_of(engine, "g").pose.x == pytest.approx(2.1)
        assert body_of(engine, "a").pose.x == pytest.approx(2.1 + P2AT.length, abs=0.02)
        assert body_of(engine, "a").touch[4]
        assert body_of(engine, "g").touch[0]
        run(engine, 0.5)
        assert body_of(engine, "a").pose.x < 2.7, "it is not flung away"
        assert gap(engine, "g", "a") > -0.01

    def test_two_that_meet_pass_through_each_other(self, make: Make) -> None:
        engine = make(g=(-1, 0, 0), h=(0, 0, 0))
        carry(engine, "g", 0.5, 2.0)
        assert body_of(engine, "g").pose.x == pytest.approx(0.0)
        assert body_of(engine, "h").pose == Pose(0, 0, 0)
        assert not any(body_of(engine, "g").touch + body_of(engine, "h").touch)

    @pytest.mark.parametrize(("heading", "y"), [(math.pi, -1.0), (2.8, -1.0), (math.pi, -1.2)])
    @pytest.mark.parametrize("between", [1, 2])
    def test_no_robot_is_pushed_through_a_wall(self, make: Make, heading: float, y: float, between: int) -> None:
        caught = {f"a{n}": (-3.9 + 0.6 * n, -1.0, 0.3) for n in range(between)}
        engine = make("marhes_lab", **caught, g=(-1.5, y, heading))
        deepest = 0.0
        for _ in range(250):
            carry(engine, "g", 0.7, 0.02)
            deepest = max(deepest, deepest_overlap(engine))
        assert deepest < 0.06
        if type(engine).__name__ == "PlanarEngine":
            assert deepest == 0.0
        for n in range(between):
            assert -4.4 < body_of(engine, f"a{n}").pose.x < -2.0
            assert abs(body_of(engine, f"a{n}").pose.y) < 3.0
        carry(engine, "g", -0.7, 4.0)
        run(engine, 1.0)
        assert deepest_overlap(engine) < 0.01
        for n in range(between):
            forward(engine, f"a{n}", 0.5)
        run(engine, 2.0)
        assert body_of(engine, "a0").pose.x > -3.6, "it drives on"

    def test_one_that_appears_right_upon_a_robot_eases_it_out(self, make: Make) -> None:
        engine = make(a=(0, 0, 0), g=(9, 9, 0))
        for x, y, theta in ((0.1, 0.05, 0.4), (0.0, 0.0, 0.0)):
            engine.place("a", Pose(0, 0, 0))
            engine.move("g", Pose(x, y, theta), STILL)
            for _ in range(100):
                run(engine, 0.02)
                assert abs(body_of(engine, "a").twist.v) < 1.0
                assert math.hypot(*engine.poses[0, :2]) < 1.2
            assert gap(engine, "a", "g") > -0.01
            assert body_of(engine, "g").pose == Pose(x, y, theta)

    def test_one_may_be_carried_away_and_come_again(self, make: Make) -> None:
        engine = make(g=(1.0, 0, 0), a=(0, 0, 0))
        drive(engine, "a", 0.5, seconds=2.0)
        assert any(body_of(engine, "a").touch)
        engine.move("g", Pose(9, 9, 0), STILL)
        run(engine, 1.0)
        assert body_of(engine, "a").pose.x > 0.8
        assert not any(body_of(engine, "a").touch)
        engine.move("g", Pose(3.0, 0, 0), STILL)
        run(engine, 5.0)
        assert body_of(engine, "a").pose.x == pytest.approx(2.5, abs=0.02)

    def test_one_that_is_placed_stands_there(self, make: Make) -> None:
        engine = make(g=(0, 0, 0))
        engine.move("g", Pose(0, 0, 0), Twist(0.5, 0.1))
        engine.place("g", Pose(2, 3, 0.5))
        run(engine, 0.5)
        assert body_of(engine, "g").pose == Pose(2, 3, 0.5)
        assert body_of(engine, "g").twist == STILL

    def test_robots_out_of_its_reach_move_as_without_it(self, make: Make) -> None:
        def driven(*others: Pose) -> bytes:
            far = [Start(f"g{n}", P2AT, pose, kinematic=True) for n, pose in enumerate(others)]
            engine = make("open", *far, a=(0, 0, 0))
            drive(engine, "a", 0.5, 0.2, seconds=2.0)
            return engine.poses[0].tobytes()

        assert driven() == driven(Pose(5, 5, 0), Pose(-3, 1, 2))


def test_a_castor_takes_no_brake_away(make: Make) -> None:
    ways = []
    for castors in ((), (Wheel(x=0.0, y=0.0),)):
        drivetrain = replace(P2AT.drivetrain, wheels=(*P2AT.drivetrain.wheels, *castors))
        engine = make("open", Start("a", replace(P2AT, drivetrain=drivetrain), Pose(0.0, 0.0, 0.0)))
        drive(engine, "a", 0.6, seconds=2.0)
        before = body_of(engine, "a").pose.x
        engine.command("a", None)
        run(engine, 1.0)
        ways.append(body_of(engine, "a").pose.x - before)
    assert ways[0] == pytest.approx(ways[1], rel=0.02)


class TestOmniWheels:
    @pytest.mark.parametrize("twist", [Twist(0.0, 0.0, 0.5), Twist(0.3, 0.0, -0.4), Twist(0.0, 1.0), Twist(0.5, 0.0)])
    def test_it_moves_as_it_is_told_beside_a_robot_with_fewer_axes(self, make: Make, twist: Twist) -> None:
        engine = make("open", Start("a", OMNI, Pose(0.0, 0.0, 0.4)), b=(5.0, 5.0, 0.0))
        engine.command("a", twist)
        drive(engine, "b", 0.4, seconds=2.0)
        start = body_of(engine, "a").pose
        run(engine, 1.0)
        state = body_of(engine, "a")
        assert astuple(state.twist) == pytest.approx(astuple(twist), abs=0.03)
        there = along_arc(start, twist, 1.0)
        assert math.dist((state.pose.x, state.pose.y), (there.x, there.y)) < 0.03
        assert len(state.angles) == 3
        assert body_of(engine, "b").twist.v == pytest.approx(0.4, rel=0.02)
        engine.command("a", None)
        run(engine, 1.0)
        assert astuple(body_of(engine, "a").twist) == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=0.02)

    def test_a_wall_beside_it_stops_it(self, make: Make) -> None:
        wall = max(box.y for box in load_map("marhes_lab").boxes)
        engine = make("marhes_lab", Start("a", OMNI, Pose(-2.0, wall - 1.0, 0.0)))
        engine.command("a", Twist(0.0, 0.0, 0.5))
        run(engine, 4.0)
        assert abs(body_of(engine, "a").twist.side) < 0.05
        assert deepest_overlap(engine) < 0.02
        assert any(body_of(engine, "a").touch)
