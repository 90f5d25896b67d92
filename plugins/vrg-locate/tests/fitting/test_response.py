"""How an axis follows commands, and that the numbers of that are found again from what it did."""

import math
import random
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.models import robot_model
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.hal.sim.map import load_map
from vrg.types import Pose, Twist
from vrg_locate.fitting.response import PARAMETERS, AxisRun, Response, fit, followed

rates, speeds = st.floats(0.1, 3.0), st.floats(-1.0, 1.0)
responses = st.builds(
    Response,
    lag=st.one_of(st.just(0.0), st.floats(0.001, 0.3)),
    acceleration=rates,
    braking=rates,
    top=st.floats(0.2, 1.0),
)
SLOW = Response(delay=0.07, lag=0.02, acceleration=0.7, braking=1.1, top=0.6)


@given(responses, speeds, speeds, st.floats(0.0, 2.0))
def test_an_axis_moves_as_the_differential_equation_has_it(
    own: Response, speed: float, target: float, dt: float
) -> None:
    steps = 4000
    found, way, aim, h = speed, 0.0, max(-own.top, min(own.top, target)), dt / steps
    for _ in range(steps):
        gap = aim - found
        rate = own.braking if found * gap < 0.0 else own.acceleration
        after = found + max(-rate, min(rate, gap / max(own.lag, h or 1.0))) * h
        found, way = after, way + (found + after) / 2 * h
    assert own.advance(speed, target, dt) == pytest.approx((found, way), abs=5e-3)


@given(responses, speeds, speeds, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_two_steps_are_one(own: Response, speed: float, target: float, one: float, other: float) -> None:
    between, way = own.advance(speed, target, one)
    after, more = own.advance(between, target, other)
    assert own.advance(speed, target, one + other) == pytest.approx((after, way + more), abs=1e-6)


def commanded(seconds: float, seed: int = 0) -> list[tuple[float, float]]:
    """Commands ten times a second, which change by chance."""
    rng, speed, found = random.Random(seed), 0.0, []
    for n in range(int(10 * seconds)):
        if rng.random() < 0.15:
            speed = rng.choice((0.0, 0.3, 0.7, -0.3, -0.7))
        found.append((0.1 * n, speed))
    return found


def driven(own: Response, seconds: float, seed: int = 0, noise: float = 0.0002) -> AxisRun:
    """A run of an axis with that response, read out ten times a second with errors."""
    commands = commanded(seconds, seed)
    times = [0.1 * n + 0.03 for n in range(int(10 * seconds))]
    ways = np.concatenate(([0.0], np.cumsum(followed(own, AxisRun(commands, times, ())))))
    return AxisRun(commands, times, (ways + np.random.default_rng(seed).normal(0.0, noise, len(ways))).tolist())


def test_the_response_of_the_model_is_that_of_the_simulation() -> None:
    model = robot_model("P2AT")
    engine = PlanarEngine(load_map("open"), [Start("ann", model, Pose(0.0, 0.0, 0.0))])
    commands = commanded(20.0)
    ways = []
    for n in range(1000):
        if n % 5 == 0:
            engine.command("ann", Twist(commands[n // 5][1], 0.0))
        engine.step(0.02)
        ways.append(float(engine.poses[0, 0]))
    times = [0.02 * n for n in range(1001)]
    assert np.cumsum(followed(Response.of(model), AxisRun(commands, times, ()))) == pytest.approx(ways, abs=0.03)


def test_the_numbers_of_a_response_are_found() -> None:
    runs = [driven(SLOW, 60.0, seed) for seed in (1, 2)]
    found = fit(runs, Response(lag=0.02, acceleration=1.0, braking=1.0, top=0.7))
    assert found.seen == list(PARAMETERS)
    for name, true in asdict(SLOW).items():
        mean, half = found.interval(**{name: 1.0})
        assert abs(mean - true) < 2 * half < 0.1 * max(true, 0.3), name
    whole, half = found.interval(delay=1.0, lag=1.0)
    assert whole == pytest.approx(0.09, abs=2 * half)
    assert half < 0.01


def test_what_a_motion_does_not_show_is_not_seen() -> None:
    """A robot that was asked for 0.7 m/s and reached it may be faster."""
    fast = replace(SLOW, top=2.0)
    found = fit([driven(fast, 20.0)], replace(fast, top=1.0))
    assert "top" not in found.seen
    assert found.response.top == 1.0
    assert math.isinf(found.interval(top=1.0)[1])


def test_a_push_does_not_spoil_the_numbers() -> None:
    run = driven(SLOW, 60.0)
    ways = np.array(run.ways)
    ways[200:] += 0.3
    found = fit([replace(run, ways=ways.tolist())], Response(lag=0.02, acceleration=1.0, braking=1.0, top=0.7))
    assert found.response.acceleration == pytest.approx(SLOW.acceleration, rel=0.1)
    assert found.response.delay + found.response.lag == pytest.approx(0.09, abs=0.015)


def test_a_motion_that_is_too_short_is_refused() -> None:
    for runs in ([], [driven(SLOW, 5.0)]):
        with pytest.raises(ValueError, match="expected more than 10 s of recorded motion"):
            fit(runs, SLOW)


def test_a_robot_that_stands_tells_nothing() -> None:
    times = [0.1 * n for n in range(300)]
    with pytest.raises(ValueError, match="expected a robot that is commanded to move"):
        fit([AxisRun([(0.0, 0.0)], times, [0.0] * 300)], SLOW)
