"""The rules of pursuit-evasion, sentence by sentence."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.games.pursuit_evasion.making import (
    SETTINGS,
    STARTS,
    book,
    contestants,
    crossing,
    field,
    move,
    out,
    sighting,
)
from vrg.bus.messages import Auction, Official, OfficialAction, Stage
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import DRAW, Contestant, Observation
from vrg.errors import ConfigError
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.state import State
from vrg.types import Pose, Vector


@pytest.fixture
def rules() -> PursuitEvasion:
    """The rule book of three pursuers and two intruders."""
    return book()


# Who starts when.


def test_the_first_intruder_starts_at_0_s() -> None:
    rules = book(intruders=3)
    assert rules.launches["i0"] == 0.0
    verdict = rules.judge(rules.initial(), field(rules), field(rules), 0.1)
    assert verdict.state.states["i0"] == "crossing"
    assert [(c.rule, c.players) for c in verdict.calls] == [("launch", ("i0",))]


def test_the_other_intruders_start_at_random_times_within_the_window() -> None:
    times = [book(intruders=3, seed=seed).launches[name] for seed in range(300) for name in ("i1", "i2")]
    assert all(0.0 <= t <= SETTINGS.launch_window for t in times)
    counts, _ = np.histogram(times, bins=6, range=(0.0, SETTINGS.launch_window))
    assert counts.min() > 70, "uniformly: about 100 in each sixth"
    assert counts.max() < 130


def test_the_times_are_those_of_the_seed_and_of_each_intruder_its_own() -> None:
    assert book(intruders=3, seed=5).launches == book(intruders=3, seed=5).launches
    assert book(intruders=3, seed=5).launches != book(intruders=3, seed=6).launches
    launches = book(intruders=3, seed=5).launches
    assert launches["i1"] != launches["i2"]
    assert (
        abs(np.corrcoef([[book(intruders=3, seed=s).launches[n] for s in range(200)] for n in ("i1", "i2")])[0, 1])
        < 0.2
    )


def test_an_intruder_waits_for_its_time_and_not_longer() -> None:
    rules = book(seed=1)
    due = rules.launches["i1"]
    assert due > 1.0
    early = rules.judge(rules.initial(), field(rules), field(rules), due - 0.05)
    assert early.state.states["i1"] == "waiting"
    late = rules.judge(early.state, field(rules), field(rules), due + 0.05)
    assert late.state.states["i1"] == "crossing"
    assert [c.players for c in late.calls] == [("i1",)]


def test_two_intruders_may_be_in_play_at_once(rules: PursuitEvasion) -> None:
    now = field(rules, {"i0": (2, 5), "i1": (2, 3)})
    verdict = rules.judge(crossing(rules, "i0"), now, now, 20.0)
    assert verdict.state.crossing() == ["i0", "i1"]


def test_a_window_of_nothing_starts_all_at_once() -> None:
    rules = book(SETTINGS.model_copy(update={"launch_window": 0.0}), intruders=3)
    assert set(rules.launches.values()) == {0.0}


def test_an_intruder_that_is_out_does_not_start(rules: PursuitEvasion) -> None:
    verdict = rules.judge(out(rules.initial(), "i0"), field(rules), field(rules), 30.0)
    assert verdict.state.states == {**rules.initial().states, "i1": "crossing"}


# Captures.

FAR, C, E = (1.0, 9.0), ["capture"], ["escape"]
TICKS: dict[str, tuple[list[Vector], list[Vector], list[str]]] = {
    "closer than 1 m": ([(5.0, 5.0)], [(5.0, 5.999)], C),
    "closer than 1 m aslant": ([(5.0, 5.0)], [(5.6, 5.79)], C),
    "exactly 1 m": ([(5.0, 5.0)], [(5.0, 6.0)], []),
    "exactly 1 m aslant": ([(5.0, 5.0)], [(5.6, 5.8)], []),
    "a way that touches the circle": ([(4.0, 5.0), (6.0, 5.0)], [(5.0, 6.0)], []),
    "a way that ends on the circle": ([(4.0, 5.0), (5.0, 5.0)], [(6.0, 5.0)], []),
    "a way that begins on the circle": ([(5.0, 5.0), (4.0, 5.0)], [(6.0, 5.0)], []),
    "two that rush past each other": ([(3.0, 5.0), (7.0, 5.0)], [(7.0, 5.9), (3.0, 5.9)], C),
    "one that rushes past": ([(3.0, 5.0), (7.0, 5.0)], [(5.0, 5.999)], C),
    "side by side": ([(3.0, 5.0), (7.0, 5.0)], [(3.0, 7.0), (7.0, 7.0)], []),
    "ways that cross at one time": ([(3.0, 5.0), (7.0, 5.0)], [(5.0, 9.0), (5.0, 1.0)], C),
    "one way after the other": ([(2.0, 5.0), (4.0, 5.0)], [(4.0, 5.0), (6.0, 5.0)], []),
    "the border belongs to the area": ([(9.9, 5.0), (10.0, 5.0)], [FAR], []),
    "just outside": ([(9.9, 5.0), (10.0001, 5.0)], [FAR], E),
    "captured before it leaves": ([(9.0, 5.0), (11.0, 5.0)], [(9.0, 5.9)], C),
    "captured at 9.9 before it leaves": ([(9.4, 5.0), (10.2, 5.0)], [(10.9, 5.0)], C),
    "close only after it has left": ([(9.9, 5.0), (10.9, 5.0)], [(11.2, 5.0)], E),
    "close long after it has left": ([(9.9, 5.0), (12.9, 5.0)], [(12.0, 5.0)], E),
    "at the same instant a capture comes first": ([(9.5, 5.0), (10.5, 5.0)], [(11.0, 5.0)], C),
}
COMING: dict[str, tuple[list[Vector], list[Vector], list[str]]] = {
    "it has not been inside": ([(-2.0, 5.0), (-1.0, 5.0)], [FAR], []),
    "it passes by and counts for nobody": ([(-2.0, 5.0), (-2.0, 25.0)], [FAR], ["missed"]),
    "it crosses the whole area within a tick": ([(-1.0, 4.0), (11.0, 4.0)], [FAR], ["enter", "escape"]),
}


@pytest.mark.parametrize(
    ("intruder", "pursuer", "expected", "entered"),
    [*((*case, True) for case in TICKS.values()), *((*case, False) for case in COMING.values())],
    ids=[*TICKS, *COMING],
)
def test_one_tick_in_which_an_intruder_and_a_pursuer_move(
    intruder: list[Vector], pursuer: list[Vector], expected: list[str], entered: bool
) -> None:
    rules = book()
    start, end = ({"i0": intruder[at], "p0": pursuer[at]} for at in (0, -1))
    verdict = move(rules, crossing(rules, "i0", entered=entered), start, end)
    assert [call.rule for call in verdict.calls] == expected


def test_a_capture_says_who_where_and_by_whom(rules: PursuitEvasion) -> None:
    verdict = move(rules, crossing(rules, "i0"), {"i0": (3, 5), "p0": (6, 5)}, {"i0": (4, 5), "p0": (4, 5)})
    (call,) = verdict.calls
    assert call.players == ("i0", "p0")
    assert call.text == "i0 is captured by p0"
    intruder, pursuer = call.poses
    assert math.dist((intruder.x, intruder.y), (pursuer.x, pursuer.y)) == pytest.approx(1.0)
    assert intruder.x == pytest.approx(3.0 + 2.0 / 3.0)
    assert verdict.state.states["i0"] == "captured"
    assert rules.score(verdict.state) == {"pursuers": 1, "intruders": 0}


def test_any_pursuer_may_capture_also_one_that_was_not_dispatched_and_before_any_detection() -> None:
    rules = book()
    state = crossing(rules, "i0", dispatched={"i0": ("p1", 0.5)}).with_state(["p1"], "dispatched")
    verdict = move(rules, state, {"i0": (5, 5), "p0": (5, 5.9)}, {"i0": (5, 5), "p0": (5, 5.9)})
    assert [c.players for c in verdict.calls] == [("i0", "p0")]


def test_of_two_that_come_close_the_first_has_captured_it(rules: PursuitEvasion) -> None:
    before = {"i0": (5, 5), "p0": (7.0, 5.0), "p1": (3.0, 5.0)}
    now = {"i0": (5, 5), "p0": (5.0, 5.0), "p1": (3.5, 5.0)}
    assert move(rules, crossing(rules, "i0"), before, now).calls[0].players == ("i0", "p0")
    before["p1"], now["p1"] = (3.1, 5.0), (4.8, 5.0)
    assert move(rules, crossing(rules, "i0"), before, now).calls[0].players == ("i0", "p0")
    now["p1"] = (5.2, 5.0)
    assert move(rules, crossing(rules, "i0"), before, now).calls[0].players == ("i0", "p1")


def test_of_two_at_the_same_instant_the_lowest_name_has_captured_it_whatever_the_order_of_players() -> None:
    for order in (1, -1):
        rules = PursuitEvasion(SETTINGS, contestants()[::order])
        state = rules.initial().with_state(["i0"], "crossing")
        state = msgspec.structs.replace(state, entered=("i0",))
        verdict = move(
            rules, state, {"i0": (5, 5), "p0": (7, 5), "p1": (3, 5)}, {"i0": (5, 5), "p0": (5, 5), "p1": (5, 5)}
        )
        assert ("i0", "p0") in [c.players for c in verdict.calls]


def test_one_pursuer_captures_two_at_once(rules: PursuitEvasion) -> None:
    now = {"i0": (5, 5), "i1": (5, 6), "p0": (5, 5.5)}
    verdict = move(rules, crossing(rules, "i0", "i1"), now, now)
    assert [c.players for c in verdict.calls[:2]] == [("i0", "p0"), ("i1", "p0")]
    assert verdict.state.points["pursuers"] == 2
    assert verdict.round_over


def test_an_intruder_that_waits_or_is_out_of_play_is_not_captured() -> None:
    rules = book(seed=1)
    now = {"i0": (5, 5), "p0": (5, 5.5), "i1": (-2.0, 3.0)}
    for kind in ("waiting", "captured", "escaped"):
        state = rules.initial().with_state(["i1"], kind)
        verdict = move(rules, state, {**now, "p0": (-2.0, 3.5)}, {**now, "p0": (-2.0, 3.5)}, clock=0.5)
        assert verdict.state.states["i1"] == kind
    assert move(rules, out(crossing(rules, "i0"), "i0"), now, now).state.points["pursuers"] == 0


def test_a_pursuer_that_is_out_captures_nobody(rules: PursuitEvasion) -> None:
    now = {"i0": (5, 5), "p0": (5, 5.5)}
    assert move(rules, out(crossing(rules, "i0"), "p0"), now, now).state.points["pursuers"] == 0


def test_who_is_not_in_the_world_neither_captures_nor_is_captured_nor_escapes(rules: PursuitEvasion) -> None:
    now = field(rules, {"i0": (5, 5), "p0": (5, 5.5)})
    for missing in ("i0", "p0"):
        gone = Observation({n: p for n, p in now.poses.items() if n != missing}, time=10.0)
        assert rules.judge(crossing(rules, "i0"), now, gone, 1.0).state.states["i0"] == "crossing"


def test_who_has_just_come_into_the_world_is_judged_where_it_is(rules: PursuitEvasion) -> None:
    now = field(rules, {"i0": (5, 5), "p0": (5, 5.5)})
    for missing in ("i0", "p0"):
        before = Observation({n: p for n, p in now.poses.items() if n != missing}, time=9.9)
        assert rules.judge(crossing(rules, "i0"), before, now, 1.0).state.states["i0"] == "captured"


# Escapes.


def test_an_intruder_that_was_inside_and_leaves_has_escaped(rules: PursuitEvasion) -> None:
    verdict = move(rules, crossing(rules, "i0"), {"i0": (9.9, 5)}, {"i0": (10.1, 5)})
    assert [c.rule for c in verdict.calls] == ["escape"]
    assert verdict.calls[0].players == ("i0",)
    assert verdict.calls[0].poses[0].x == pytest.approx(10.0)
    assert verdict.state.states["i0"] == "escaped"
    assert rules.score(verdict.state) == {"pursuers": 0, "intruders": 1}


def test_an_intruder_that_comes_in_is_remembered_until_it_leaves(rules: PursuitEvasion) -> None:
    coming = move(rules, crossing(rules, "i0", entered=False), {"i0": (-0.1, 5)}, {"i0": (0.1, 5)})
    assert coming.state.entered == ("i0",)
    assert [c.rule for c in coming.calls] == ["enter"]
    gone = move(rules, coming.state, {"i0": (9.9, 5)}, {"i0": (10.1, 5)})
    assert [c.rule for c in gone.calls] == ["escape"]


def test_a_pose_that_trembles_over_the_border_where_an_intruder_comes_in_is_no_escape(rules: PursuitEvasion) -> None:
    coming = move(rules, crossing(rules, "i0", entered=False), {"i0": (-0.1, 5)}, {"i0": (0.02, 5)})
    back = move(rules, coming.state, {"i0": (0.02, 5)}, {"i0": (-0.03, 5)}, time=10.1)
    assert [c.rule for c in back.calls] == []
    assert back.state.states["i0"] == "crossing"


def test_an_intruder_that_cuts_a_corner_within_a_tick_has_escaped(rules: PursuitEvasion) -> None:
    verdict = move(rules, crossing(rules, "i0", entered=False), {"i0": (-0.1, 0.2)}, {"i0": (0.2, -0.1)})
    assert [c.rule for c in verdict.calls] == ["enter", "escape"], "its course leads to the right, below the area"
    assert (verdict.calls[1].poses[0].x, verdict.calls[1].poses[0].y) == pytest.approx((0.1, 0.0))
    near = move(rules, crossing(rules, "i0", entered=False), {"i0": (-0.2, 0.1)}, {"i0": (0.1, -0.2)})
    assert [c.rule for c in near.calls] == ["missed"], "past the corner"


@pytest.mark.parametrize(("detections", "words"), [(0, "fewer than two"), (1, "fewer than two"), (2, "two or more")])
def test_it_is_an_escape_with_any_number_of_detections_and_the_call_says_which(detections: int, words: str) -> None:
    rules = book()
    state = crossing(rules, "i0", detected={"i0": [9.0 + n for n in range(detections)]})
    verdict = move(rules, state, {"i0": (9.9, 5)}, {"i0": (10.1, 5)})
    assert verdict.calls[0].text == f"i0 escapes after {words} detections"
    assert verdict.state.points["intruders"] == 1


def test_each_ends_once(rules: PursuitEvasion) -> None:
    first = move(rules, crossing(rules, "i0"), {"i0": (9.9, 5)}, {"i0": (10.1, 5)})
    again = move(rules, first.state, {"i0": (10.1, 5)}, {"i0": (10.3, 5)})
    assert again.state.points["intruders"] == 1
    back = move(rules, first.state, {"i0": (10.1, 5), "p0": (9, 5)}, {"i0": (9.5, 5), "p0": (9, 5)})
    assert rules.score(back.state) == {"pursuers": 0, "intruders": 1}


def test_an_intruder_that_left_while_nobody_looked_has_escaped(rules: PursuitEvasion) -> None:
    """After a halt a match does not know where it was before."""
    now = {"i0": (12.0, 5)}
    verdict = move(rules, crossing(rules, "i0"), now, now)
    assert [c.rule for c in verdict.calls] == ["escape"]


# Both, against a judge that moves everybody in small steps.

STEPS = 4000
AREA = ((0.0, 1.0), (3.0, -1.0), (7.0, 0.0), (8.0, 4.0), (4.0, 6.0), (1.0, 5.0))


def crosses(rng: np.random.Generator) -> tuple[Vector, Vector]:
    """A way of up to 4 m in a tick that has something to do with the area."""
    at, bearing, way = rng.uniform((-1, -2), (9, 7)), rng.uniform(-math.pi, math.pi), rng.uniform(0, 4)
    return tuple(at.tolist()), (float(at[0] + way * math.cos(bearing)), float(at[1] + way * math.sin(bearing)))


def along(way: tuple[Vector, Vector]) -> np.ndarray:
    share = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
    return np.array(way[0]) * (1 - share) + np.array(way[1]) * share


def depth_in(points: np.ndarray) -> np.ndarray:
    """How far points are inside of the nearest side of AREA, m; negative outside."""
    depths = []
    for (ax, ay), (bx, by) in zip(AREA, AREA[1:] + AREA[:1], strict=True):
        cross = (bx - ax) * (points[:, 1] - ay) - (by - ay) * (points[:, 0] - ax)
        depths.append(cross / math.dist((ax, ay), (bx, by)))
    return np.min(depths, axis=0)


def small_steps(
    intruder: tuple[Vector, Vector], pursuers: Mapping[str, tuple[Vector, Vector]], *, entered: bool
) -> tuple[str, str, float] | None:
    """What happens, by whom, and at which fraction of the tick; None if it is so close that steps cannot tell.

    The intruder's course leads in the direction of +x.
    """
    way = along(intruder)
    depth = depth_in(way)
    inside = depth >= 0.0
    ahead = depth_in(way[-1] + np.linspace(0.0, 20.0, STEPS)[:, None] * (1.0, 0.0))
    if np.abs(depth[[0, -1]]).min() < 1e-3 or min(abs(depth.max()), abs(ahead.max())) < 5e-3:
        return None
    leaves = math.inf
    if (entered or inside.any()) and ahead.max() < 0.0:
        leaves = (np.flatnonzero(inside)[-1] if inside.any() else 0) / STEPS
    first = {}
    for name, other in pursuers.items():
        gap = np.hypot(*(along(other) - way).T)
        if abs(gap.min() - 1.0) < 5e-3:
            return None
        if gap.min() < 1.0:
            first[name] = int(np.argmax(gap < 1.0)) / STEPS
    order = sorted((at, name) for name, at in first.items())
    if len(order) > 1 and order[1][0] - order[0][0] < 2 / STEPS and order[0][0] > 0.0:
        return None
    if order and abs(order[0][0] - leaves) < 2 / STEPS:
        return None
    if order and order[0][0] < leaves:
        return "capture", order[0][1], order[0][0]
    return ("escape", "", leaves) if leaves < math.inf else ("nothing", "", 0.0)


def test_captures_and_escapes_are_those_that_many_small_steps_find() -> None:
    rng = np.random.default_rng(11)
    rules = book(SETTINGS.model_copy(update={"area": AREA}), starts={"i0": Pose(-2, 2, 0), "i1": Pose(-2, 3, 0)})
    seen: dict[str, int] = {}
    for case in range(900):
        intruder, entered = crosses(rng), bool(rng.integers(2))
        pursuers = {name: crosses(rng) for name in ("p0", "p1", "p2")}
        expected = small_steps(intruder, pursuers, entered=entered)
        if expected is None:
            continue
        before, now = ({"i0": intruder[i], **{n: w[i] for n, w in pursuers.items()}} for i in (0, 1))
        verdict = move(rules, crossing(rules, "i0", entered=entered), before, now)
        calls = [c for c in verdict.calls if c.rule in ("capture", "escape")]
        found = calls[0].rule if calls else "nothing"
        assert (case, found) == (case, expected[0])
        seen[found] = seen.get(found, 0) + 1
        if calls:
            length = math.dist(*intruder)
            x, y = (a + (b - a) * expected[2] for a, b in zip(*intruder, strict=True))
            assert math.dist((calls[0].poses[0].x, calls[0].poses[0].y), (x, y)) < 3 * length / STEPS + 1e-9, case
        if found == "capture":
            assert calls[0].players == ("i0", expected[1]), case
    assert min(seen.values()) > 80, seen
    assert sum(seen.values()) > 600


# Resets.


def test_after_a_capture_and_after_an_escape_the_pursuer_is_called_back_and_the_auction_is_closed() -> None:
    for where, end in (({"i0": (5, 5), "p1": (5, 5.5)}, "captured"), ({"i0": (10.5, 5)}, "escaped")):
        rules = book()
        state = seen_twice(rules, "i0", winner="p0")
        where["p0"] = (3, 3)
        verdict = move(rules, state, where, where)
        assert verdict.state.states["i0"] == end
        assert verdict.state.states["p0"] == "returning", "it drives back to its post"
        assert verdict.state.states["p1"] == "watching"
        assert verdict.state.auctions == {}
        assert verdict.state.dispatched == {}


def test_the_auction_of_the_other_intruder_goes_on(rules: PursuitEvasion) -> None:
    state = seen_twice(rules, "i0", winner="p0")
    both = seen_twice(rules, "i1", winner="p2")
    state = msgspec.structs.replace(
        state.with_state(["p2"], "dispatched").with_state(["i1"], "crossing"),
        auctions={**state.auctions, **both.auctions},
        dispatched={**state.dispatched, **both.dispatched},
        detected={"i0": [1.0, 2.0], "i1": [1.0, 2.0]},
        seen={"i0": 1.0, "i1": 1.0},
    )
    where = {"i0": (10.5, 5), "i1": (5, 3), "p0": (3, 3)}
    verdict = move(rules, state, where, where)
    assert list(verdict.state.auctions) == ["i1"]
    assert verdict.state.dispatched == {"i1": ("p2", 0.8)}
    assert (verdict.state.states["p0"], verdict.state.states["p2"]) == ("returning", "dispatched")


def seen_twice(rules: PursuitEvasion, name: str, *, winner: str) -> State:
    """The state in which a pursuer has been dispatched to an intruder inside the area."""
    evidence = (sighting(4.0, 5.0, 9.0), sighting(4.5, 5.0, 9.5))
    auction = Auction(
        lot=name,
        bidders=tuple(rules.pursuers),
        opened=0.2,
        lasts=0.5,
        bids={winner: 2.0},
        winner=winner,
        evidence=evidence,
    )
    return crossing(
        rules,
        name,
        detected={name: (1.0, 2.0)},
        seen={name: 0.8},
        evidence={name: evidence},
        dispatched={name: (winner, 0.8)},
        auctions={name: auction},
    ).with_state([winner], "dispatched")


def test_a_pursuer_that_has_come_back_to_its_post_and_stands_watches_again(rules: PursuitEvasion) -> None:
    state = rules.initial().with_state(["p0"], "returning")

    def own(now: Observation) -> str:
        return rules.judge(state, now, now, 1.0).state.states["p0"]

    assert own(field(rules)) == "watching"
    assert own(field(rules, {"p0": (1.3, 9.0)})) == "watching"
    assert own(field(rules, {"p0": (1.5, 9.0)})) == "returning"
    assert own(field(rules, moving=["p0"])) == "returning"


# The end of the game.


def ended(state: State, clock: float = 50.0, rules: PursuitEvasion | None = None) -> tuple[bool, list[str]]:
    rules = rules or book()
    now = field(rules, {"i0": (5, 5), "i1": (5, 3)})
    verdict = rules.judge(state, now, now, clock)
    return verdict.round_over, [c.rule for c in verdict.calls]


def test_the_game_ends_when_all_intruders_are_accounted_for(rules: PursuitEvasion) -> None:
    state = rules.initial().with_state(["i0"], "captured").with_state(["i1"], "escaped")
    assert ended(state) == (True, ["all_done"])
    assert not ended(crossing(rules, "i1").with_state(["i0"], "captured"))[0]
    assert not ended(rules.initial().with_state(["i0"], "captured"), clock=0.1)[0], "one still waits"
    assert ended(out(crossing(rules, "i0", "i1"), "i0", "i1")) == (True, ["all_done"]), "who is out is not waited for"


def test_the_game_ends_when_the_timer_ends(rules: PursuitEvasion) -> None:
    assert not ended(crossing(rules, "i0", "i1"), 119.9)[0]
    assert ended(crossing(rules, "i0", "i1"), 120.0) == (True, ["time_up"])


def test_what_happens_in_the_last_tick_counts(rules: PursuitEvasion) -> None:
    state = crossing(rules, "i0").with_state(["i1"], "captured")
    where = {"i0": (10.5, 5)}
    verdict = move(rules, state, where, where, clock=120.0)
    assert verdict.state.points["intruders"] == 1
    assert [c.rule for c in verdict.calls] == ["escape", "all_done"]


def test_the_game_ends_also_when_nobody_detects_anything(rules: PursuitEvasion) -> None:
    match, now = Match(rules), field(rules)
    for i in range(1400):
        at = 0.1 * i
        poses = {
            n: Pose(-2 + 0.05 * max(0.0, at - rules.launches[n]) * 10, p.y, 0.0)
            for n, p in STARTS.items()
            if n in ("i0", "i1")
        }
        now = Observation({**now.poses, **poses}, time=at)
        match.step(0.1, now, [])
        if match.over:
            break
    assert match.winner == "intruders"
    assert match.game.auctions == {}
    assert match.game.points["intruders"] == 2


def test_the_game_ends_also_when_nobody_moves_and_is_a_draw(rules: PursuitEvasion) -> None:
    match, now = Match(rules), field(rules)
    for _ in range(1300):
        match.step(0.1, now, [])
    assert match.winner == DRAW
    assert match.clock == pytest.approx(120.0, abs=0.11), "at most a tick later"


def test_the_game_goes_on_until_the_timer_ends_when_all_pursuers_are_out() -> None:
    state = out(crossing(book(), "i0", "i1"), "p0", "p1", "p2")
    assert ended(state) == (False, [])
    assert ended(state, 120.0)[0]


def test_the_game_ends_when_everybody_is_out(rules: PursuitEvasion) -> None:
    match, now = Match(rules), field(rules)
    match.step(0.1, now, [])
    for name in rules.contestants:
        match.disqualify(name, "it does not report", now)
    match.step(0.1, now, [])
    assert match.over


@pytest.mark.parametrize(
    ("captured", "escaped", "winner"), [(2, 0, "pursuers"), (0, 1, "intruders"), (1, 1, DRAW), (0, 0, DRAW)]
)
def test_who_has_more_points_has_won(rules: PursuitEvasion, captured: int, escaped: int, winner: str) -> None:
    state = msgspec.structs.replace(rules.initial(), points={"pursuers": captured, "intruders": escaped})
    assert rules.next_round(state, field(rules)).winner == winner


def test_the_call_at_the_end_tells_why_the_game_is_over(rules: PursuitEvasion) -> None:
    assert rules.next_round(crossing(rules, "i0", "i1"), field(rules)).why == "i0, i1 had not crossed when play ended"
    done = rules.initial().with_state(["i0"], "captured").with_state(["i1"], "escaped")
    assert rules.next_round(done, field(rules)).why == "all intruders are captured, escaped or out"


# What is published.


def test_no_pose_of_a_pursuer_or_of_an_intruder_in_play_is_published(rules: PursuitEvasion) -> None:
    for stage in Stage:
        for state in (rules.initial(), crossing(rules, "i0", "i1").with_state(["p0"], "dispatched")):
            assert all(s.pose is None for s in rules.statuses(state, stage, field(rules)))


def test_the_pose_of_who_is_out_of_play_is_published() -> None:
    rules = book(intruders=3)
    state = out(rules.initial().with_state(["i0"], "captured").with_state(["i1"], "escaped"), "p2")
    poses = {s.name: s.pose for s in rules.statuses(state, Stage.PLAY_ROUND, field(rules))}
    assert {n for n, p in poses.items() if p is not None} == {"i0", "i1", "p2"}
    assert poses["i0"] == STARTS["i0"]


def test_no_call_tells_the_pose_of_an_intruder_that_goes_on(rules: PursuitEvasion) -> None:
    """A capture and an escape tell where they happened. Of all other calls, only that of the pursuer may be told."""
    state = msgspec.structs.replace(seen_twice(rules, "i0", winner="p0"), dispatched={})
    where = {"i0": (5.25, 5.5), "i1": (3.25, 3.5)}
    now = field(rules, where)
    calls = list(rules.judge(state, now, now, 30.0).calls)
    calls += rules.judge(seen_twice(rules, "i0", winner="p0"), now, now, 30.0).calls
    assert {c.rule for c in calls} >= {"dispatch", "launch", "lost"}
    assert [c.rule for c in calls if any((pose.x, pose.y) in where.values() for pose in c.poses)] == []


def test_the_poses_of_a_call_are_those_of_its_first_players(rules: PursuitEvasion) -> None:
    state = msgspec.structs.replace(seen_twice(rules, "i0", winner="p0"), dispatched={})
    now = field(rules, {"i0": (5, 5), "i1": (10.5, 3.0)})
    calls = list(rules.judge(crossing(rules, "i0", "i1").with_state(["i0"], "captured"), now, now, 30.0).calls)
    calls += rules.judge(state, now, now, 30.0).calls
    assert len(calls) > 3
    for call in calls:
        assert (
            list(call.poses) == [now.poses[name] for name in call.players[: len(call.poses)]] or call.rule == "escape"
        )


def test_what_is_published_does_not_depend_on_where_players_in_play_are(rules: PursuitEvasion) -> None:
    match = Match(rules)
    match.step(0.1, field(rules), [])
    match.step(0.1, field(rules), [])
    here = msgspec.msgpack.encode(match.state(field(rules), estop=False))
    moved = {"p0": (2.0, 2.0), "p1": (4.0, 4.0), "p2": (3.0, 7.0), "i0": (6.0, 6.0), "i1": (7.0, 1.0)}
    there = msgspec.msgpack.encode(match.state(field(rules, moved), estop=False))
    assert here == there


def test_the_area_is_published() -> None:
    (zone,) = book().zones(book().initial())
    assert zone.kind == "area"
    assert zone.region.outline() == list(SETTINGS.area)


def test_the_bodies_are_published_as_large_as_they_are() -> None:
    radii = {s.name: s.radius for s in book().statuses(book().initial(), Stage.PLAY_ROUND, Observation({}))}
    assert radii["p0"] == pytest.approx(math.hypot(0.5, 0.49) / 2)
    assert radii["i0"] == pytest.approx(math.hypot(0.78, 0.64) / 2)


def test_watchers_and_who_waits_stand_still_in_play() -> None:
    rules = book(intruders=3)
    state = crossing(rules, "i0").with_state(["p0"], "dispatched").with_state(["p1"], "returning")
    state = state.with_state(["i2"], "captured")

    def movers(stage: Stage, of: State = state) -> set[str]:
        return {s.name for s in rules.statuses(of, stage, field(rules)) if s.may_move}

    assert movers(Stage.PLAY_ROUND) == {"i0", "p0", "p1"}
    assert movers(Stage.ROUND_OVER) == movers(Stage.GAME_OVER) == set()
    assert movers(Stage.PLAY_ROUND, out(state, "i0", "p0")) == {"p1"}


def test_before_play_everybody_that_is_not_where_it_starts_may_move(rules: PursuitEvasion) -> None:
    """Pursuers drive to their posts by themselves; a person drives the robots of intruders."""
    now = field(rules, {"p1": (5.0, 5.0), "i0": (-3.0, 5.0)})
    statuses = {s.name: s for s in rules.statuses(rules.initial(), Stage.INITIALIZE, now)}
    assert {n for n, s in statuses.items() if s.may_move} == {"p1", "i0"}
    assert {n: s.mark for n, s in statuses.items()} == {
        "p0": STARTS["p0"],
        "p1": STARTS["p1"],
        "p2": STARTS["p2"],
        "i0": None,
        "i1": None,
    }


def test_play_begins_when_all_stand_still_where_they_start(rules: PursuitEvasion) -> None:
    assert rules.obstacles_to_start(rules.initial(), field(rules)) == {}
    away = field(rules, {"i0": (-3.0, 5.0), "p0": (1.0, 7.0)}, moving=["p1"])
    assert rules.obstacles_to_start(rules.initial(), away) == {
        "p0": "is 2.0 m from its mark",
        "p1": "is moving",
        "i0": "is 1.0 m from its mark",
    }


def test_who_is_said_to_have_been_put_on_its_mark_is_put_there(rules: PursuitEvasion) -> None:
    """An intruder was pushed while all lined up. Its start is no secret from the world."""
    match, now = Match(rules), field(rules, {"i0": (-3.0, 5.0)})
    for _ in range(700):
        outcome = match.step(0.1, now, [])
        for call in outcome.calls:
            names = re.findall(r"[ip]\d", call.text) if call.rule == "placed" else []
            assert set(names) <= set(outcome.place), call.text


# Speeds.


def test_all_have_the_top_speed_of_the_slowest_by_default() -> None:
    assert book(speeds={"p1": 0.6}).speed_limits() == dict.fromkeys(["p0", "p1", "p2", "i0", "i1"], 0.6)


def test_a_team_may_be_given_another_top_speed_but_no_robot_is_faster_than_it_can() -> None:
    rules = book(SETTINGS.model_copy(update={"intruder_speed": 0.9}))
    assert rules.speed_limits() == {"p0": 0.7, "p1": 0.7, "p2": 0.7, "i0": 0.9, "i1": 0.9}
    rules = book(SETTINGS.model_copy(update={"pursuer_speed": 5.0}), speeds={"p1": 2.0})
    assert rules.speed_limits() == {"p0": 0.7, "p1": 2.0, "p2": 0.7, "i0": 0.7, "i1": 0.7}


# Set-ups that cannot be played.


def refused(**others: object) -> str:
    with pytest.raises(ConfigError) as error:
        book(**others)
    return str(error.value)


def test_without_a_pursuer_or_an_intruder_there_is_no_match() -> None:
    assert refused(pursuers=0) == "players: expected at least one pursuer, got none"
    assert refused(intruders=0) == "players: expected at least one intruder, got none"
    with pytest.raises(ConfigError, match=r"(?s)at least one pursuer.*at least one intruder"):
        PursuitEvasion(SETTINGS, [])


@pytest.mark.parametrize("start", [(5.0, 5.0), (0.0, 5.0), (10.0, 10.0), (1e-9, 5.0)])
def test_an_intruder_that_starts_inside_or_on_the_border_is_refused(start: Vector) -> None:
    told = refused(starts={"i1": Pose(*start, 0.0)})
    assert "i1 is an intruder and starts outside the surveillance area" in told
    assert "i0" not in told


@pytest.mark.parametrize(
    ("x", "y", "degrees"),
    [
        (-2, 5, 180),
        (-2, 5, 90),
        (-2, 5, 70),
        (-2, 12, 0),
        (12, 5, 0),
        (-1, 11, 45),
        (-2, -2, 90),
        (-2, 10.001, 0),
        (-1, 0.999, -45),
    ],
)
def test_an_intruder_that_never_comes_in_is_refused(x: float, y: float, degrees: float) -> None:
    told = refused(starts={"i1": Pose(x, y, math.radians(degrees))})
    assert f"i1 drives straight on from ({x:g}, {y:g}) with heading {degrees:g} degrees and never comes" in told


@pytest.mark.parametrize("x", [-2.0, -500.0, -9_990.0, -1.2e4])
def test_an_intruder_that_comes_from_far_away_is_accepted(x: float) -> None:
    assert book(starts={"i1": Pose(x, 5.0, 0.0)}).launches["i1"] >= 0.0


def test_every_reason_is_given_at_once() -> None:
    told = refused(pursuers=0, starts={"i0": Pose(5, 5, 0), "i1": Pose(-2, 5, math.pi)})
    assert "at least one pursuer" in told
    assert "i0 is an intruder and starts outside" in told
    assert "i1 drives straight on" in told


@given(st.floats(-15, 25), st.floats(-15, 25), st.floats(-math.pi, math.pi))
def test_who_is_refused_is_who_does_not_come_in_when_driven_step_by_step(x: float, y: float, theta: float) -> None:
    way = np.linspace(0.0, 60.0, 6001)[:, None] * np.array([math.cos(theta), math.sin(theta)]) + (x, y)
    depth = np.minimum(way, 10.0 - way).min(axis=1)
    if abs(depth.max()) < 0.02 or abs(depth[0]) < 1e-6:
        return
    intruder = Contestant(name="i0", role="intruder", start=Pose(x, y, theta), size=(0.5, 0.5), v_max=1.0)
    playable = depth[0] < 0.0 < depth.max()
    try:
        PursuitEvasion(SETTINGS, [contestants()[0], intruder])
    except ConfigError:
        assert not playable
    else:
        assert playable


# Officials.


def test_an_official_sets_scores_and_states_of_intruders(rules: PursuitEvasion) -> None:
    state = seen_twice(rules, "i0", winner="p0")
    assert rules.overrule(state, OfficialAction.SET_SCORE, "intruders", "3").points["intruders"] == 3
    assert rules.overrule(state, OfficialAction.SET_SCORE, "pursuers", "0").points["pursuers"] == 0
    taken = rules.overrule(state, OfficialAction.SET_STATE, "i0", "captured")
    assert (taken.states["i0"], taken.states["p0"]) == ("captured", "returning")
    assert taken.auctions == taken.dispatched == {}


@pytest.mark.parametrize(
    ("action", "subject", "value"),
    [
        (OfficialAction.SET_STATE, "i0", "asleep"),
        (OfficialAction.SET_STATE, "i0", ""),
        (OfficialAction.SET_STATE, "p0", "watching"),
        (OfficialAction.SET_STATE, "nobody", "captured"),
        (OfficialAction.SET_ROLE, "i0", "pursuer"),
        (OfficialAction.SET_SCORE, "pursuers", "-1"),
        (OfficialAction.SET_SCORE, "pursuers", ""),
        (OfficialAction.SET_SCORE, "pursuers", "1.5"),
        (OfficialAction.SET_SCORE, "pursuers", "²"),
        (OfficialAction.SET_SCORE, "minnows", "1"),
    ],
)
def test_an_impossible_decision_is_refused_with_what_is_possible(
    action: OfficialAction, subject: str, value: str
) -> None:
    rules = book()
    with pytest.raises(ConfigError, match="expected a whole number" if subject == "pursuers" else None):
        rules.overrule(rules.initial(), action, subject, value)


@pytest.mark.parametrize("points", ["1000000", "9" * 30])
def test_a_score_that_is_too_large_is_refused(rules: PursuitEvasion, points: str) -> None:
    with pytest.raises(ConfigError, match="expected a whole number from 0 to 999999"):
        rules.overrule(rules.initial(), OfficialAction.SET_SCORE, "pursuers", points)


def test_the_largest_score_can_be_told_in_a_message(rules: PursuitEvasion) -> None:
    state = rules.overrule(rules.initial(), OfficialAction.SET_SCORE, "pursuers", "999999")
    score = rules.score(state)
    assert score["pursuers"] == 999_999
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(score)) == score


def test_an_intruder_that_an_official_lets_wait_again_begins_anew(rules: PursuitEvasion) -> None:
    """An official has put it back to its start. It has not been inside, and nobody has seen it."""
    state = rules.overrule(seen_twice(rules, "i0", winner="p0"), OfficialAction.SET_STATE, "i0", "waiting")
    verdict = rules.judge(state, field(rules), field(rules), 5.0)
    assert [c.rule for c in verdict.calls] == ["launch"]
    assert verdict.state.states["i0"] == "crossing"


def test_a_wrong_escape_that_an_official_undoes_does_not_happen_again_where_it_stands(rules: PursuitEvasion) -> None:
    where = {"i0": (10.5, 5)}
    state = move(rules, crossing(rules, "i0"), where, where).state
    state = rules.overrule(state, OfficialAction.SET_STATE, "i0", "crossing")
    back = {"i0": (9.5, 5)}
    assert move(rules, state, back, back).state.states["i0"] == "crossing", "it was put back into the area"


# The journal.


@given(st.integers(0, 10_000))
def test_the_state_survives_the_journal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rules = book()
    state = seen_twice(rules, "i0", winner="p0").with_state(["i1"], "crossing")
    for i in range(5):
        at = 10.0 + 0.1 * i
        where = {name: tuple(rng.uniform(0, 10, 2).tolist()) for name in rules.contestants}
        seen = [("p1", sighting(*where["i1"], at))]
        state = move(rules, state, where, where, time=at, clock=at, seen=seen).state
        assert msgspec.json.decode(msgspec.json.encode(state), type=State) == state
        assert msgspec.convert(msgspec.to_builtins(state), State) == state


def test_an_intruder_that_does_not_head_along_its_course_keeps_the_game_from_beginning(rules: PursuitEvasion) -> None:
    now = field(rules)
    turned = replace(now, poses={**now.poses, "i0": Pose(-2.0, 5.0, 0.3)})
    assert rules.obstacles_to_start(rules.initial(), turned) == {"i0": "is turned 17 degrees away from its course"}
    slightly = replace(now, poses={**now.poses, "i0": Pose(-2.0, 5.0, 0.1), "p0": Pose(1.0, 9.0, 2.0)})
    assert rules.obstacles_to_start(rules.initial(), slightly) == {}, "the heading of a pursuer does not matter"


def test_an_intruder_that_an_official_lets_cross_again_has_not_left_the_area(rules: PursuitEvasion) -> None:
    state = crossing(rules, "i0", detected={"i0": [1.0, 2.0]}).with_state(["i0"], "captured")
    state = rules.overrule(state, OfficialAction.SET_STATE, "i0", "crossing")
    verdict = move(rules, state, {"i0": (-2.0, 5.0)}, {"i0": (-1.9, 5.0)})
    assert verdict.calls == []
    assert verdict.state.detections("i0") == 0


def test_no_decision_about_an_intruder_tells_where_it_is(rules: PursuitEvasion) -> None:
    match, now = Match(rules), field(rules)
    said = [
        decide(match, Official(action=action, by="o", subject="i0", value=value), now, [])
        for action, value in (
            (OfficialAction.DISQUALIFY, None),
            (OfficialAction.REINSTATE, None),
            (OfficialAction.PLACE, "-2.0 5.0 0.0"),
        )
    ]
    calls = [call for outcome in said for call in (*outcome.calls, *filter(None, [outcome.once_placed]))]
    assert len(calls) == 3
    assert [call.poses for call in calls] == [(), (), ()]
    assert [call.text for call in calls if re.search(r"\d\.\d", call.text)] == []


def test_who_tells_of_more_robots_at_once_than_a_scan_can_show_is_not_believed(rules: PursuitEvasion) -> None:
    """Otherwise guesses all over the field would tell where an intruder is."""
    state, place = crossing(rules, "i0"), {"i0": (5.0, 5.0)}
    grid = [("p0", sighting(0.5 + x, 0.5 + y, 9.9)) for x in range(10) for y in range(10)]
    assert move(rules, state, place, place, seen=grid).state.detections("i0") == 0
    few = [("p0", sighting(5.0, 5.0, 9.9))] * 8
    assert move(rules, state, place, place, seen=few).state.detections("i0") == 1
