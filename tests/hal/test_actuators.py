"""Grippers and dribblers: by closed forms, in every engine, and as far as a robot may use them."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.hal.engine_bench import DT, ENGINE_NAMES
from tests.hal.test_bodies import BALL, BOX, OPEN
from tests.hal.world_bench import SimBench, config
from vrg.agents.messages import usable
from vrg.bus.messages import PlayerStatus, RefereeState, Stage
from vrg.hal.actuators import Dribbler, Gripper, Kicker
from vrg.hal.models import MODELS, RobotModel, robot_model
from vrg.hal.sim.bodies import Bodies
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.engines import ENGINES
from vrg.hal.sim.engines.engine import Floats, Start
from vrg.hal.sim.front import Grip, Pull, kick
from vrg.hal.sim.map import Map
from vrg.hal.sim.rigid import Rigid
from vrg.hal.sim.shapes import Box
from vrg.hal.sim.snapshot import decode_snapshot, encode_snapshot
from vrg.hal.sim.world import World
from vrg.testing.driver import DriverContract
from vrg.types import STILL, Pose, Twist

P2AT = robot_model("P2AT")
DRIBBLER = Dribbler(reach=0.05, width=0.3, pull=2.0)
HANDY = replace(
    P2AT, name="handy", actuators=(Gripper(reach=0.1, width=0.4, load=8.0), DRIBBLER, Kicker(most=4.0, width=0.3))
)
ORIGIN = Pose(0.0, 0.0, 0.0)
FRONT = P2AT.length / 2
CRATE = replace(BOX, pose=Pose(FRONT + 0.3, 0.1, 0.2), friction=0.4)
ROUND = replace(BALL, pose=Pose(FRONT + 0.1, 0.0, 0.0))


@pytest.fixture(autouse=True)
def _handy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MODELS._built_in, "handy", "tests.hal.test_actuators:HANDY")


def among(*setups: BodySetup, ground: Map = OPEN, robots: int = 1) -> tuple[Bodies, list[Rigid]]:
    """Bodies beside robots that the test moves itself."""
    starts = [Start(f"r{n}", HANDY, Pose(0.0, 5.0 * n, 0.0)) for n in range(robots)]
    bodies = Bodies(ground, setups, ENGINES.get("planar")(ground, starts))
    return bodies, [body for _, body in bodies]


def rows(pose: Pose) -> Floats:
    return np.array([[pose.x, pose.y, pose.theta]])


def moved(
    bodies: Bodies, at: Pose, twist: Twist, seconds: float, pulls: tuple[Pull, ...] = (), speed_up: float = 0.0
) -> Iterator[tuple[Pose, Twist]]:
    """Move the robot along its arc, with an acceleration ahead, m/s^2."""
    for _ in range(round(seconds / DT)):
        x, y, theta = at.x, at.y, at.theta
        twist = Twist(twist.v + speed_up * DT, twist.w)
        theta += twist.w * DT
        if twist.w:
            radius = twist.v / twist.w
            x += radius * (math.sin(theta) - math.sin(at.theta))
            y -= radius * (math.cos(theta) - math.cos(at.theta))
        else:
            x, y = x + twist.v * DT * math.cos(theta), y + twist.v * DT * math.sin(theta)
        after = Pose(x, y, theta)
        bodies.step(DT, rows(at), rows(after), np.array([[twist.v, twist.w, 0.0]]), pulls)
        at = after
        yield at, twist


# Grippers.


@given(st.floats(-1.0, 1.0), st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_what_is_held_moves_rigidly_and_keeps_that_velocity(v: float, w: float, theta: float) -> None:
    start, w = Pose(1.0, -2.0, theta), round(w, 3)
    bodies, (crate,) = among(CRATE)
    hold = Pose(FRONT + 0.3, 0.1, 0.2)
    bodies.hold(0, Grip(0, "gripper", hold))
    for at, _ in moved(bodies, start, Twist(v, w), 1.0):
        cos, sin = math.cos(at.theta), math.sin(at.theta)
        dx, dy = hold.x * cos - hold.y * sin, hold.x * sin + hold.y * cos
        assert (crate.x, crate.y) == pytest.approx((at.x + dx, at.y + dy), abs=1e-12)
        assert math.remainder(crate.theta - at.theta - hold.theta, math.tau) == pytest.approx(0.0, abs=1e-12)
        # v = v_robot + w x r
        assert (crate.vx, crate.vy) == pytest.approx((v * cos - w * dy, v * sin + w * dx), abs=1e-12)
        assert crate.w == w
    before = crate.vx, crate.vy, crate.w
    bodies.let_go(0)
    assert (crate.vx, crate.vy, crate.w) == before
    if math.hypot(*before[:2]) > 0.5:
        far = rows(Pose(100.0, 0.0, 0.0))  # its robot is gone
        bodies.step(DT, far, far, np.zeros((1, 3)))
        assert math.hypot(crate.vx, crate.vy) < math.hypot(*before[:2]), "the floor slows it"


@pytest.mark.parametrize(
    ("bodies", "taken"),
    [
        ((CRATE,), "box"),
        ((ROUND,), "ball"),
        ((CRATE, replace(ROUND, pose=Pose(FRONT + 0.1, -0.25, 0.0))), "ball"),
        ((replace(CRATE, pose=Pose(FRONT + 0.36, 0.0, 0.0)),), ""),
        ((replace(CRATE, mass=8.1),), ""),
        ((replace(ROUND, pose=Pose(FRONT + 0.1, 0.31, 0.0)),), ""),
        ((replace(ROUND, pose=Pose(-FRONT - 0.1, 0.0, 0.0)),), ""),
    ],
)
def test_a_gripper_takes_the_nearest_body_before_it(bodies: tuple[BodySetup, ...], taken: str) -> None:
    made, _ = among(*bodies)
    made.grip(0, ORIGIN, HANDY, HANDY.actuators[0], True)  # type: ignore[arg-type]
    assert [made.names[number] for number in made.grips] == ([taken] if taken else [])


def test_what_is_held_pushes_what_is_in_its_way() -> None:
    bodies, (crate, ball) = among(CRATE, replace(BALL, pose=Pose(FRONT + 0.7, 0.1, 0.0), friction=0.0, restitution=0.0))
    bodies.hold(0, Grip(0, "gripper", crate_at()))
    for at, _ in moved(bodies, ORIGIN, Twist(0.5, 0.0), 1.0):
        assert crate.x == pytest.approx(at.x + FRONT + 0.3, abs=1e-12)
    assert ball.vx > 0.45


def crate_at() -> Pose:
    return Pose(FRONT + 0.3, 0.1, 0.2)


def used(
    made: World, use: dict[str, float], seconds: float = 0.1, twist: Twist = STILL, **status: object
) -> list[tuple[float, float]]:
    """Let the robot use its actuators and drive; where the first body is, in the robot's frame."""
    found = []
    for _ in range(round(seconds / DT)):
        fields = {"name": "r", "team": "t", "role": "r", "state": "active", "may_move": True, "radius": 0.1} | status
        halted = fields.pop("halted", None)
        state = RefereeState(
            game="g", stage=Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
            rounds=1, score={}, players=(PlayerStatus(**fields),), zones=(),  # type: ignore[arg-type]
        )  # fmt: skip
        made.referee(state, made.time)
        made.drive("r", twist, armed=True, use=use)
        made.step()
        found.append(seen(made))
    return found


def seen(made: World) -> tuple[float, float]:
    (_, body), *_ = made.bodies
    at = made.pose("r")
    dx, dy, cos, sin = body.x - at.x, body.y - at.y, math.cos(at.theta), math.sin(at.theta)
    return dx * cos + dy * sin, dy * cos - dx * sin


def handy(engine: str, *bodies: BodySetup, **options: object) -> World:
    wanted = {"engine": engine, "bodies": bodies, "noise": False, "model": "handy"} | options
    return World(config(("r", 0.0, 0.0, 0.0), **wanted))  # type: ignore[arg-type]


@pytest.fixture(params=ENGINE_NAMES)
def engine(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    pytest.importorskip({"planar": "numpy"}.get(name, name))
    return name


def test_a_robot_carries_a_box_backwards_and_around_and_puts_it_down(engine: str) -> None:
    made = handy(engine, CRATE)
    first = used(made, {"gripper": 1.0}, 0.2)[-1]
    assert first == pytest.approx((FRONT + 0.3, 0.1), abs=0.01)
    for twist in (Twist(-0.5, 0.0), Twist(0.0, 1.0), Twist(0.4, -0.8)):
        for place in used(made, {}, 1.0, twist):
            assert place == pytest.approx(first, abs=2e-3), "it need not be told again"
    used(made, {"gripper": 0.0}, 1.0, STILL)
    gone = used(made, {}, 1.0, Twist(-0.5, 0.0))[-1]
    assert gone[0] > first[0] + 0.3
    made.close()


def test_a_robot_with_a_box_is_stopped_by_a_wall_and_keeps_it(engine: str) -> None:
    crate = replace(CRATE, pose=Pose(26.0 + FRONT + 0.27, -20.0, 0.0))
    options = {"engine": engine, "bodies": (crate,), "noise": False, "model": "handy", "map": "courtyard"}
    made = World(config(("r", 26.0, -20.0, 0.0), **options))  # type: ignore[arg-type]
    (_, box), *_ = made.bodies
    first = used(made, {"gripper": 1.0}, 0.2)[-1]
    used(made, {}, 9.0, Twist(0.5, 0.0))
    assert box.x == pytest.approx(29.85 - 0.25, abs=0.01), "its front is at the wall"
    assert seen(made) == pytest.approx(first, abs=5e-3)
    before = made.pose("r").x
    used(made, {}, 1.0, Twist(0.5, 0.0))
    assert made.pose("r").x == pytest.approx(before, abs=0.01)
    made.close()


def test_what_cannot_follow_slips_out() -> None:
    wall = replace(OPEN, boxes=(Box(FRONT + 0.3, 0.8, 0.0, 2.0, 0.2),))
    bodies, (crate,) = among(CRATE, ground=wall)
    bodies.hold(0, Grip(0, "gripper", crate_at()))
    for _ in moved(bodies, ORIGIN, Twist(0.0, 1.0), 3.0):
        pass  # nothing but the test turns this robot, so that it presses without end
    assert not bodies.grips
    assert crate.y < 0.7


def test_it_keeps_what_it_holds_while_it_is_held_and_at_an_emergency_stop(engine: str) -> None:
    made = handy(engine, CRATE)
    first = used(made, {"gripper": 1.0}, 0.2)[-1]
    used(made, {}, 1.0, Twist(0.5, 0.0))
    assert used(made, {"gripper": 0.0}, 0.5, may_move=False)[-1] == pytest.approx(first, abs=2e-3)
    used(made, {"gripper": 0.0}, 0.5, lease=Twist(0.3, 0.0))
    made.engage(True)
    used(made, {"gripper": 0.0}, 0.5, Twist(0.5, 0.0))
    assert len(made.bodies.grips) == 1
    made.close()


@pytest.mark.parametrize("status", [{"may_move": False}, {"lease": STILL}, {"halted": "an official"}])
def test_a_robot_that_may_not_use_it_takes_nothing(status: dict[str, object]) -> None:
    made = handy("planar", CRATE)
    used(made, {"gripper": 1.0}, 0.2, **status)
    assert not made.bodies.grips


@pytest.mark.parametrize("name", ["r", "box"])
def test_what_the_rules_place_lets_go(name: str) -> None:
    made = handy("planar", CRATE)
    used(made, {"gripper": 1.0}, 0.2)
    assert made.bodies.grips
    made.place(name, Pose(5.0, 5.0, 0.0))
    assert not made.bodies.grips
    used(made, {}, 0.5, Twist(0.5, 0.0))
    assert math.hypot(*seen(made)) > 3.0


def test_a_snapshot_keeps_what_is_held_to_the_bit() -> None:
    made = handy("planar", CRATE)
    used(made, {"gripper": 1.0}, 0.2)
    used(made, {}, 1.0, Twist(0.4, 0.3))
    kept = decode_snapshot(encode_snapshot(made.snapshot()))
    again = World(made.config, kept)
    assert again.bodies.grips == made.bodies.grips
    assert again.snapshot().held == kept.held != {}
    first = seen(made)
    assert used(again, {}, 2.0, Twist(-0.5, 0.5))[-1] == pytest.approx(first, abs=2e-3)
    used(again, {"gripper": 0.0}, 0.1)
    assert not again.snapshot().held


# Dribblers.


def share(value: float) -> tuple[Pull, ...]:
    return (Pull(0, FRONT, DRIBBLER, value * DRIBBLER.pull),)


@given(st.floats(0.1, 1.0), st.floats(0.2, 1.8))
def test_a_ball_stays_as_long_as_the_pull_can_slow_it_and_no_longer(part: float, ratio: float) -> None:
    """The robot brakes at `ratio` times what the pull can do."""
    if abs(ratio - 1.0) < 0.02:
        return
    bodies, (ball,) = among(replace(ROUND, mass=1e-6, friction=0.0))
    ball.vx, braking, pulled = 1.5, ratio * part * DRIBBLER.pull, part * DRIBBLER.pull
    lost = False
    moves = moved(bodies, ORIGIN, Twist(1.5, 0.0), 1.4 / braking, share(part), -braking)
    for time, (at, twist) in enumerate(moves, 1):
        gap = ball.x - 0.1 - at.x - FRONT
        if ratio < 1.0:
            assert gap == pytest.approx(0.0, abs=1e-6)
            assert ball.vx == pytest.approx(twist.v, abs=1e-6)
        elif not lost:
            # It gets away by half of the rest of the deceleration times the square of the time, in steps of DT.
            assert gap == pytest.approx((braking - pulled) * time * (time + 1) * DT**2 / 2.0, abs=1e-6)
            lost = gap > DRIBBLER.reach
        else:
            assert gap > DRIBBLER.reach, "nothing pulls it any more"


@pytest.mark.parametrize(("w", "stays"), [(1.4, True), (2.4, False)])
def test_a_ball_is_turned_along_as_long_as_the_pull_is_centripetal_enough(w: float, stays: bool) -> None:
    bodies, (ball,) = among(replace(ROUND, mass=1e-6, friction=0.0))
    radius = FRONT + 0.1
    assert (w * w * radius < DRIBBLER.pull) == stays
    at = ORIGIN
    for step in range(1, 141):  # it speeds up slowly
        ((at, _),) = moved(bodies, at, Twist(0.0, w * min(1.0, step / 40)), DT, share(1.0))
    assert (abs(math.hypot(ball.x, ball.y) - radius) < 1e-3) == stays


def test_a_ball_within_reach_is_pulled_to_the_front_and_pulls_the_robot() -> None:
    bodies, (ball,) = among(replace(ROUND, pose=Pose(FRONT + 0.14, 0.05, 0.0), friction=0.0))
    at = rows(ORIGIN)
    (push,) = bodies.step(DT, at, at, np.zeros((1, 3)), share(1.0))
    (mass,) = ENGINES.get("planar")(OPEN, [Start("r0", HANDY, ORIGIN)]).masses
    assert push.vx * mass == pytest.approx(-BALL.mass * ball.vx)
    for _ in range(50):
        bodies.step(DT, at, at, np.zeros((1, 3)), share(1.0))
    assert ball.x == pytest.approx(FRONT + 0.1, abs=1e-3)
    assert ball.y == pytest.approx(0.05)


@pytest.mark.parametrize("later", [{}, {"kicker": 0.0}, {"dribbler": 0.0}])
def test_a_kick_or_a_grip_happens_also_where_another_command_follows_before_the_tick(later: dict[str, float]) -> None:
    for first, so in (({"kicker": 3.0}, 0.05), ({"gripper": 1.0}, 0.0)):
        made = handy("planar", replace(ROUND, pose=Pose(FRONT + 0.11, 0.0, 0.0)))
        used(made, {})
        made.drive("r", STILL, armed=True, use=first)
        began, ended = seen(made)[0], used(made, later, DT)[-1][0]
        assert (ended - began > so) is (so > 0.0)
        assert bool(made.bodies.grips) is (so == 0.0)
        made.close()


def test_a_dribbler_turns_until_the_next_command_and_not_while_the_robot_is_held(engine: str) -> None:
    made = handy(engine, replace(ROUND, pose=Pose(FRONT + 0.11, 0.0, 0.0)))
    used(made, {"dribbler": 1.0}, 1.0, Twist(0.6, 0.0))
    assert used(made, {"dribbler": 1.0}, 1.0, Twist(-0.6, 0.0))[-1][0] == pytest.approx(FRONT + 0.1, abs=0.02)
    lost = handy(engine, replace(ROUND, pose=Pose(FRONT + 0.11, 0.0, 0.0)))
    used(lost, {}, 1.0, Twist(0.6, 0.0))
    assert used(lost, {"dribbler": 1.0}, 1.5, Twist(0.0, 0.0), may_move=False)[-1][0] > FRONT + 0.15
    made.close()
    lost.close()


def test_what_a_player_wants_of_them_stays_within_what_they_can() -> None:
    model: RobotModel = HANDY
    assert usable({"gripper": 3.0, "dribbler": 1.5, "kicker": -1.0}, model) == {
        "gripper": 1.0, "dribbler": 1.0, "kicker": 0.0,
    }  # fmt: skip
    with pytest.raises(ValueError, match=r"expected an actuator of handy \(gripper, dribbler, kicker\), got 'horn'"):
        usable({"horn": 1.0}, model)


class TestADriverWithActuators(DriverContract):
    """The suite of every driver, with a robot that has some."""

    @pytest.fixture
    def bench(self, _handy: None) -> Iterator[SimBench]:
        made = SimBench("planar", model="handy")
        assert made.driver.uses == {"gripper", "dribbler", "kicker"}
        yield made
        made.close()


def test_nobody_takes_what_another_one_holds() -> None:
    bodies, _ = among(CRATE, robots=2)
    bodies.hold(0, Grip(1, "gripper", crate_at()))
    bodies.grip(0, ORIGIN, HANDY, HANDY.actuators[0], True)  # type: ignore[arg-type]
    assert [grip.row for grip in bodies.grips.values()] == [1]


def test_nothing_takes_kicks_or_pulls_a_real_ball() -> None:
    bodies, [ball] = among(replace(ROUND, tracked=True))
    place, reach = (ball.x, ball.y), ROUND.radius + FRONT
    bodies.track("ball", Pose(reach + 0.01, 0.0, 0.0), STILL)
    bodies.grip(0, ORIGIN, HANDY, HANDY.actuators[0], closed=True)  # type: ignore[arg-type]
    assert not kick([ball], ORIGIN, STILL, HANDY, HANDY.actuators[2], 4.0)  # type: ignore[arg-type]
    bodies.step(DT, rows(ORIGIN), rows(ORIGIN), np.zeros((1, 3)), share(1.0))
    assert (ball.x, ball.y) == (reach + 0.01, 0.0) != place
    assert not bodies.grips
    assert not ball.moves
