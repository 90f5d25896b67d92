"""The compiled kernel gives the same bits as the Python code that runs without it."""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.digests import played
from tests.hal.engine_bench import ON_WHEELS
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.engines.engine import Engine, Start
from vrg.hal.sim.engines.mujoco import MujocoEngine
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.hal.sim.engines.traction import Traction
from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors.base import Instant, Mounted, Surroundings
from vrg.hal.sim.sensors.odometry import OdometrySimulation
from vrg.hal.sim.sensors.rays import Edges, Fan, among_robots, cast_all, nearest_in_cones
from vrg.hal.sim.shapes import box_edges
from vrg.portable.scalars import cos_sin
from vrg.testing.omni import OMNI
from vrg.types import Pose, Twist

COURTYARD = load_map("courtyard")
DT = 0.02
WHEELS = tuple(Wheel(x=0.1 * n, y=0.2 * (-1) ** n, axis=n) for n in range(12))
CRAWLER = replace(
    robot_model("P2AT"),
    drivetrain=Drivetrain(axes=tuple(map(str, range(12))), wheels=WHEELS, wheel_radius=0.1, wheel_width=0.05),
)
"""A robot with an axis for each of twelve wheels."""
ENGINES: list[Callable[..., Engine]] = [PlanarEngine, MujocoEngine]
SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(autouse=True)
def compiled() -> None:
    if kernel is None:
        pytest.skip("needs the compiled kernel: `make setup` with a C compiler and Python's headers makes it")


@contextmanager
def without_kernel() -> Iterator[None]:
    """All modules compute as where nothing was compiled."""
    users = [m for name, m in sys.modules.items() if name.startswith("vrg.hal.sim.") and hasattr(m, "kernel")]
    assert len(users) > 5
    with pytest.MonkeyPatch.context() as patch:
        for module in users:
            patch.setattr(module, "kernel", None)
        yield


def equal(compute: Callable[[], Sequence[Any]]) -> None:
    """Arrays and numbers are the same, to the last bit, with the kernel and without it."""
    ours = compute()
    with without_kernel():
        theirs = compute()
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        assert np.asarray(one).shape == np.asarray(other).shape
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes()


def models(rng: np.random.Generator, count: int) -> list[RobotModel]:
    """Models of all kinds: some drive sideways, and some have so many axes that numpy adds in another order."""
    if rng.random() < 0.1:
        return [CRAWLER] * count
    return [OMNI if rng.random() < 0.2 else robot_model(rng.choice(ON_WHEELS)) for _ in range(count)]


def crowd(make: Callable[..., Engine], seed: int) -> list[Any]:
    """What is left of a crowd that drives about among walls and obstacles, begun anywhere, some carried or braked."""
    rng = np.random.default_rng(seed)
    x, y, size = [(COURTYARD.circles[0].x, COURTYARD.circles[0].y, 6.0), (10.0, 10.0, 12.0)][seed % 2]

    def pose() -> Pose:
        return Pose(x + rng.uniform(-size, size), y + rng.uniform(-size, size), rng.uniform(-math.pi, math.pi))

    kinds = models(rng, int(rng.integers(1, 20)))
    starts = [Start(f"r{n}", kind, pose(), bool(rng.random() < 0.15)) for n, kind in enumerate(kinds)]
    engine = make(COURTYARD, starts)
    left: list[Any] = []
    for _ in range(25):
        for start in starts:
            twist = Twist(*rng.uniform(-1.0, 1.0, 3)) if start.model is OMNI else Twist(*rng.uniform(-2.0, 2.0, 2))
            if start.kinematic:
                engine.move(start.name, pose() if rng.random() < 0.1 else start.pose, twist)
            elif rng.random() < 0.2:
                engine.command(start.name, None if rng.random() < 0.2 else twist)
        engine.step(DT)
        left += [*(array.copy() for array in (engine.poses, engine.velocities, engine.angles, engine.speeds))]
        left.append(list(engine.touch))
    engine.close()
    return left


@pytest.mark.parametrize("make", ENGINES)
@given(seed=SEEDS)
def test_a_crowd_moves_the_same(make: Callable[..., Engine], seed: int) -> None:
    equal(lambda: crowd(make, seed))


@pytest.mark.parametrize("make", ENGINES)
@pytest.mark.parametrize("count", [0, 1])
def test_it_needs_neither_robots_nor_walls(make: Callable[..., Engine], count: int) -> None:
    nothing = replace(load_map("open"), boxes=(), circles=())
    starts = [Start(f"r{n}", OMNI, Pose(0.0, 0.0, 3.1)) for n in range(count)]

    def still() -> list[Any]:
        engine = make(nothing, starts)
        engine.step(DT)
        return [engine.poses, among_robots(Edges(np.empty((0, 4))), engine.models, engine.poses).ends]

    equal(still)


@given(SEEDS, st.sampled_from([1e-12, 1e-3, 1.0, 1e3, 1e12]))
def test_wheels_press_the_same(seed: int, size: float) -> None:
    def forces() -> list[Any]:
        rng = np.random.default_rng(seed)
        kinds = models(rng, 9)
        traction = Traction([Start(str(n), kind, Pose(0.0, 0.0, 0.0), n == 3) for n, kind in enumerate(kinds)])
        found = []
        for _ in range(4):
            angles, speeds = rng.uniform(-4.0, 4.0, 9), rng.normal(0.0, size, (9, 3))
            cos, sin = np.array([cos_sin(angle) for angle in angles.tolist()]).T.copy()
            # Some wheels stand, and some roll as their robot drives.
            axes = max(len(kind.drivetrain.axes) for kind in kinds)
            rims = traction.rims(rng.normal(0.0, size, (9, axes)) * rng.integers(0, 2, (9, axes)))
            pressed = np.empty((9, 3))
            traction.press(0.01, cos, sin, speeds, rims, pressed)
            found += [pressed]
        return found

    equal(forces)


@given(st.lists(st.floats(-1e300, 1e300) | st.floats(-7.0, 7.0) | st.just(math.inf), min_size=1, max_size=9))
def test_the_portable_cosine_and_sine_are_the_same(angles: list[float]) -> None:
    assert kernel is not None
    count = len(angles)
    places, frames = np.zeros((count, 3)), np.zeros((count, 4))
    places[:, 2] = [2.0 * angle for angle in angles]
    zeros, speeds = np.full((count, 3), math.nan), np.zeros((count, 3))
    kernel.settle(places, speeds, zeros, frames, np.ones(count), np.zeros(count), np.ones(3))
    halves = (places[:, 2] * 0.5).tolist()
    wanted = [(math.nan, math.nan) if math.isinf(angle) else cos_sin(angle) for angle in halves]
    assert np.array_equal(frames[:, ::3], wanted, equal_nan=True)


@given(SEEDS, st.sampled_from([math.pi / 2, math.pi, 1.9 * math.pi, math.tau]))
def test_beams_and_cones_end_at_the_same_places(seed: int, fov: float) -> None:
    def ranges() -> list[Any]:
        rng = np.random.default_rng(seed)
        bodies = rng.uniform((-9, -9, -4, 0.1, 0.1), (9, 9, 4, 5, 5), (int(rng.integers(0, 12)), 5))
        kinds = models(rng, int(rng.integers(1, 12)))
        poses = rng.uniform((-9, -9, -4), (9, 9, 4), (len(kinds), 3))
        if seed % 3 == 0:  # along the axes, where edges are seen from their ends
            poses, bodies[:, :3] = np.rint(poses), np.rint(bodies[:, :3])
        discs = rng.uniform((-9, -9, 0.1), (9, 9, 2), (int(rng.integers(0, 3)), 3))
        edges = among_robots(Edges(box_edges(bodies)), kinds, poses)
        turns = np.array([cos_sin(heading) for heading in poses[:, 2].tolist()]).T.copy()
        fan, reach = Fan.of(int(rng.integers(1, 200)), fov), rng.uniform(0.5, 15.0)
        beams = cast_all(poses[:, :2], turns, fan, reach, edges, discs)
        cones = nearest_in_cones(poses, rng.uniform(0.01, 1.5), reach, edges, discs)
        return [edges.ends, edges.normals, edges.offsets, beams, cones]

    equal(ranges)


@given(SEEDS, st.booleans())
def test_odometry_adds_up_the_same(seed: int, noise: bool) -> None:
    def poses() -> list[Any]:
        rng = np.random.default_rng(seed)
        kinds = models(rng, 7)
        axes = max(len(kind.drivetrain.axes) for kind in kinds)
        angles = np.zeros((7, axes))

        def now(tick: int) -> Instant:
            return Instant(tick, DT, kinds, np.zeros((7, 3)), np.zeros((7, 3)), angles, [0] * 7, np.ones(7))

        mounted = [
            Mounted(row, f"r{row}", kind, spec)
            for row, kind in enumerate(kinds)
            if (spec := kind.sensor(OdometrySpec)) is not None
        ]
        simulation = OdometrySimulation(Surroundings(COURTYARD, seed, noise), mounted, now(0))
        found: list[Any] = []
        for tick in range(1, 80):
            angles += rng.normal(0.0, 0.3, angles.shape)
            for _, _, reading in simulation.sense(now(tick)):
                assert isinstance(reading, Odometry)
                pose, twist = reading.pose, reading.twist
                found.append([pose.x, pose.y, pose.theta, twist.v, twist.w, twist.side])
        return [*found, simulation.poses]

    equal(poses)


READ_ONLY = np.zeros((2, 3))
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        (np.zeros((3, 3)), ValueError),
        (np.zeros((2, 3), dtype=np.float32), TypeError),
        (np.zeros((2, 6))[:, ::2], ValueError),
        (READ_ONLY, ValueError),
        ([[0.0, 0.0, 0.0]], TypeError),
    ],
    ids=["too large", "of other numbers", "not contiguous", "read-only", "a list"],
)
def test_arrays_that_do_not_fit_are_refused(wrong: Any, error: type[Exception]) -> None:
    assert kernel is not None
    one = np.zeros((2, 3))
    others = (one, one, np.zeros((2, 4)), np.zeros(2), np.zeros(2), one, one)
    kernel.depart(one, *others)
    with pytest.raises(error):
        kernel.depart(wrong, *others)
    with pytest.raises(TypeError):
        kernel.depart(one, *others, one)  # type: ignore[call-arg]


def test_axes_that_no_robot_has_are_refused() -> None:
    assert kernel is not None
    one = np.ones(1)
    for axis in (-1, 2):
        with pytest.raises(IndexError):
            kernel.integrate(
                np.zeros((2, 2)), np.array([axis]), one, one, one, np.zeros(3), np.zeros(1, np.intp),
                np.zeros(3), np.zeros(3),
            )  # fmt: skip


MATCHES = [("sharks-and-minnows", "mujoco"), ("pursuit-evasion", "planar"), ("roboflag", "planar")]


@pytest.mark.parametrize(("game", "engine"), MATCHES)
def test_a_match_is_the_same_without_the_kernel(game: str, engine: str) -> None:
    with_it = played(game, 1, engine=engine)
    with without_kernel():
        assert played(game, 1, engine=engine) == with_it


@pytest.mark.thorough
@pytest.mark.parametrize("game", ["sharks-and-minnows", "pursuit-evasion", "roboflag"])
@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_many_matches_are_the_same_without_the_kernel(game: str, engine: str) -> None:
    with_it = played(game, *range(2, 5), engine=engine)
    with without_kernel():
        assert played(game, *range(2, 5), engine=engine) == with_it
