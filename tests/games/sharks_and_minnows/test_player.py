"""Whom a shark chases, and that all players are shown the same scene."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from vrg.agents import Pose, View
from vrg.agents.interception import intercept
from vrg.bus.messages import PlayerStatus, RefereeState, Stage, Zone
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
from vrg.games.sharks_and_minnows.scene import ASSUMED_SPEED, UNMET, URGENCY, scene
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.regions import Rectangle
from vrg.types import STILL, Twist, Vector

P2AT = robot_model("P2AT")
FIELD, SAFE = Rectangle(0, 0, 10, 20), Rectangle(0, 0, 10, 4)
places = st.tuples(st.floats(0, 10), st.floats(0, 20))
speeds = st.tuples(st.floats(-2, 2), st.floats(-2, 2))
Minnows = list[tuple[Vector, Vector]]


def status(name: str, role: str, place: Vector | None, state: str = "active") -> PlayerStatus:
    pose = None if place is None else Pose(*place, 0.0)
    return PlayerStatus(name=name, team=role, role=role, state=state, may_move=True, radius=0.4, pose=pose)


def view_of(here: Vector, players: list[PlayerStatus], velocities: dict[str, Vector]) -> View:
    me = status("shark", "shark", here)
    state = RefereeState(
        game="sharks-and-minnows",
        stage=Stage.PLAY_ROUND,
        halted=None,
        way_out=None,
        waiting=(),
        clock=0.0,
        total=0.0,
        round=1,
        rounds=2,
        score={},
        players=(me, *players),
        zones=tuple(Zone(name=kind, kind=kind, region=region) for kind, region in (("field", FIELD), ("safe", SAFE))),
    )
    readings = Readings(stamp=0.0, age=0.0, armed=True, estop=False)
    return View(0.0, me, readings, state, velocities, P2AT, Pose(*here, 0.0))


def cost(shark: Vector, minnow: Vector, velocity: Vector) -> float:
    met = intercept(shark, ASSUMED_SPEED, minnow, velocity, reach=0.8)
    unmet = met is None or SAFE.contains(*met.point)
    return (UNMET + math.dist(shark, minnow) if unmet or met is None else met.time) + URGENCY * SAFE.distance(*minnow)


@given(places, st.lists(st.tuples(places, speeds), min_size=1, max_size=12))
def test_a_shark_alone_chases_the_minnow_that_costs_it_least(here: Vector, minnows: Minnows) -> None:
    players = [status(f"m{i}", "minnow", place) for i, (place, _) in enumerate(minnows)]
    view = view_of(here, players, {f"m{i}": velocity for i, (_, velocity) in enumerate(minnows)})
    seen = scene(view.referee, view.velocities)
    costs = {m.name: cost(here, m.position, m.velocity) for m in seen.prey}
    if costs:
        assert costs[seen.prey_of["shark"].name] == min(costs.values())
    else:
        assert not seen.prey_of


@given(st.lists(places, min_size=1, max_size=5), st.lists(st.tuples(places, speeds), min_size=1, max_size=8))
def test_sharks_share_out_the_minnows_and_chase_one_together_only_if_too_few_are_left(
    sharks: list[Vector], minnows: Minnows
) -> None:
    players = [status(f"s{i}", "shark", place) for i, place in enumerate(sharks)]
    players += [status(f"m{i}", "minnow", place) for i, (place, _) in enumerate(minnows)]
    view = view_of((5.0, 19.0), players, {f"m{i}": velocity for i, (_, velocity) in enumerate(minnows)})
    seen = scene(view.referee, view.velocities)
    if not seen.prey:
        return
    assert seen.prey_of.keys() == {"shark", *(f"s{i}" for i in range(len(sharks)))}
    chased = {minnow.name for minnow in seen.prey_of.values()}
    assert len(chased) == min(len(seen.sharks), len(seen.prey))
    costs = {
        (shark.name, m.name): cost(shark.position, m.position, m.velocity) for shark in seen.sharks for m in seen.prey
    }
    least = min(costs.values())
    assert any(costs[shark, m.name] == least for shark, m in seen.prey_of.items()), "the best pair is not left out"


def test_a_shark_leaves_a_minnow_that_it_has_chased_back_for_one_that_passes_beside_it() -> None:
    players = [status("chased", "minnow", (3.8, 11.0)), status("passing", "minnow", (7.5, 10.0))]
    velocities = {"chased": (0.0, 0.3), "passing": (0.0, -0.5)}
    seen = scene(view_of((5.0, 10.0), players, velocities).referee, velocities)
    assert seen.prey_of["shark"].name == "passing"


def test_a_shark_goes_for_a_minnow_that_it_meets_before_the_safe_zone_and_not_in_it() -> None:
    players = [status("almost safe", "minnow", (8.0, 4.5)), status("coming", "minnow", (3.0, 18.5))]
    velocities = {"almost safe": (0.0, -0.5), "coming": (0.0, -0.5)}
    seen = scene(view_of((5.0, 6.0), players, velocities).referee, velocities)
    assert seen.prey_of["shark"].name == "coming"


def test_a_shark_keeps_its_speed_up_to_the_tag_but_not_before_a_minnow_that_stands() -> None:
    for velocity, least, most in (((0.0, 0.6), 0.65, 0.7), ((0.0, 0.0), 0.0, 0.5)):
        view = view_of((5.0, 10.0), [status("m", "minnow", (5.0, 10.88))], {"m": velocity})
        view = structs.replace(view, pose=Pose(5.0, 10.0, math.pi / 2))
        assert least <= SharksAndMinnowsPlayer("shark", P2AT).act(view).v <= most


def test_the_scene_is_made_once_for_all_who_look() -> None:
    view = view_of((5.0, 10.0), [status("m", "minnow", (1.0, 9.0))], {})
    assert scene(view.referee, view.velocities) is scene(view.referee, view.velocities)


def test_prey_are_the_active_minnows_whose_pose_is_known_and_who_are_not_safe() -> None:
    players = [
        status("crossing", "minnow", (1.0, 9.0)),
        status("safe", "minnow", (1.0, 3.0)),
        status("tagged", "minnow", (3.0, 9.0), "inactive"),
        status("unseen", "minnow", None),
    ]
    seen = scene(view_of((5.0, 10.0), players, {"crossing": (0.3, 0.4)}).referee, {"crossing": (0.3, 0.4)})
    assert [body.name for body in seen.prey] == ["crossing"]
    assert [body.name for body in seen.sharks] == ["shark"]


@given(st.lists(places, min_size=1, max_size=6))
def test_minnows_cross_to_berths_of_their_own_in_their_order_across_the_field(minnows: list[Vector]) -> None:
    players = [status(f"m{i}", "minnow", place) for i, place in enumerate(minnows)]
    berths = scene(view_of((5.0, 10.0), players, {}).referee, {}).berths
    ordered = sorted(berths, key=lambda name: (minnows[int(name[1:])][0], name))
    assert len(ordered) == len(minnows)
    assert all(berths[a][0] + 1.0 < berths[b][0] for a, b in itertools.pairwise(ordered)), "side by side"
    assert all(SAFE.shrunk(1.0).contains(*berth) for berth in berths.values()), "deep inside"


def test_a_state_without_poses_has_no_berths() -> None:
    state = view_of((5.0, 10.0), [], {}).referee
    unseen = structs.replace(state, players=(status("shark", "shark", None), status("m", "minnow", None)))
    assert scene(unseen, {}).berths == {}


def test_a_minnow_that_is_home_makes_room_behind_it() -> None:
    here = (2.0, 3.3)
    me, shark = status("shark", "minnow", here), status("s", "shark", (5.0, 19.0))
    view = structs.replace(view_of(here, [me, shark], {}), me=me)
    view = structs.replace(view, referee=structs.replace(view.referee, players=(me, shark)))
    minnow = SharksAndMinnowsPlayer("shark", P2AT)
    minnow.act(view)
    assert minnow.act(view) != STILL
    assert minnow.mode == "Minnows/Safe"
    there = structs.replace(view, pose=Pose(*scene(view.referee, {}).berths["shark"], 0.0))
    assert minnow.act(there) == STILL


def test_a_shark_leaves_a_minnow_to_the_shark_that_is_nearer() -> None:
    players = [status("other", "shark", (4.0, 10.0)), status("near", "minnow", (3.0, 10.0))]
    far = status("far", "minnow", (9.5, 18.0))
    assert scene(view_of((5.0, 10.0), [*players, far], {}).referee, {}).prey_of["shark"].name == "far"
    assert scene(view_of((5.0, 10.0), players, {}).referee, {}).prey_of["shark"].name == "near", "there is no other"


def test_a_player_takes_its_top_speed_from_play_and_not_from_the_line_up() -> None:
    shark, view = SharksAndMinnowsPlayer("shark", P2AT), view_of((5.0, 10.0), [], {})
    for number in range(400):
        lining_up = number < 200
        moving = Odometry(pose=Pose(0.0, 0.0, 0.0), twist=Twist(0.7 if lining_up else 0.45, 0.0))
        readings = Readings(stamp=0.0, age=0.0, armed=True, estop=False, samples=[Sample(0.0, 0.0, moving, "odometry")])
        me = structs.replace(view.me, mark=Pose(5.0, 19.0, 0.0) if lining_up else None)
        shark.act(structs.replace(view, time=0.1 * number, readings=readings, me=me))
    assert shark._top_speed.value == pytest.approx(0.45, rel=0.02)
