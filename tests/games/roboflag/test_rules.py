"""The rules of RoboFlag at one look, sentence by sentence: states, flags, homes and tags."""

import math
import random
from collections.abc import Mapping, Sequence

import pytest

from tests.games.roboflag.making import FLAGS, HOMES, MID, book, calls, carrying, contestants, field, judge, out, tagged
from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import Observation, Verdict
from vrg.games.roboflag import FLAGGED, NORMAL, TAG_DISTANCE, TAGGED, other
from vrg.games.roboflag.rules import RoboFlag, State
from vrg.games.roboflag.settings import Settings, TeamHalf
from vrg.types import Pose, Vector

QUIET = (2.0, 0.0)
"""A place in blue's half away from its flag zone and home."""


@pytest.fixture
def rules() -> RoboFlag:
    """The rule book of four against four."""
    return book()


def test_everybody_begins_normal_and_both_flags_are_in_their_places() -> None:
    state = book().initial()
    assert set(state.states.values()) == {NORMAL}
    assert {team: (state.flag(team).x, state.flag(team).y) for team in ("red", "blue")} == FLAGS
    assert [thing.carrier for thing in state.objects] == [None, None]
    assert state.points == {"red": 0, "blue": 0}


# Tagged: within tag distance of an opponent while on the opponent's half and outside the flag zone.


RED, BLUE = ("tag", "red1", "blue1"), ("tag", "blue1", "red1")
"""What is called when red1 or blue1 is tagged by the other one."""
FX, FY = FLAGS["blue"]
HX, HY = HOMES["blue"]
NEAR = (2.3, 0.0)

Places = dict[str, Vector]
Calls = list[tuple[str, ...]]

TAGS: dict[str, tuple[Places, Calls]] = {
    "nobody who keeps apart": ({}, []),
    "red on blue's half": ({"red1": QUIET, "blue1": (2.5, 0.0)}, [RED]),
    "blue on red's half": ({"blue1": (-2.0, 0.0), "red1": (-2.5, 0.0)}, [BLUE]),
    "nobody who is normal on its own half": ({"red1": (-0.01, 0.0), "blue1": (-0.3, 5.0)}, []),
    "exactly at the tag distance": ({"red1": (0.0, 0.0), "blue1": (0.6, 0.0)}, [RED]),
    "nobody just beyond the tag distance": ({"red1": (0.0, 0.0), "blue1": (0.601, 0.0)}, []),
    "no team mates": ({"red1": QUIET, "red2": (2.1, 0.0)}, []),
    "by all at the same instant": (
        {"red1": QUIET, "blue2": NEAR, "blue1": (1.7, 0.0)}, [("tag", "red1", "blue1", "blue2")],
    ),
    "several at once by one": (
        {"red1": QUIET, "red2": (2.8, 0.0), "blue1": (2.4, 0.0)}, [RED, ("tag", "red2", "blue1")],
    ),
    "also beside the field": ({"red1": (2.0, 4.5), "blue1": (2.0, 4.2)}, [RED]),
    "also behind the field": ({"red1": (6.4, 0.0), "blue1": (6.2, 0.0)}, [RED]),
    # The midline belongs to both halves, and both players are judged at the same instant.
    "both at the midline": ({"red1": (MID, 0.0), "blue1": (MID, 0.5)}, [BLUE, RED]),
    "both that have crossed the midline": ({"red1": (0.2, 0.0), "blue1": (-0.2, 0.0)}, [BLUE, RED]),
    "only red that has crossed the midline": ({"red1": (0.1, 0.0), "blue1": (0.4, 0.0)}, [RED]),
    "only blue that has crossed the midline": ({"red1": (-0.3, 0.0), "blue1": (-0.1, 0.0)}, [BLUE]),
    "on the midline from the left, and the other one too": ({"red1": (MID, 0.0), "blue1": (-0.3, 0.0)}, [BLUE, RED]),
    "on the midline from the right": ({"red1": (MID, 0.0), "blue1": (0.3, 0.0)}, [RED]),
    "a tagger that is tagged at this instant": (
        {"red1": (0.1, 0.0), "blue1": (-0.1, 0.0), "blue2": (0.6, 0.0)}, [BLUE, ("tag", "red1", "blue1", "blue2")],
    ),
    # Players inside a flag zone tag, but cannot be tagged.
    "by a player inside a flag zone": ({"blue1": (FX - 0.9, FY), "red1": (FX - 1.3, FY)}, [RED]),
    "nobody on the border of a flag zone": ({"red1": (FX - 1.0, FY), "blue1": (FX - 1.3, FY)}, []),
    "just outside of a flag zone": ({"red1": (FX - 1.01, FY), "blue1": (FX - 1.3, FY)}, [RED]),
    "nobody in the other team's flag zone, among many": (
        {
            "red1": (FX + 0.7, FY), "blue1": (FX + 0.3, FY), "blue2": (FX - 0.3, FY), "blue3": (FX, FY + 0.3),
            "blue4": (FX, FY - 0.3),
        }, [],
    ),
}  # fmt: skip
FLAGS_TAKEN: dict[str, tuple[Places, Calls]] = {
    "within reach": ({"red1": (FX + 0.59, FY)}, [("flag", "red1")]),
    "not just out of reach": ({"red1": (FX + 0.61, FY)}, []),
    "not by its own team": ({"blue1": FLAGS["blue"], "red1": FLAGS["red"]}, []),
    "both at once": ({"blue1": FLAGS["red"], "red1": FLAGS["blue"]}, [("flag", "blue1"), ("flag", "red1")]),
    "by the nearest of several": ({"red1": (FX + 0.5, FY), "red3": (FX - 0.2, FY)}, [("flag", "red3")]),
    "of equally near ones by the lowest name": ({"red4": (FX, FY), "red2": (FX, FY)}, [("flag", "red2")]),
    "home is no call for a normal player": ({"red1": HOMES["red"], "blue1": HOMES["blue"]}, []),
}
OF_TAGGED: dict[str, tuple[str, Places, Calls]] = {
    "tags nobody": ("blue1", {"red1": QUIET, "blue1": NEAR}, []),
    "tags when it comes home at this instant": (
        "blue1", {"blue1": (HX - 1.0, HY), "red1": (HX - 1.5, HY)}, [("home", "blue1"), RED],
    ),
    "is normal for the rest of that instant": (
        "red1", {"red1": (-5.5, -3.5), "blue1": (-5.2, -3.5)}, [("home", "red1"), BLUE],
    ),
    "is not tagged again": ("red1", {"red1": QUIET, "blue1": NEAR}, []),
    "takes no flag": ("red1", {"red1": FLAGS["blue"]}, []),
    "becomes normal in reach of its home": ("red1", {"red1": (-6.0, -4.0 + 1.19)}, [("home", "red1")]),
    "stays tagged just out of reach of it": ("red1", {"red1": (-6.0, -4.0 + 1.21)}, []),
    "may be beyond the borders of the field": ("red1", {"red1": (-6.5, -4.5)}, [("home", "red1")]),
    "has no home in the opposite corner": ("red1", {"red1": (6.0, 4.0)}, []),
    "has no home in the other corner of its half": ("red1", {"red1": (-6.0, 4.0)}, []),
    "has no home in the other corner of its side": ("red1", {"red1": (6.0, -4.0)}, []),
}  # fmt: skip
OF_CARRIERS: dict[str, tuple[list[str], Places, Calls]] = {
    "tag too": (["blue1"], {"blue1": NEAR, "red1": QUIET}, [BLUE, RED]),
    "are safe in their own flag zone": (["red1"], {"red1": (-3.3, 1.6), "blue1": (-2.9, 1.6)}, [BLUE]),
    "are safe in the other flag zone": (["red1"], {"red1": (FX + 0.7, FY), "blue1": (FX + 1.1, FY)}, []),
    "are safe at a flag": (["red1"], {"red1": FLAGS["red"], "blue1": (-4.4, 1.2)}, [("flag", "blue1")]),
    "let nobody take their flag at its place": (["red1"], {"red1": (-1.0, 0.0), "red2": FLAGS["blue"]}, []),
    "are tagged on their own half too": (["red1"], {"red1": (-2.0, 0.0), "blue1": (-2.3, 0.0)}, [BLUE, RED]),
    "tag each other": (["red1", "blue1"], {"red1": QUIET, "blue1": NEAR}, [BLUE, RED]),
    "tag each other far from the midline": (
        ["red1", "blue1"], {"red1": (-2.0, 0.0), "blue1": (-2.3, 0.0)}, [BLUE, RED],
    ),
    "do not score at their own flag": (["red1"], {"red1": FLAGS["red"]}, []),
    "do not score on their half": (["red1"], {"red1": (-3.0, 0.0)}, []),
    "do not score in the other corner": (["red1"], {"red1": (-6.0, 4.0)}, []),
    "score at home in tag reach": (
        ["red1"], {"red1": (-5.5, -3.5), "blue1": (-5.3, -3.5)}, [("capture", "red1"), BLUE],
    ),
    "free the flag for a mate when they score": (
        ["red1"], {"red1": HOMES["red"], "red2": FLAGS["blue"]}, [("capture", "red1"), ("flag", "red2")],
    ),
}  # fmt: skip
OF_DISQUALIFIED: dict[str, tuple[str, Places, Calls]] = {
    "tags nobody": ("blue1", {"red1": QUIET, "blue1": NEAR}, []),
    "is not tagged": ("red1", {"red1": QUIET, "blue1": NEAR}, []),
    "takes no flag": ("red1", {"red1": FLAGS["blue"]}, []),
    "leaves the flag to others": ("red1", {"red1": (FX, FY), "red2": (FX + 0.5, FY)}, [("flag", "red2")]),
}


def look(rules: RoboFlag, begun: State, places: Places, expected: Calls) -> None:
    """Judge one look: what is called, and that players and flags are as the calls say, and else as before."""
    verdict = judge(rules, places, begun)
    assert calls(verdict) == expected
    ends = {"tag": TAGGED, "flag": FLAGGED, "home": NORMAL, "capture": NORMAL}
    changed = {player: ends[rule] for rule, player, *_ in expected}
    assert verdict.state.states == {**begun.states, **changed}
    carriers = {thing.team: thing.carrier for thing in begun.objects}
    for rule, player, *_ in expected:
        team = other(rules.teams[player])
        if rule == "flag":
            carriers[team] = player
        elif carriers[team] == player:
            carriers[team] = None
    assert {thing.team: thing.carrier for thing in verdict.state.objects} == carriers


@pytest.mark.parametrize(("places", "expected"), TAGS.values(), ids=TAGS)
def test_a_tag_is_called_of(places: Places, expected: Calls) -> None:
    look(book(), book().initial(), places, expected)


@pytest.mark.parametrize(("places", "expected"), FLAGS_TAKEN.values(), ids=FLAGS_TAKEN)
def test_a_flag_is_taken(places: Places, expected: Calls) -> None:
    look(book(), book().initial(), places, expected)


@pytest.mark.parametrize(("name", "places", "expected"), OF_TAGGED.values(), ids=OF_TAGGED)
def test_a_tagged_player(name: str, places: Places, expected: Calls) -> None:
    look(book(), tagged(book(), name), places, expected)


@pytest.mark.parametrize(("names", "places", "expected"), OF_CARRIERS.values(), ids=OF_CARRIERS)
def test_carriers(names: list[str], places: Places, expected: Calls) -> None:
    look(book(), carrying(book(), *names), places, expected)


@pytest.mark.parametrize(("name", "places", "expected"), OF_DISQUALIFIED.values(), ids=OF_DISQUALIFIED)
def test_a_disqualified_player(name: str, places: Places, expected: Calls) -> None:
    look(book(), out(book().initial(), name), places, expected)


def test_exactly_in_reach_is_near_enough() -> None:
    """With numbers that are exact in binary."""
    settings = {"scale": 2.0, "flag_reach": 0.25, "blue": {"home": "high", "flag": (2.0, -0.75)}}
    rules = RoboFlag(Settings.model_validate(settings), contestants())
    look(rules, rules.initial(), {"red1": (4.5, -1.5)}, [("flag", "red1")])
    rules = book(home_reach=0.625)
    for place in ((-6.0, -2.75), (-5.25, -3.0)):
        look(rules, tagged(rules, "red1"), {"red1": place}, [("home", "red1")])


def test_a_player_that_takes_a_flag_is_safe_and_tags_at_the_same_instant() -> None:
    """It takes the flag first, and then tags with the flag in its hands."""
    rules = book(flag_reach=0.5)
    look(rules, rules.initial(), {"red1": (FX - 1.0, FY), "blue1": (FX - 1.3, FY)}, [("flag", "red1")])
    places = {"red1": (FX - 1.0, FY), "blue1": (FX - 1.4, FY)}
    look(rules, carrying(rules, "blue1"), places, [("flag", "red1"), BLUE])


def test_a_disqualified_carriers_flag_can_be_taken_at_once(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red2": FLAGS["blue"]}, out(carrying(rules, "red1"), "red1"))
    assert calls(verdict) == [("flag_returns", "red1"), ("flag", "red2")]


def test_distances_are_between_centres_whatever_the_headings(rules: RoboFlag) -> None:
    now = field(rules).poses | {"red1": Pose(2.0, 0.0, 1.0), "blue1": Pose(2.0, 0.59, -2.0)}
    assert calls(rules.judge(rules.initial(), Observation(now), Observation(now), 1.0)) == [("tag", "red1", "blue1")]


# The whole ways between two looks count, so that nobody jumps over anything.


def ways(moved: Mapping[str, tuple[Vector, Vector]], *carriers: str, tagged_ones: Sequence[str] = ()) -> Verdict[State]:
    """Judge one look before which players have driven from one place to another."""
    rules = book(red=2, blue=2)
    before = field(rules, {name: start for name, (start, _) in moved.items()})
    now = field(rules, {name: end for name, (_, end) in moved.items()})
    state = tagged(rules, *tagged_ones, state=carrying(rules, *carriers))
    return rules.judge(state, before, now, 1.0)


def test_the_call_tells_where_it_happened() -> None:
    verdict = ways({"red1": ((2.0, -0.7), (2.0, 0.7)), "blue1": ((2.0, 0.5), (2.0, 0.5))})
    tagged_at, tagger_at = verdict.calls[0].poses
    assert (tagged_at.x, tagged_at.y) == pytest.approx((2.0, -0.1))
    assert (tagger_at.x, tagger_at.y) == pytest.approx((2.0, 0.5))


def test_only_the_part_of_the_way_on_the_opponents_half_counts() -> None:
    verdict = ways({"red1": ((-0.5, 0.0), (0.5, 0.0)), "blue1": ((-1.0, 0.0), (-1.0, 0.0))})
    assert verdict.state.states["red1"] == NORMAL, "it was near the opponent only on its own half"
    verdict = ways({"red1": ((-0.5, 0.0), (0.5, 0.0)), "blue1": ((-0.5, 0.0), (-0.5, 0.0))})
    assert verdict.state.states["red1"] == TAGGED, "it was still near when it met the midline"


def test_who_was_across_the_midline_only_between_two_looks_cannot_have_been() -> None:
    assert ways({"red1": ((-0.1, 0.0), (-0.1, 0.5)), "blue1": ((0.3, 0.0), (0.3, 0.5))}).calls == []


def test_only_the_part_of_the_way_outside_the_flag_zones_counts() -> None:
    x, y = FLAGS["blue"]
    into = {"red1": ((x - 1.5, y), (x - 0.7, y))}
    assert calls(ways({**into, "blue1": ((x - 0.2, y), (x - 0.2, y))})) == []
    assert calls(ways({**into, "blue1": ((x - 1.4, y), (x - 1.4, y))})) == [("tag", "red1", "blue1")]


def test_rounding_tags_nobody_who_crosses_the_border_of_a_flag_zone_at_the_tag_distance() -> None:
    side = TeamHalf(home="high", flag=(0.6, 0.15))
    rules = RoboFlag(Settings(tag_distance=0.5, flag_zone=0.5, blue=side), contestants(1, 1))
    rng, (x, y) = random.Random(1), (1.2, 0.3)
    wrong = []
    for number in range(2000):
        angle, far = rng.uniform(2.6, 3.6), rng.uniform(1.1, 1.7)
        way = [(x + r * math.cos(a), y + r * math.sin(a)) for r, a in ((1.0, angle), (far, angle + 0.1))]
        start, end = rng.sample(way, 2)
        before, now = (field(rules, {"red1": place, "blue1": (x, y)}) for place in (start, end))
        if calls(rules.judge(rules.initial(), before, now, 1.0)):
            wrong.append(number)
    assert not wrong, "blue1 stands at its flag: whoever is near enough to be tagged is in the flag zone"


def test_who_comes_to_the_flag_first_takes_it_even_if_another_one_is_nearer_now() -> None:
    x, y = FLAGS["blue"]
    verdict = ways({"red2": ((x - 0.7, y), (x + 0.7, y)), "red1": ((x, y - 1.2), (x, y))})
    assert calls(verdict) == [("flag", "red2")]


def test_who_is_at_home_only_between_two_looks_scores() -> None:
    verdict = ways({"red1": ((-5.79, -2.8), (-4.8, -3.79))}, "red1")
    assert calls(verdict) == [("capture", "red1")]


def test_a_carrier_that_is_tagged_on_its_way_but_reaches_its_home_before_the_look_scores() -> None:
    verdict = ways({"red1": ((-5.0, -2.2), (-5.2, -3.4)), "blue1": ((-4.8, -2.2), (-4.8, -2.2))}, "red1")
    assert calls(verdict)[0] == ("capture", "red1")
    assert verdict.state.states["red1"] == NORMAL


# A flag carrier can be tagged anywhere outside the flag zones, its own half included.


def test_a_tagged_carriers_flag_returns_to_its_place(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}, carrying(rules, "red1"))
    flag = verdict.state.flag("blue")
    assert flag.carrier is None
    assert (flag.x, flag.y) == FLAGS["blue"]
    assert "the flag of blue returns" in verdict.calls[0].text


def test_a_flag_that_returns_is_not_taken_at_the_same_instant_but_at_the_next(rules: RoboFlag) -> None:
    places = {"red1": QUIET, "blue1": (2.3, 0.0), "red2": FLAGS["blue"]}
    verdict = judge(rules, places, carrying(rules, "red1"))
    assert calls(verdict) == [("tag", "red1", "blue1")]
    assert calls(judge(rules, places, verdict.state)) == [("flag", "red2")]


# In reach of its own home corner any player becomes normal; a carrier scores there.


def test_a_carrier_scores_at_home_and_the_flag_returns_to_its_place(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red1": (-5.5, -3.5)}, carrying(rules, "red1"))
    assert verdict.state.points == {"red": 1, "blue": 0}
    assert rules.score(verdict.state) == {"red": 1, "blue": 0}
    assert verdict.state.states["red1"] == NORMAL
    assert verdict.state.flag("blue").carrier is None
    assert calls(verdict) == [("capture", "red1")]


def test_both_teams_can_score_at_once(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red1": HOMES["red"], "blue1": HOMES["blue"]}, carrying(rules, "red1", "blue1"))
    assert verdict.state.points == {"red": 1, "blue": 1}
    assert not verdict.round_over


# Order within one tick: home, then flag, then tag.


# Scale: one factor scales field, zones and radii together.


@pytest.mark.parametrize("scale", [2.0, 3.0, 10.0])
def test_one_factor_scales_field_zones_and_distances(scale: float) -> None:
    rules = RoboFlag(Settings(scale=scale, centre=(20.0, 30.0)), contestants(0, 0) + _scaled(scale))
    zones = {zone.name: zone.region for zone in rules.zones(rules.initial())}
    assert zones["field"].bounds == pytest.approx((20 - 3 * scale, 30 - 2 * scale, 20 + 3 * scale, 30 + 2 * scale))
    assert zones["red flag_zone"].radius == pytest.approx(0.5 * scale)
    assert zones["red flag_zone"].middle == pytest.approx((20 - 2 * scale, 30 + 0.8 * scale))
    assert zones["blue home"].radius == pytest.approx(0.6 * scale)
    assert rules.initial().numbers[TAG_DISTANCE] == pytest.approx(0.3 * scale)
    for factor, expected in ((0.99, [("tag", "red1", "blue1")]), (1.01, [])):
        places = {"red1": (20.5, 30.0), "blue1": (20.5, 30.0 + 0.3 * scale * factor)}
        assert calls(judge(rules, places)) == expected
        places = {"red1": (20 + (2 + 0.3 * factor) * scale, 30 - 0.8 * scale)}
        assert calls(judge(rules, places)) == ([("flag", "red1")] if expected else [])
        places = {"red1": (20 - 3 * scale, 30 + (-2 + 0.6 * factor) * scale)}
        assert calls(judge(rules, places, tagged(rules, "red1"))) == ([("home", "red1")] if expected else [])


def _scaled(scale: float) -> list:
    far = {"red1": (20 - 0.4 * scale, 30 - scale), "blue1": (20 + 0.4 * scale, 30 + scale)}
    return contestants(1, 1, moved=far)


def test_the_field_is_six_by_four_metres_at_scale_one() -> None:
    rules = RoboFlag(Settings(scale=1.0), contestants(1, 1, size=(0.1, 0.1), moved={"red1": (-1, 0), "blue1": (1, 0)}))
    zones = {zone.name: zone.region for zone in rules.zones(rules.initial())}
    assert zones["field"].bounds == (-3.0, -2.0, 3.0, 2.0)
    assert rules.initial().numbers[TAG_DISTANCE] == 0.3


# The zones as everybody is told of them.


def test_each_half_belongs_to_a_team_and_has_a_home_and_a_flag_zone(rules: RoboFlag) -> None:
    zones = {(zone.kind, zone.team): zone.region for zone in rules.zones(rules.initial())}
    assert set(zones) == {("field", None)} | {(k, t) for k in ("half", "home", "flag_zone") for t in ("red", "blue")}
    assert zones["half", "red"].bounds == (-6.0, -4.0, 0.0, 4.0)
    assert zones["half", "blue"].bounds == (0.0, -4.0, 6.0, 4.0)
    for team in ("red", "blue"):
        corner, home = HOMES[team], zones["home", team]
        assert (home.x, home.y) == corner
        assert home.contains(corner[0] * 0.9, corner[1] * 0.9), "the quarter circle is inside the field"
        assert not home.contains(corner[0] * 1.05, corner[1] * 1.05)
        assert zones["flag_zone", team].contains(*FLAGS[team])


@pytest.mark.parametrize(("red", "blue"), [("low", "low"), ("high", "high"), ("high", "low")])
def test_a_home_is_in_the_corner_that_the_settings_name(red: str, blue: str) -> None:
    settings = {"red": {"home": red, "flag": (-2, 0)}, "blue": {"home": blue, "flag": (2, 0)}}
    rules = RoboFlag(Settings.model_validate(settings), contestants())
    zones = {(zone.kind, zone.team): zone.region for zone in rules.zones(rules.initial())}
    for team, end, x in (("red", red, -6.0), ("blue", blue, 6.0)):
        y = -4.0 if end == "low" else 4.0
        assert (zones["home", team].x, zones["home", team].y) == (x, y)
        assert zones["home", team].contains(x * 0.9, y * 0.9)
        name = f"{team}1"
        assert calls(judge(rules, {name: (x * 0.9, y * 0.9)}, tagged(rules, name))) == [("home", name)]
        assert judge(rules, {name: (x * 0.9, -y * 0.9)}, tagged(rules, name)).calls == []


# Tagged players are driven home by the coordinator.


def test_exactly_the_tagged_players_are_driven_each_to_its_own_home(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red1": (0.2, 0.0), "blue1": (-0.2, 0.0), "red2": FLAGS["blue"]})
    zones = {(zone.kind, zone.team): zone.region for zone in rules.zones(verdict.state)}
    assert set(verdict.state.driven) == {"red1", "blue1"}
    for name, region in verdict.state.driven.items():
        assert zones["home", rules.teams[name]].contains(*region.middle)


def test_a_player_that_is_home_is_no_longer_driven(rules: RoboFlag) -> None:
    state = judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}).state
    assert set(state.driven) == {"red1"}
    assert judge(rules, {"red1": HOMES["red"]}, state).state.driven == {}


def test_tagged_players_may_move_but_only_in_play(rules: RoboFlag) -> None:
    state = tagged(rules, "red1")
    for stage, may in ((Stage.PLAY_ROUND, True), (Stage.ROUND_OVER, False), (Stage.GAME_OVER, False)):
        status = next(s for s in rules.statuses(state, stage, field(rules)) if s.name == "red1")
        assert (status.may_move, status.state, status.team) == (may, TAGGED, "red")


# Disqualified players neither tag, take nor score, and the flag of a disqualified carrier returns.


def test_a_disqualified_carrier_does_not_score_and_its_flag_returns(rules: RoboFlag) -> None:
    verdict = judge(rules, {"red1": HOMES["red"]}, out(carrying(rules, "red1"), "red1"))
    assert calls(verdict) == [("flag_returns", "red1")]
    assert verdict.state.points == {"red": 0, "blue": 0}
    assert verdict.state.flag("blue").carrier is None


def test_a_player_that_the_world_does_not_report_is_not_judged(rules: RoboFlag) -> None:
    now = Observation({name: pose for name, pose in field(rules, {"blue1": QUIET}).poses.items() if name != "red1"})
    verdict = rules.judge(carrying(rules, "red1"), now, now, 1.0)
    assert verdict.calls == []
    assert verdict.state.flag("blue").carrier == "red1"
