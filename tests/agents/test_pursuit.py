"""The lion's move, driven step by step."""

import math
import random

import pytest

from vrg.agents.pursuit import lion_move
from vrg.types import Vector


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
