"""The rules of Sharks and Minnows, sentence by sentence."""

import math
from collections.abc import Mapping

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs
from pydantic import ValidationError

from vrg.bus.messages import OfficialAction, Stage
from vrg.coordinator.match import Match
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Contestant, Disqualification, Observation, Verdict
from vrg.errors import ConfigError
from vrg.games.sharks_and_minnows.proof import prove
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows, State
from vrg.games.sharks_and_minnows.settings import Settings
from vrg.types import Pose

SIZE = (0.5, 0.5)
SETTINGS = Settings(x=(0, 10), y=(0, 20), zone_depth=3)
TWO_PASSES = SETTINGS.model_copy(update={"passes": 2})


def contestants(sharks: int = 1, minnows: int = 4) -> list[Contestant]:
    """Sharks s0... in a row at the low end, minnows m0... at the high end."""
    made = []
    for role, number, y in (("shark", sharks, 1.5), ("minnow", minnows, 18.5)):
        for i in range(number):
            start = Pose(1.0 + 1.5 * i, y, 0.0)
            made.append(Contestant(name=f"{role[0]}{i}", role=role, start=start, size=SIZE, v_max=0.7))
    return made


def book(settings: Settings = SETTINGS, **numbers: int) -> SharksAndMinnows:
    return SharksAndMinnows(settings, contestants(**numbers))


def field(rules: SharksAndMinnows, moved: Mapping[str, tuple[float, float]] = {}) -> Observation:
    """Everybody at the start, but for those who have moved."""
    poses = {c.name: c.start for c in rules.contestants.values()}
    return Observation({**poses, **{n: Pose(x, y, 0.0) for n, (x, y) in moved.items()}})


@pytest.fixture
def rules() -> SharksAndMinnows:
    """The rule book of one shark and four minnows."""
    return book()


def judge(rules: SharksAndMinnows, before: Observation, now: Observation, state: State | None = None) -> Verdict[State]:
    return rules.judge(state or rules.initial(), before, now, 1.0)


def still(
    rules: SharksAndMinnows, moved: Mapping[str, tuple[float, float]], state: State | None = None
) -> Verdict[State]:
    now = field(rules, moved)
    return judge(rules, now, now, state)


@pytest.mark.parametrize(("sharks", "minnows", "passes"), [(1, 6, 2), (1, 3, 1), (1, 5, 2), (2, 6, 2), (2, 7, 2)])
def test_passes_are_half_the_difference_rounded_down(sharks: int, minnows: int, passes: int) -> None:
    assert book(sharks=sharks, minnows=minnows).rounds == passes


@pytest.mark.parametrize(("sharks", "minnows"), [(1, 2), (2, 3), (3, 3), (4, 1)])
def test_less_than_one_pass_is_refused(sharks: int, minnows: int) -> None:
    with pytest.raises(ConfigError, match="at least two minnows more than sharks"):
        book(sharks=sharks, minnows=minnows)


def test_a_match_without_sharks_is_refused() -> None:
    with pytest.raises(ConfigError, match="at least one shark"):
        book(sharks=0, minnows=4)


def test_every_reason_is_given_at_once() -> None:
    bad = [
        Contestant(name="s0", role="shark", start=Pose(1, 10, 0), size=SIZE, v_max=1),
        Contestant(name="m0", role="minnow", start=Pose(1, 25, 0), size=SIZE, v_max=1),
    ]
    with pytest.raises(ConfigError) as error:
        SharksAndMinnows(SETTINGS, bad)
    text = str(error.value)
    assert "at least two minnows more than sharks" in text
    assert "s0 is a shark and starts in the zone" in text
    assert "m0 starts at (1, 25), out of bounds" in text


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"x": (10, 0)}, "low border first"),
        ({"zone_depth": 10}, "do not fit"),
        ({"zone_depth": 0}, "greater than 0"),
        ({"tag_distance": math.nan}, "finite"),
        ({"passes": 0}, "greater than or equal to 1"),
        ({"depth": 3}, "Extra inputs"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changed: dict[str, object], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        Settings.model_validate({"x": (0, 10), "y": (0, 20), "zone_depth": 3} | changed)


Moved = dict[str, tuple[float, float]]
Calls = list[tuple[str, ...]]
TAG, OVER = ("tag", "m0", "s0"), ("pass_over",)
HOME: Moved = {"m0": (1.0, 2.0), "m1": (3.0, 2.0), "m2": (5.0, 2.0), "m3": (7.0, 2.0)}
LOOKS: dict[str, tuple[list[str], Moved, Calls]] = {
    "a minnow within reach of a shark": ([], {"s0": (5, 10), "m0": (5.79, 10)}, [TAG]),
    "a minnow just out of reach": ([], {"s0": (5, 10), "m0": (5.81, 10)}, []),
    "a minnow in the end zone": ([], {"s0": (5, 2.5), "m0": (5, 2.0)}, []),
    "a minnow on the border of the end zone": ([], {"s0": (5, 3.5), "m0": (5, 3.0)}, []),
    "a minnow in the zone that minnows come from": ([], {"s0": (0.9, 18.0)}, [TAG]),
    "an inactive shark": (["s0"], {"s0": (5, 10), "m0": (5.5, 10)}, []),
    "a minnow that is inactive already": (["m0"], {"s0": (5, 10), "m0": (5.5, 10)}, []),
    "two minnows at once": (
        [], {"s0": (5, 10), "m0": (5.6, 10), "m1": (4.4, 10)}, [TAG, ("tag", "m1", "s0")],
    ),
    "team mates": ([], {"m0": (5, 10), "m1": (5.5, 10)}, []),
    "a shark out of bounds": ([], {"s0": (-0.1, 10)}, [("out_of_bounds", "s0")]),
    "a minnow on the border of the field": ([], {"m0": (10.0, 10)}, []),
    "all at home": ([], {**HOME, "s0": (9, 15)}, [OVER]),
    "one still on its way": ([], {**HOME, "m3": (7.0, 3.1), "s0": (9, 15)}, []),
    "all at home that are active": (["m3"], {**HOME, "m3": (7.0, 10), "s0": (9, 15)}, [OVER]),
    "a tag in the tick that ends the pass": (
        [], {**HOME, "m3": (7.0, 10), "s0": (7.5, 10)}, [("tag", "m3", "s0"), OVER],
    ),
    "without an active shark one still has to cross": (["s0"], {**HOME, "m3": (7.0, 10), "s0": (7.3, 10)}, []),
    "without an active shark all at home": (["s0"], {**HOME, "s0": (9, 15)}, [OVER]),
    "the last minnow that leaves together with the last shark": (
        ["m1", "m2", "m3"], {"s0": (-0.1, 10.0), "m0": (10.1, 10.0)},
        [("out_of_bounds", "m0"), ("out_of_bounds", "s0"), OVER],
    ),
    "all out of bounds at once": (
        [], {name: (-0.1, 10.0 + i) for i, name in enumerate(("m0", "m1", "m2", "m3", "s0"))},
        [*(("out_of_bounds", name) for name in ("m0", "m1", "m2", "m3", "s0")), OVER],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("inactive", "moved", "expected"), LOOKS.values(), ids=LOOKS)
def test_what_is_called_at_one_look(inactive: list[str], moved: Moved, expected: Calls) -> None:
    rules = book()
    begun = rules.initial().with_state(inactive, "inactive")
    verdict = still(rules, moved, begun)
    called = [(call.rule, *(call.players if call.rule != "pass_over" else ())) for call in verdict.calls]
    assert sorted(called) == sorted(expected)
    gone = [call[1] for call in expected if call != OVER]
    assert verdict.state.states == begun.with_state(gone, "inactive").states
    assert verdict.state.roles == begun.roles, "whoever is out becomes a shark only when the pass is over"
    home = [name for name, (x, y) in moved.items() if y <= 3 and verdict.state.states[name] == "active"]
    points = {"sharks": sum(name[0] == "m" for name in gone), "minnows": len(home) if OVER in expected else 0}
    assert (verdict.state.points, verdict.round_over) == (points, OVER in expected)
    if OVER in expected and not home:
        assert rules.next_round(verdict.state, field(rules, moved)).winner == "sharks"


def test_two_sharks_that_tag_at_the_same_instant_are_both_named() -> None:
    verdict = still(book(sharks=2, minnows=4), {"s0": (5, 10), "s1": (6.2, 10), "m0": (5.6, 10)})
    assert verdict.calls[0].players == ("m0", "s0", "s1")


@pytest.mark.parametrize(
    ("before", "now", "gone"),
    [
        pytest.param({"m0": (9.9, 10)}, {"m0": (9.9, 9)}, [], id="it was seen inside only"),
        pytest.param(
            {"s0": (9.9, 10), "m0": (9.4, 11.2)}, {"s0": (10.3, 11.2), "m0": (9.4, 11.2)}, ["s0"],
            id="a shark that left before it came near",
        ),
        pytest.param(
            {"s0": (9.5, 10), "m0": (9.5, 10.75)}, {"s0": (10.2, 10), "m0": (9.5, 10.75)}, ["m0", "s0"],
            id="a shark that tags and then leaves",
        ),
    ],
)  # fmt: skip
def test_who_is_out_after_a_tick_on_the_way(before: Moved, now: Moved, gone: list[str]) -> None:
    rules = book()
    verdict = judge(rules, field(rules, before), field(rules, now))
    assert [name for name, state in sorted(verdict.state.states.items()) if state == "inactive"] == gone


def test_a_fast_minnow_does_not_tunnel_past_a_shark(rules: SharksAndMinnows) -> None:
    before = field(rules, {"s0": (5, 10), "m0": (5.7, 12)})
    now = field(rules, {"s0": (5, 10), "m0": (5.7, 8)})
    verdict = judge(rules, before, now)
    assert verdict.state.states["m0"] == "inactive"
    assert 10 < verdict.calls[0].poses[0].y < 11, "the call tells where it happened"


def test_a_minnow_out_of_bounds_becomes_inactive(rules: SharksAndMinnows) -> None:
    verdict = judge(rules, field(rules, {"m0": (9.9, 10)}), field(rules, {"m0": (10.1, 10)}))
    assert verdict.state.states["m0"] == "inactive"
    assert verdict.calls[0].rule == "out_of_bounds"
    assert verdict.calls[0].poses[0].x == pytest.approx(10.0)


def test_minnows_win_when_the_passes_are_used_up_and_one_is_left() -> None:
    rules = book(minnows=3)
    home = {k: HOME[k] for k in ("m0", "m1", "m2")} | {"s0": (9, 15)}
    verdict = still(rules, home)
    assert verdict.round_over
    after = rules.next_round(verdict.state, field(rules, home))
    assert after.winner == "minnows"
    assert after.why.startswith("a minnow is left after the last pass")


def test_sharks_win_when_no_minnow_is_left_also_in_the_first_pass(rules: SharksAndMinnows) -> None:
    state = rules.initial().with_state(["m0", "m1", "m2"], "inactive")
    verdict = still(rules, {"s0": (5, 10), "m3": (5.5, 10)}, state)
    assert verdict.round_over
    assert rules.next_round(verdict.state, field(rules)).winner == "sharks"


def test_an_official_who_saves_the_last_minnow_changes_the_end() -> None:
    rules = book(TWO_PASSES)
    state = rules.initial().with_state(["m0", "m1", "m2", "m3"], "inactive")
    assert rules.next_round(state, field(rules)).winner == "sharks"
    saved = rules.overrule(state, OfficialAction.SET_STATE, "m3", "active")
    assert rules.next_round(saved, field(rules)).winner is None


def test_between_passes_inactive_players_become_sharks_and_the_ends_swap() -> None:
    rules = book(TWO_PASSES)
    state = rules.initial().with_state(["m3", "s0"], "inactive")
    now = field(rules, {**HOME, "m3": (7, 10), "s0": (9, 15)})
    after = rules.next_round(state, now)
    assert after.state.roles == {"s0": "shark", "m0": "minnow", "m1": "minnow", "m2": "minnow", "m3": "shark"}
    assert set(after.state.states.values()) == {"active"}
    assert after.state.round == 2
    assert after.state.goal == "high"
    safe = next(z for z in rules.zones(after.state) if z.kind == "safe")
    assert safe.region.bounds[1::2] == (17, 20)


def test_after_a_pass_everybody_lines_up_at_its_own_end_in_bounds_and_apart() -> None:
    rules = book(minnows=6)
    now = field(rules, {f"m{i}": (1.2 * i + 1, 2.0) for i in range(6)} | {"m5": (5, 11), "s0": (9, 15)})
    state = rules.initial().with_state(["m5"], "inactive")
    marks = rules.next_round(state, now).state.marks
    assert all(marks[f"m{i}"].y < 3 for i in range(5))
    assert all(marks[n].y > 17 for n in ("s0", "m5"))
    assert all(0 < mark.x < 10 for mark in marks.values())
    places = [(mark.x, mark.y) for mark in marks.values()]
    assert all(math.dist(a, b) > 0.8 for i, a in enumerate(places) for b in places[:i])
    assert all(mark.theta > 0 for n, mark in marks.items() if n in ("m0", "m1")), "facing the middle"


def test_in_the_second_pass_minnows_are_safe_at_the_other_end() -> None:
    rules = book(TWO_PASSES)
    state = rules.next_round(rules.initial(), field(rules)).state
    verdict = still(rules, {"m0": (5, 18), "m1": (5, 2.0), "s0": (5, 2.4)}, state)
    assert verdict.state.states["m0"] == "active"
    assert verdict.state.states["m1"] == "inactive"


def test_what_keeps_a_round_from_starting_is_said_in_words(rules: SharksAndMinnows) -> None:
    poses = dict(field(rules, {"m1": (5, 10)}).poses)
    del poses["m2"]
    reasons = rules.obstacles_to_start(rules.initial(), Observation(poses, frozenset({"s0"})))
    assert reasons == {"s0": "is moving", "m1": "is 8.9 m from its mark", "m2": "is not in the world"}


def test_positions_and_roles_are_public(rules: SharksAndMinnows) -> None:
    statuses = rules.statuses(rules.initial(), Stage.PLAY_ROUND, field(rules))
    assert all(s.pose is not None for s in statuses)
    assert [s.role for s in statuses] == ["shark", "minnow", "minnow", "minnow", "minnow"]


def test_only_active_players_may_move_and_only_in_play(rules: SharksAndMinnows) -> None:
    state = rules.initial().with_state(["m0"], "inactive")

    def may_move(stage: Stage) -> dict[str, bool]:
        return {s.name: s.may_move for s in rules.statuses(state, stage, field(rules))}

    assert may_move(Stage.PLAY_ROUND) == {"s0": True, "m0": False, "m1": True, "m2": True, "m3": True}
    assert not any(may_move(Stage.ROUND_OVER).values())
    assert not any(may_move(Stage.GAME_OVER).values())


def test_before_a_round_players_drive_to_their_marks_and_are_held_there(rules: SharksAndMinnows) -> None:
    on_the_way = field(rules, {"m0": (5, 10), "m1": (2.5, 18.0)})
    statuses = rules.statuses(rules.initial(), Stage.INITIALIZE, on_the_way)
    assert {s.name: s.may_move for s in statuses} == {"s0": False, "m0": True, "m1": True, "m2": False, "m3": False}


def test_teams_stay_what_they_were_at_the_start() -> None:
    rules = book(TWO_PASSES)
    state = rules.next_round(rules.initial().with_state(["m0"], "inactive"), field(rules)).state
    statuses = {s.name: s for s in rules.statuses(state, Stage.PLAY_ROUND, field(rules))}
    assert (statuses["m0"].role, statuses["m0"].team) == ("shark", "minnows")


def test_speeds_are_seeded_and_within_their_bounds() -> None:
    limits = SharksAndMinnows(SETTINGS, contestants(), seed=3).speed_limits()
    assert limits == SharksAndMinnows(SETTINGS, contestants(), seed=3).speed_limits()
    assert limits != SharksAndMinnows(SETTINGS, contestants(), seed=4).speed_limits()
    assert all(0.6 * 0.7 <= v <= 0.7 for v in limits.values())
    assert len(set(limits.values())) == len(limits)


def test_speeds_do_not_depend_on_the_order_of_the_file() -> None:
    turned = SharksAndMinnows(SETTINGS, contestants()[::-1])
    assert turned.speed_limits() == book().speed_limits()


def test_a_pass_ends_by_default_after_three_times_what_the_slowest_may_need_for_the_field() -> None:
    rules = book()
    limit = 3 * 20.0 / (0.6 * 0.7)
    now = field(rules)
    assert rules.judge(rules.initial(), now, now, limit - 0.1).calls == []
    verdict = rules.judge(rules.initial(), now, now, limit + 0.1)
    assert [call.rule for call in verdict.calls] == [*["pass_limit"] * 4, "pass_over"]
    assert rules.next_round(verdict.state, now).winner == "sharks"


def test_a_pass_limit_of_0_is_none() -> None:
    rules = book(SETTINGS.model_copy(update={"pass_limit": 0.0}))
    now = field(rules)
    assert rules.judge(rules.initial(), now, now, 1e6).calls == []


def test_one_against_one_is_played_if_the_passes_are_said() -> None:
    rules = book(SETTINGS.model_copy(update={"passes": 1}), sharks=1, minnows=1)
    assert rules.rounds == 1
    with pytest.raises(ConfigError, match="expected at least one minnow, got none"):
        book(SETTINGS.model_copy(update={"passes": 1}), sharks=1, minnows=0)


def test_more_robots_than_can_line_up_are_refused() -> None:
    narrow = Settings(x=(0, 4), y=(0, 20), zone_depth=1)
    players = [
        Contestant(name=f"{role[0]}{i}", role=role, start=Pose(1.0 + 0.1 * i, y, 0.0), size=SIZE, v_max=0.7)
        for role, number, y in (("shark", 2, 0.5), ("minnow", 9, 19.5))
        for i in range(number)
    ]
    with pytest.raises(ConfigError, match="end zones in which 11 robots can line up without touching"):
        SharksAndMinnows(narrow, players)
    assert SharksAndMinnows(narrow, [players[0], *players[2:5]]).rounds == 1


def test_a_disqualified_player_is_out_and_nobody_scores_by_it() -> None:
    rules = book(TWO_PASSES)
    out = {"m3": Disqualification(why="x"), "s0": Disqualification(why="y")}
    state = msgspec.structs.replace(rules.initial(), disqualified=out)
    where = {**HOME, "m3": (7.0, 10), "s0": (7.3, 10)}
    verdict = still(rules, where, state)
    assert verdict.round_over, "nobody waits for it, and it tags nobody"
    assert (verdict.state.points["sharks"], verdict.state.points["minnows"]) == (0, 3)
    after = rules.next_round(verdict.state, field(rules, where)).state
    assert not rules.judge(after, field(rules, where), field(rules, where), 1.0).state.active("shark"), "still out"
    assert [c.players for c in rules.next_round(verdict.state, field(rules, where)).calls] == []
    back = rules.next_round(msgspec.structs.replace(verdict.state, disqualified={}), field(rules, where)).state
    assert (back.roles["m3"], back.states["m3"]) == ("shark", "active"), "like any other that was out"


def test_no_mark_is_where_a_robot_stands_that_nobody_drives_away() -> None:
    rules = book(TWO_PASSES)
    free = rules.next_round(rules.initial(), field(rules, HOME)).state.marks
    out = {"m3": Disqualification(why="x")}
    state = msgspec.structs.replace(rules.initial(), disqualified=out)
    now = field(rules, {**HOME, "m3": (free["m1"].x, free["m1"].y)})
    marks = rules.next_round(state, Observation(now.poses, physical=frozenset({"m3"}))).state.marks
    taken = now.poses["m3"]
    others = [marks[name] for name in ("m0", "m1", "m2")]
    assert all(math.dist((mark.x, mark.y), (taken.x, taken.y)) > math.hypot(*SIZE) for mark in others)


@given(st.integers(2, 24), st.integers(1, 20), st.floats(4.0, 30.0), st.floats(1.0, 6.0))
def test_marks_never_collide_in_a_match_that_is_accepted(minnows: int, sharks: int, width: float, depth: float) -> None:
    settings = Settings(x=(0, width), y=(0, 40), zone_depth=depth, passes=2)
    made = [
        Contestant(
            name=f"{role[0]}{i:02d}",
            role=role,
            start=Pose(width * (i + 1) / (number + 2), y, 0.0),
            size=SIZE,
            v_max=0.7,
        )
        for role, number, y in (("shark", sharks, 0.5), ("minnow", minnows, 39.5))
        for i in range(number)
    ]
    try:
        rules = SharksAndMinnows(settings, made)
    except ConfigError:
        return  # what is refused is another test's
    places = [(mark.x, mark.y) for mark in rules.next_round(rules.initial(), field(rules)).state.marks.values()]
    assert all(math.dist(a, b) >= math.hypot(*SIZE) for i, a in enumerate(places) for b in places[:i])


def test_with_a_pass_limit_late_minnows_are_out() -> None:
    rules = book(SETTINGS.model_copy(update={"pass_limit": 60.0}))
    now = field(rules, {**HOME, "m3": (7, 10)})
    assert rules.judge(rules.initial(), now, now, 59.9).calls == []
    verdict = rules.judge(rules.initial(), now, now, 60.0)
    assert [f.rule for f in verdict.calls] == ["pass_limit", "pass_over"]
    assert verdict.state.states["m3"] == "inactive"


def test_with_a_pass_limit_a_minnow_that_the_world_does_not_report_is_late_too() -> None:
    rules = book(SETTINGS.model_copy(update={"pass_limit": 60.0}))
    before = field(rules, HOME)
    now = Observation({name: pose for name, pose in before.poses.items() if name != "m3"})
    verdict = rules.judge(rules.initial(), before, now, 60.0)
    late, over = verdict.calls
    assert (late.rule, late.players, late.poses) == ("pass_limit", ("m3",), ())
    assert (over.rule, verdict.round_over) == ("pass_over", True)
    case = Case(structs.replace(late, clock=60.0), rules.initial(), before, now)
    assert all(measure.holds for measure in prove(rules, case))


def test_an_official_overrules_a_call(rules: SharksAndMinnows) -> None:
    state = rules.initial().with_state(["m0"], "inactive")
    assert rules.overrule(state, OfficialAction.SET_STATE, "m0", "active").states["m0"] == "active"
    assert rules.overrule(state, OfficialAction.SET_ROLE, "m0", "shark").roles["m0"] == "shark"
    assert rules.score(rules.overrule(state, OfficialAction.SET_SCORE, "sharks", "5")) == {"sharks": 5, "minnows": 0}


@pytest.mark.parametrize("passes", [0, 1])
def test_with_another_role_a_player_lines_up_at_the_end_of_that_role_beside_the_others(passes: int) -> None:
    rules = book(TWO_PASSES)
    state = rules.initial()
    for _ in range(passes):
        state = rules.next_round(state.with_state(["m0"], "inactive"), field(rules)).state
    for name in ("m0", "m1", "s0"):
        for role in ("shark", "minnow"):
            state = rules.overrule(state, OfficialAction.SET_ROLE, name, role)
            mark = state.marks[name]
            assert rules.safe_zone(state).contains(mark.x, mark.y) is (role == "shark"), "a minnow has all to cross"
            places = [(mark.x, mark.y) for mark in state.marks.values()]
            assert all(math.dist(a, b) > math.hypot(*SIZE) for i, a in enumerate(places) for b in places[:i])
    assert rules.overrule(state, OfficialAction.SET_ROLE, "s0", "minnow") == state, "the role that it has"


@pytest.mark.parametrize(("out", "winner"), [(3, "minnows"), (4, "sharks")])
def test_a_minnow_that_is_disqualified_after_the_last_pass_is_not_left(out: int, winner: str) -> None:
    rules = book(SETTINGS.model_copy(update={"passes": 1}))
    match, home = Match(rules), field(rules, HOME)
    match.step(0.1, field(rules), [])
    match.step(0.1, home, [])
    assert match.stage is Stage.ROUND_OVER
    for name in list(HOME)[:out]:
        match.disqualify(name, "it has pushed", home, by_official=True)
    while not match.over:
        match.step(0.5, home, [])
    assert match.winner == winner


@pytest.mark.parametrize(
    ("action", "subject", "value"),
    [
        (OfficialAction.SET_STATE, "m0", "asleep"),
        (OfficialAction.SET_ROLE, "m0", "whale"),
        (OfficialAction.SET_ROLE, "nobody", "shark"),
        (OfficialAction.SET_SCORE, "sharks", "-1"),
        (OfficialAction.SET_SCORE, "whales", "1"),
    ],
)
def test_an_impossible_decision_is_refused_with_what_is_possible(
    action: OfficialAction, subject: str, value: str
) -> None:
    rules = book()
    with pytest.raises(ConfigError, match="expected"):
        rules.overrule(rules.initial(), action, subject, value)


places = st.tuples(st.floats(-1, 11), st.floats(-1, 21))
layouts = st.fixed_dictionaries(dict.fromkeys(("s0", "s1", "m0", "m1", "m2", "m3"), places))


@given(layouts, layouts, st.permutations(range(6)))
def test_the_order_of_players_decides_nothing(
    before: dict[str, tuple[float, float]], now: dict[str, tuple[float, float]], order: list[int]
) -> None:
    one = book(sharks=2, minnows=4)
    people = contestants(sharks=2, minnows=4)
    other = SharksAndMinnows(SETTINGS, [people[i] for i in order])
    verdicts = [judge(r, field(r, before), field(r, now)) for r in (one, other)]
    assert verdicts[0].state.states == verdicts[1].state.states
    assert {(f.rule, f.players) for f in verdicts[0].calls} == {(f.rule, f.players) for f in verdicts[1].calls}


@given(layouts, layouts)
def test_judging_never_makes_anybody_active(
    before: dict[str, tuple[float, float]], now: dict[str, tuple[float, float]]
) -> None:
    rules = book(sharks=2, minnows=4)
    state = rules.initial().with_state(["m0", "s1"], "inactive")
    after = judge(rules, field(rules, before), field(rules, now), state).state
    assert after.states["m0"] == after.states["s1"] == "inactive"
    assert msgspec.convert(msgspec.to_builtins(after), State) == after, "it survives the journal"
