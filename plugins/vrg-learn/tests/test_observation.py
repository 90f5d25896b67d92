"""What a player sees, as a vector: values in situations made by hand."""

import math
import struct

import numpy as np
import pytest
from making import GAMES_LEARNED, Situation

from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.spec import Sample
from vrg.types import Pose, Twist
from vrg_learn.observation import SECTORS, names, observe

REACH = math.hypot(12.0, 8.0)
"""The diagonal of the field of RoboFlag, m."""


@pytest.fixture
def flags() -> Situation:
    """red1 is at the middle and looks along +y; red2 is 3 m ahead of it, and blue1 4 m to its right."""
    north = math.pi / 2
    poses = {"red1": Pose(0.0, 0.0, north), "red2": Pose(0.0, 3.0, math.pi), "blue1": Pose(4.0, 0.0, north)}
    others = {name: Pose(5.0, -3.0 + index / 2, 0.0) for index, name in enumerate(("red3", "red4", "blue2", "blue3"))}
    return Situation("roboflag", {**poses, **others, "blue4": Pose(-5.9, 3.9, 0.0)}, clock=150.0)


def test_the_own_part_is_heading_velocity_and_borders(flags: Situation) -> None:
    seen = flags.seen(flags.view("red1", Twist(0.35, -2.4)))
    assert seen["cos heading"] == pytest.approx(0.0, abs=1e-6)
    assert seen["sin heading"] == pytest.approx(1.0)
    assert seen["v"] == pytest.approx(0.5)
    assert seen["w"] == pytest.approx(-1.0)
    borders = [seen[f"to {border}"] for border in ("x_min", "x_max", "y_min", "y_max")]
    assert borders == pytest.approx([6 / REACH, 6 / REACH, 4 / REACH, 4 / REACH])


def test_the_nearest_player_comes_first_in_the_own_frame(flags: Situation) -> None:
    view = flags.view("red1", Twist(0.7, 0.0), {"red2": (0.0, 0.0), "blue1": (0.7, 0.7)})
    seen = flags.seen(view)

    def slot(number: int) -> list[float]:
        return [value for name, value in seen.items() if name.startswith(f"other {number}:")]

    # red2 is ahead, stands, and heads a quarter turn to the left of red1.
    assert slot(1) == pytest.approx([1, 0, 3 / REACH, 1 / 4, -0.5, 0, 0, 1, 1, 1, 0, 0], abs=1e-6)
    # blue1 is to the right, heads as red1 does, and drives to the right as fast as it drives ahead.
    assert slot(2) == pytest.approx([0, -1, 4 / REACH, 1 / 5, 0, -0.5, 1, 0, 0, 1, 0, 0], abs=1e-6)


def test_numbers_and_places_of_roboflag(flags: Situation) -> None:
    seen = flags.seen(flags.view("red1"))
    numbers = [seen[name] for name in flags.learning.numbers]
    assert numbers == pytest.approx([1, 0, 0, 0, 0, 0.75, 0, 1, 0])
    # Blue's flag is at (4, -1.6): ahead of +y and to the right.
    away = math.hypot(4.0, 1.6)
    place = [seen[f"their flag's place: {part}"] for part in ("cos bearing", "sin bearing", "distance", "nearness")]
    assert place == pytest.approx([-1.6 / away, -4.0 / away, away / REACH, 1 / (1 + away)])
    home = [seen[f"own home: {part}"] for part in ("cos bearing", "sin bearing", "distance")]
    away = math.hypot(6.0, 4.0)
    assert home == pytest.approx([-4.0 / away, 6.0 / away, away / REACH])
    here = [v for name, v in seen.items() if name.startswith("nearest point of the midline")]
    assert here == [1.0, 0.0, 0.0, 1.0], "a place where the player stands is straight ahead"


def test_a_flag_that_is_carried_and_points_are_seen_from_both_sides(flags: Situation) -> None:
    states = dict.fromkeys(flags.poses, "normal") | {"red1": "flagged", "blue1": "tagged"}
    first = Situation("roboflag", flags.poses)
    objects = tuple(
        type(thing)(name=thing.name, kind=thing.kind, x=thing.x, y=thing.y, team=thing.team, carrier="red1")
        if thing.team == "blue"
        else thing
        for thing in first.state.objects
    )
    game = Situation("roboflag", flags.poses, states=states, points={"red": 2, "blue": 1}, objects=objects)
    red, blue = game.seen(game.view("red1")), game.seen(game.view("blue1"))
    assert (red["i am flagged"], red["own flag is carried"], red["their flag is carried"]) == (1, 0, 1)
    assert (blue["i am tagged"], blue["own flag is carried"], blue["their flag is carried"]) == (1, 1, 0)
    assert (red["lead"], blue["lead"]) == pytest.approx((1 / 3, -1 / 3))
    assert (red["other 2: tagged"], red["other 2: mate"]) == (1, 0)


def test_numbers_and_places_of_sharks_and_minnows() -> None:
    poses = {"player1": Pose(21.0, -25.0, 0.0), "player2": Pose(20.0, -31.0, 0.0), "player3": Pose(18.0, -20.0, 0.0)}
    game = Situation("sharks-and-minnows", poses)
    shark, safe, minnow = (game.seen(game.view(name)) for name in ("player1", "player2", "player3"))
    assert [shark[name] for name in game.learning.numbers] == pytest.approx([1, 1, 0, 1, 0.5, 6 / 7, 1 / 7, 1])
    assert (safe["i am in the safe zone"], minnow["i am in the safe zone"]) == (1, 0)
    # The zone ends at y = -28: 8 m to the right of who looks along +x.
    place = [minnow[f"nearest point of the safe zone: {p}"] for p in ("cos bearing", "sin bearing", "distance")]
    assert place == pytest.approx([0, -1, 8 / math.hypot(10, 19)], abs=1e-6)
    assert (minnow["other 1: same role"], shark["other 1: same role"]) == (1, 0)
    assert (minnow["other 1: same team"], shark["other 1: same team"]) == (1, 0)


def test_others_whose_places_are_unknown_are_zeros_at_the_end() -> None:
    states = {f"pursuer{n}": "watching" for n in (1, 2, 3)} | {f"intruder{n}": "waiting" for n in range(1, 9)}
    game = Situation("pursuit-evasion", states={**states, "intruder9": "escaped"})
    seen = game.seen(game.view("pursuer1"))
    assert seen["other 1: nearness"] > 0.0, "an intruder that is out of play is seen"
    assert all(value == 0.0 for name, value in seen.items() if name.startswith(("other 2", "other 11")))


def test_a_scan_is_the_nearest_range_of_each_sector() -> None:
    game = Situation("pursuit-evasion")
    ranges = [8.0] * 181
    ranges[0], ranges[90], ranges[180] = 2.0, 4.0, 6.0
    scan = Laser(angle_min=-math.pi / 2, angle_step=math.pi / 180, range_max=8.0, data=struct.pack("<181f", *ranges))
    view = game.view("pursuer1", Twist(0.0, 0.0), {}, Sample(0.0, 0.0, scan))
    seen = game.seen(view)
    found = [seen[f"scan {sector}"] for sector in range(SECTORS)]
    assert (found[0], found[16], found[31]) == (0.25, 0.5, 0.75)
    assert found.count(1.0) == SECTORS - 3
    assert game.seen(view, raw=True)["scan 16"] == 4.0
    without = game.seen(game.view("pursuer1"))
    assert all(without[f"scan {sector}"] == 0.0 for sector in range(SECTORS)), "without a laser"


def test_raw_observations_are_in_si_units(flags: Situation) -> None:
    seen = flags.seen(flags.view("red1", Twist(0.35, -1.0), {"red2": (0.1, 0.0)}), raw=True)
    assert [seen[name] for name in ("x", "y", "heading", "v", "w")] == pytest.approx([0, 0, math.pi / 2, 0.35, -1.0])
    assert seen["to x_min"] == pytest.approx(6.0)
    place = [seen[f"their flag's place: {part}"] for part in ("dx", "dy")]
    assert place == pytest.approx([-1.6, -4.0], abs=1e-6)
    slot = [value for name, value in seen.items() if name.startswith("other 1:")]
    assert slot == pytest.approx([1, 3, 0, -0.35, -0.1, math.pi / 2, 1, 1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("game", GAMES_LEARNED)
def test_whatever_happens_all_values_have_names_of_their_own_and_are_within_bounds(game: str) -> None:
    first = Situation(game)
    for raw in (False, True):
        words = names(first.learning, len(first.setup.players), raw=raw)
        assert len(set(words)) == len(words)
    random = np.random.default_rng(1)
    for _ in range(50):
        poses = {name: Pose(*random.uniform(-200.0, 200.0, 3).tolist()) for name in first.poses}
        situation = Situation(game, poses, clock=1e5)
        name = sorted(poses)[0]
        velocities = dict.fromkeys(poses, (50.0, -50.0))
        seen = observe(situation.view(name, Twist(90.0, -90.0), velocities), situation.learning)
        assert np.isfinite(seen).all()
        assert np.abs(seen).max() <= 1.0
