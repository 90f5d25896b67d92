"""Pursuit, against brute force: points on a grid, and both sides driven step by step."""

import math
import random

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.agents.interception import intercept
from vrg.agents.pursuit import apollonius, lion_move, pure_pursuit_gap, pure_pursuit_time, reaches_first
from vrg.types import Vector

places = st.tuples(st.floats(-10, 10), st.floats(-10, 10))
speeds = st.floats(0.2, 3)


@given(places, speeds, places, speeds, places)
def test_the_circle_parts_the_points_that_either_side_reaches_first(
    pursuer: Vector, speed: float, evader: Vector, evader_speed: float, point: Vector
) -> None:
    assume(math.dist(pursuer, evader) > 0.1)
    assume(abs(speed - evader_speed) > 0.01)
    circle = apollonius(pursuer, speed, evader, evader_speed)
    assert circle is not None
    border = math.dist(point, (circle.x, circle.y)) - circle.radius
    assume(abs(border) > 1e-6 * circle.radius)
    inside_is_the_slower = border < 0
    slower_is_first = reaches_first(point, pursuer, speed, evader, evader_speed) == (speed < evader_speed)
    assert inside_is_the_slower == slower_is_first


@given(places, speeds, places, speeds, st.floats(0, 2 * math.pi))
def test_an_evader_that_drives_straight_is_met_on_the_circle(
    pursuer: Vector, speed: float, evader: Vector, share: float, course: float
) -> None:
    assume(math.dist(pursuer, evader) > 0.1)
    evader_speed = speed * min(share / 3, 0.95)
    velocity = evader_speed * math.cos(course), evader_speed * math.sin(course)
    circle = apollonius(pursuer, speed, evader, evader_speed)
    met = intercept(pursuer, speed, evader, velocity)
    assert circle is not None
    assert met is not None
    assert math.dist(met.point, (circle.x, circle.y)) == pytest.approx(circle.radius, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("pursuer", "speed", "evader", "evader_speed"),
    [
        ((0.0, 0.0), 1.0, (2.0, 0.0), 1.0),
        ((0.0, 0.0), 0.0, (2.0, 0.0), 1.0),
        ((0.0, 0.0), 1.0, (2.0, 0.0), 0.0),
        ((1.0, 1.0), 1.0, (1.0, 1.0), 0.5),
    ],
    ids=["equal speeds", "the pursuer stands", "the evader stands", "at the same place"],
)
def test_where_there_is_no_circle_there_is_none(
    pursuer: Vector, speed: float, evader: Vector, evader_speed: float
) -> None:
    assert apollonius(pursuer, speed, evader, evader_speed) is None


def chased(pursuer: Vector, speed: float, evader: Vector, velocity: Vector, limit: float) -> tuple[float, float]:
    """Drive both in small steps: the time until they meet or the limit, and the distance then."""
    dt, time = 1e-3, 0.0
    while time < limit:
        distance = math.dist(pursuer, evader)
        if distance <= speed * dt:
            break
        share = speed * dt / distance
        pursuer = (
            pursuer[0] + (evader[0] - pursuer[0]) * share,
            pursuer[1] + (evader[1] - pursuer[1]) * share,
        )
        evader = evader[0] + velocity[0] * dt, evader[1] + velocity[1] * dt
        time += dt
    return time, math.dist(pursuer, evader)


def test_pure_pursuit_takes_as_long_as_driven_step_by_step() -> None:
    wrong = []
    for seed in range(12):
        rng = random.Random(seed)
        pursuer, evader = ((rng.uniform(-5, 5), rng.uniform(-5, 5)) for _ in range(2))
        speed, course = rng.uniform(0.8, 2.0), rng.uniform(-math.pi, math.pi)
        evader_speed = speed * rng.uniform(0.0, 0.85)
        velocity = evader_speed * math.cos(course), evader_speed * math.sin(course)
        expected = pure_pursuit_time(pursuer, speed, evader, velocity)
        assert expected is not None, f"seed {seed}"
        taken, _ = chased(pursuer, speed, evader, velocity, 2 * expected + 1)
        if taken != pytest.approx(expected, rel=0.02, abs=0.02):
            wrong.append(f"seed {seed}: {taken} s, expected {expected} s")
    assert not wrong, "\n".join(wrong)


def test_pure_pursuit_never_catches_who_is_as_fast_or_faster() -> None:
    assert pure_pursuit_time((0.0, 0.0), 1.0, (3.0, 0.0), (0.0, 1.0)) is None
    assert pure_pursuit_time((0.0, 0.0), 1.0, (3.0, 0.0), (1.5, 0.0)) is None
    assert pure_pursuit_time((0.0, 0.0), 0.0, (3.0, 0.0), (0.0, 0.0)) is None


def test_head_on_they_meet_whatever_their_speeds_are() -> None:
    assert pure_pursuit_time((0.0, 0.0), 1.0, (3.0, 0.0), (-2.0, 0.0)) == pytest.approx(1.0)
    assert pure_pursuit_time((0.0, 0.0), 1.0, (3.0, 0.0), (-1.0, 0.0)) == pytest.approx(1.5)
    assert pure_pursuit_time((2.0, 2.0), 1.0, (2.0, 2.0), (5.0, 0.0)) == 0.0


@pytest.mark.parametrize("angle", [0.3, 1.0, math.pi / 2, 2.0])
def test_the_gap_to_an_equally_fast_evader_is_what_is_left_after_a_long_time(angle: float) -> None:
    _, gap = chased((0.0, 0.0), 1.0, (2.0, 0.0), (math.cos(angle), math.sin(angle)), 40.0)
    assert gap == pytest.approx(pure_pursuit_gap(2.0, angle), abs=0.01)


def test_a_lion_has_the_man_within_its_bound_and_gains_with_each_move() -> None:
    """In a disc, from any two places, against men that circle, run away, or turn by chance."""

    def somewhere(rng: random.Random, radius: float) -> Vector:
        r, angle = radius * math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi)
        return r * math.cos(angle), r * math.sin(angle)

    wrong = []
    for seed in range(40):
        rng = random.Random(seed)
        radius, step = rng.uniform(3, 12), rng.uniform(0.2, 0.8)
        lion = centre = somewhere(rng, radius)
        man, way, moves = somewhere(rng, radius), rng.choice(["circle", "away", "chance"]), 0
        while lion != man:
            course = {
                "circle": math.atan2(man[1], man[0]) + math.pi / 2,
                "away": math.atan2(man[1] - lion[1], man[0] - lion[0]),
                "chance": rng.uniform(-math.pi, math.pi),
            }[way]
            for turn in (0.0, 0.1, -0.1, 0.5, -0.5, 1.2, -1.2, math.pi):
                ahead = man[0] + step * math.cos(course + turn), man[1] + step * math.sin(course + turn)
                if math.hypot(*ahead) <= radius:
                    man = ahead
                    break
            before = math.dist(centre, lion) ** 2
            gone = lion
            lion = lion_move(centre, lion, man, step)
            moves += 1
            in_reach = math.dist(gone, lion) <= step * (1 + 1e-9)
            gains = lion == man or math.dist(centre, lion) ** 2 >= before + step**2 * (1 - 1e-6)
            in_time = moves <= (2 * radius / step) ** 2 + 1
            if not (in_reach and gains and in_time):
                wrong.append(f"seed {seed}, move {moves}: {in_reach=}, {gains=}, {in_time=}")
                break
    assert not wrong, "\n".join(wrong)


def test_a_lion_that_is_not_on_the_segment_goes_to_it() -> None:
    assert lion_move((0.0, 0.0), (0.0, 5.0), (9.0, 0.0), 1.0) == pytest.approx((0.0, 4.0))
    assert lion_move((0.0, 0.0), (3.0, 0.5), (9.0, 0.0), 1.0) == pytest.approx((3.0 + math.sqrt(0.75), 0.0))
