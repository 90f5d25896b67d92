"""Ties are decided by what is meant, such as the left, and not by the last bit of a number.

So a match whose field is reflected, with robots that prefer the right where the others prefer the left, is the mirror
image of the match, to the last bit.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vrg
from vrg.games.roboflag.evasion import best_course
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.navigation import avoidance, pilot
from vrg.portable.scalars import atan2, cos_sin

PLAYERS = (("shark", 10.5, 0.3, 170.0), *(("minnow", -10.5 + 0.4 * (n % 2), 1.3 * n - 3.9, 3.0 * n) for n in range(7)))
"""The role, the place in m and the heading in degrees of each."""
RULES = (
    'name = "mirrored"\ngame = "sharks-and-minnows"\nmap = "open"\nnoise = false\nlasers = false\n[rules]\n'
    'x = [-12.5, 12.5]\ny = [-5.0, 5.0]\nalong = "x"\nfirst_goal = "high"\nlineup = "place"\npasses = 1\n'
)


def match_file(side: int) -> str:
    """A match, or with a side of -1 the same one reflected at the x axis."""
    robots = (
        f'[[players]]\nname = "p{number}"\nrole = "{role}"\nx = {x}\ny = {side * y}\nheading = {side * heading}\n'
        for number, (role, x, y, heading) in enumerate(PLAYERS)
    )
    return RULES + "".join(robots)


@contextmanager
def right_handed(patch: pytest.MonkeyPatch) -> Iterator[None]:
    """Robots that pass others on the other side where both are free."""
    with patch.context() as own:
        own.setattr(avoidance, "WAYS", tuple((cos, -sin) for cos, sin in avoidance.WAYS))
        own.setattr(pilot, "SIDEWAYS", -pilot.SIDEWAYS)
        yield


def play(folder: Path, side: int, seed: int, patch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """The poses of all robots after each step of a match."""
    folder.mkdir()
    (folder / "match.toml").write_text(match_file(side))
    poses: list[np.ndarray] = []
    step = PlanarEngine.step

    def kept(engine: PlanarEngine, dt: float) -> None:
        step(engine, dt)
        poses.append(engine.poses.copy())

    with patch.context() as own:
        own.setattr(PlanarEngine, "step", kept)
        run = vrg.play(folder / "match.toml", engine="planar", seed=seed, record=False, runs=folder)
    assert any(call.rule == "tag" for call in run.calls)
    return poses


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_a_reflected_match_is_the_mirror_image(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = play(tmp_path / "plain", 1, seed, monkeypatch)
    with right_handed(monkeypatch):
        reflected = play(tmp_path / "reflected", -1, seed, monkeypatch)
    assert len(plain) == len(reflected)
    for step, (here, there) in enumerate(zip(plain, reflected, strict=True)):
        assert np.array_equal(here, there * (1.0, -1.0, -1.0)), step
    other = play(tmp_path / "other", -1, seed, monkeypatch)
    assert not np.array_equal(plain[-1], other[-1] * (1.0, -1.0, -1.0)), "these robots prefer the left"


@given(
    st.floats(-math.pi, math.pi), st.lists(st.tuples(st.floats(1.0, 4.0), st.floats(0.2, 2.0)), min_size=1, max_size=3)
)
def test_of_ways_that_are_as_good_to_both_sides_the_left_one_is_taken(
    turn: float, hunters: list[tuple[float, float]]
) -> None:
    (cos, sin), here = cos_sin(turn), np.array((0.3, -0.7))
    both = [(x, side * y) for x, y in hunters for side in (1.0, -1.0)]
    there = here + [(x * cos - y * sin, x * sin + y * cos) for x, y in both]
    best = best_course(
        (0.3, -0.7), (0.3 + 6.0 * cos, -0.7 + 6.0 * sin), there, speed=0.7, reach=0.5, margin=1.0,
        inside=lambda points: np.ones(points.shape[:-1], dtype=np.bool_),
        harmless=lambda points: np.zeros(points.shape[:-1], dtype=np.bool_),
    )  # fmt: skip
    ahead, aside = best.heading[0] * cos + best.heading[1] * sin, best.heading[1] * cos - best.heading[0] * sin
    assert atan2(aside, ahead) > -1e-9 or abs(atan2(aside, ahead)) > math.pi - 1e-9
