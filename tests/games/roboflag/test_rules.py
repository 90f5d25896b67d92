"""The rules of RoboFlag at one look, sentence by sentence: states, flags, homes and tags."""

import math
import random
from collections.abc import Mapping, Sequence

import pytest

from tests.games.roboflag.making import FLAGS, HOMES, MID, book, calls, carrying, contestants, field, judge, out, tagged
from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import Observation, Verdict
from vrg.games.roboflag import FLAGGED, NORMAL, TAG_DISTANCE, TAGGED
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings, TeamHalf
from vrg.games.roboflag.state import State
from vrg.types import Pose, Vector

QUIET = (2.0, 0.0)
"""A place in blue's half away from its flag zone and home."""


def test_everybody_begins_normal_and_both_flags_are_in_their_places() -> None:
    state = book().initial()
    assert set(state.states.values()) == {NORMAL}
    assert {team: (state.flag(team).x, state.flag(team).y) for team in ("red", "blue")} == FLAGS
    assert [thing.carrier for thing in state.objects] == [None, None]
    assert state.points == {"red": 0, "blue": 0}


def test_nothing_happens_among_players_that_keep_apart() -> None:
    rules = book()
    verdict = judge(rules)
    assert verdict.calls == []
    assert verdict.state.states == rules.initial().states


# Tagged: within tag distance of an opponent while on the opponent's half and outside the flag zone.


def test_a_player_near_an_opponent_on_the_opponents_half_is_tagged() -> None:
    verdict = judge(book(), {"red1": QUIET, "blue1": (2.5, 0.0)})
    assert verdict.state.states["red1"] == TAGGED
    assert verdict.state.states["blue1"] == NORMAL, "whoever is on its own half is not tagged"
    assert calls(verdict) == [("tag", "red1", "blue1")]


def test_the_same_holds_for_blue_on_reds_half() -> None:
    verdict = judge(book(), {"blue1": (-2.0, 0.0), "red1": (-2.5, 0.0)})
    assert calls(verdict) == [("tag", "blue1", "red1")]


def test_a_player_on_its_own_half_is_never_tagged_while_it_is_normal() -> None:
    assert judge(book(), {"red1": (-0.01, 0.0), "blue1": (-0.3, 5.0)}).calls == []


def test_exactly_at_the_tag_distance_is_near_enough() -> None:
    verdict = judge(book(), {"red1": (0.0, 0.0), "blue1": (0.6, 0.0)})
    assert calls(verdict) == [("tag", "red1", "blue1")]


def test_just_beyond_the_tag_distance_is_not_near_enough() -> None:
    assert judge(book(), {"red1": (0.0, 0.0), "blue1": (0.601, 0.0)}).calls == []


def test_distances_are_between_centres_whatever_the_headings() -> None:
    rules = book()
    now = field(rules).poses | {"red1": Pose(2.0, 0.0, 1.0), "blue1": Pose(2.0, 0.59, -2.0)}
    assert calls(rules.judge(rules.initial(), Observation(now), Observation(now), 1.0)) == [("tag", "red1", "blue1")]


def test_team_mates_never_tag_each_other() -> None:
    assert judge(book(), {"red1": QUIET, "red2": (2.1, 0.0)}).calls == []


def test_all_opponents_that_tag_at_the_same_instant_are_named() -> None:
    verdict = judge(book(), {"red1": QUIET, "blue2": (2.3, 0.0), "blue1": (1.7, 0.0)})
    assert calls(verdict) == [("tag", "red1", "blue1", "blue2")]


def test_one_opponent_tags_several_at_once() -> None:
    verdict = judge(book(), {"red1": QUIET, "red2": (2.8, 0.0), "blue1": (2.4, 0.0)})
    assert calls(verdict) == [("tag", "red1", "blue1"), ("tag", "red2", "blue1")]


def test_leaving_the_field_protects_nobody() -> None:
    verdict = judge(book(), {"red1": (2.0, 4.5), "blue1": (2.0, 4.2)})
    assert verdict.state.states["red1"] == TAGGED
    assert judge(book(), {"red1": (6.4, 0.0), "blue1": (6.2, 0.0)}).state.states["red1"] == TAGGED


# The whole ways between two looks count, so that nobody jumps over anything.


def ways(moved: Mapping[str, tuple[Vector, Vector]], *carriers: str, tagged_ones: Sequence[str] = ()) -> Verdict[State]:
    """Judge one look before which players have driven from one place to another."""
    rules = book(red=2, blue=2)
    before = field(rules, {name: start for name, (start, _) in moved.items()})
    now = field(rules, {name: end for name, (_, end) in moved.items()})
    state = tagged(rules, *tagged_ones, state=carrying(rules, *carriers))
    return rules.judge(state, before, now, 1.0)


def test_who_drives_past_an_opponent_between_two_looks_is_tagged() -> None:
    verdict = ways({"red1": ((2.0, -0.7), (2.0, 0.7)), "blue1": ((2.5, 0.0), (2.5, 0.0))})
    assert calls(verdict) == [("tag", "red1", "blue1")]


def test_the_call_tells_where_it_happened() -> None:
    verdict = ways({"red1": ((2.0, -0.7), (2.0, 0.7)), "blue1": ((2.0, 0.5), (2.0, 0.5))})
    tagged_at, tagger_at = verdict.calls[0].poses
    assert (tagged_at.x, tagged_at.y) == pytest.approx((2.0, -0.1))
    assert (tagger_at.x, tagger_at.y) == pytest.approx((2.0, 0.5))


def test_two_that_are_at_the_same_place_but_not_at_the_same_time_do_not_meet() -> None:
    assert ways({"red1": ((2.0, -0.7), (2.0, 0.5)), "blue1": ((2.0, 0.2), (2.0, 1.4))}).calls == []


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


def test_who_drives_over_the_flag_between_two_looks_takes_it() -> None:
    x, y = FLAGS["blue"]
    verdict = ways({"red1": ((x - 0.7, y), (x + 0.7, y))})
    assert calls(verdict) == [("flag", "red1")]


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


# The midline belongs to both halves, and both players are judged at the same instant.


def test_at_the_midline_two_players_tag_each_other() -> None:
    verdict = judge(book(), {"red1": (MID, 0.0), "blue1": (MID, 0.5)})
    assert calls(verdict) == [("tag", "blue1", "red1"), ("tag", "red1", "blue1")]
    assert {verdict.state.states[name] for name in ("red1", "blue1")} == {TAGGED}


def test_two_players_that_have_each_crossed_the_midline_tag_each_other() -> None:
    verdict = judge(book(), {"red1": (0.2, 0.0), "blue1": (-0.2, 0.0)})
    assert {verdict.state.states[name] for name in ("red1", "blue1")} == {TAGGED}


def test_only_the_one_that_has_crossed_the_midline_is_tagged() -> None:
    verdict = judge(book(), {"red1": (0.1, 0.0), "blue1": (0.4, 0.0)})
    assert calls(verdict) == [("tag", "red1", "blue1")]
    verdict = judge(book(), {"red1": (-0.3, 0.0), "blue1": (-0.1, 0.0)})
    assert calls(verdict) == [("tag", "blue1", "red1")]


def test_a_player_that_stands_on_the_midline_is_tagged_by_one_on_either_side() -> None:
    for x in (-0.3, 0.3):
        verdict = judge(book(), {"red1": (MID, 0.0), "blue1": (x, 0.0)})
        assert verdict.state.states["red1"] == TAGGED


# Taggers are opponents that are not tagged.


def test_a_tagged_player_tags_nobody() -> None:
    rules = book()
    assert judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}, tagged(rules, "blue1")).calls == []


def test_a_player_that_is_tagged_at_this_instant_still_tags_at_this_instant() -> None:
    verdict = judge(book(), {"red1": (0.1, 0.0), "blue1": (-0.1, 0.0), "blue2": (0.6, 0.0)})
    assert calls(verdict) == [("tag", "blue1", "red1"), ("tag", "red1", "blue1", "blue2")]


def test_a_carrier_tags_too() -> None:
    rules = book()
    verdict = judge(rules, {"blue1": (2.3, 0.0), "red1": QUIET}, carrying(rules, "blue1"))
    assert ("tag", "red1", "blue1") in calls(verdict)


def test_a_player_inside_a_flag_zone_tags_although_it_cannot_be_tagged() -> None:
    x, y = FLAGS["blue"]
    verdict = judge(book(), {"blue1": (x - 0.9, y), "red1": (x - 1.3, y)})
    assert calls(verdict) == [("tag", "red1", "blue1")]


def test_a_player_that_comes_home_at_this_instant_tags_at_this_instant() -> None:
    rules = book()
    x, y = HOMES["blue"]
    verdict = judge(rules, {"blue1": (x - 1.0, y), "red1": (x - 1.5, y)}, tagged(rules, "blue1"))
    assert calls(verdict) == [("home", "blue1"), ("tag", "red1", "blue1")]


def test_a_tagged_player_is_not_tagged_again() -> None:
    rules = book()
    assert judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}, tagged(rules, "red1")).calls == []


# Players inside a flag zone cannot be tagged.


@pytest.mark.parametrize("zone", ["red", "blue"])
def test_whoever_is_inside_any_flag_zone_cannot_be_tagged(zone: str) -> None:
    rules = book()
    x, y = FLAGS[zone]
    places = {"red1": (x + 0.7, y), "blue1": (x + 1.1, y)}
    assert judge(rules, places, carrying(rules, "red1")).state.states["red1"] == FLAGGED


def test_the_border_of_a_flag_zone_belongs_to_it() -> None:
    x, y = FLAGS["blue"]
    assert judge(book(), {"red1": (x - 1.0, y), "blue1": (x - 1.3, y)}).calls == []
    assert calls(judge(book(), {"red1": (x - 1.01, y), "blue1": (x - 1.3, y)})) == [("tag", "red1", "blue1")]


def test_an_intruder_in_the_other_teams_flag_zone_is_safe_among_many_opponents() -> None:
    x, y = FLAGS["blue"]
    around = {f"blue{i + 1}": (x + dx, y + dy) for i, (dx, dy) in enumerate(((0.3, 0), (-0.3, 0), (0, 0.3), (0, -0.3)))}
    verdict = judge(book(), {"red1": (x + 0.7, y), **around})
    assert verdict.state.states["red1"] == NORMAL


# Flagged: within reach of the opponents' flag; one flag, one carrier.


def test_a_player_within_reach_of_the_opponents_flag_takes_it() -> None:
    x, y = FLAGS["blue"]
    verdict = judge(book(), {"red1": (x + 0.59, y)})
    assert verdict.state.states["red1"] == FLAGGED
    assert verdict.state.flag("blue").carrier == "red1"
    assert calls(verdict) == [("flag", "red1")]


def test_just_out_of_reach_the_flag_is_not_taken() -> None:
    x, y = FLAGS["blue"]
    assert judge(book(), {"red1": (x + 0.61, y)}).calls == []


def test_exactly_in_reach_the_flag_is_taken() -> None:
    settings = {"scale": 2.0, "flag_reach": 0.25, "blue": {"home": "high", "flag": (2.0, -0.75)}}
    rules = RoboFlag(Settings.model_validate(settings), contestants())
    assert calls(judge(rules, {"red1": (4.5, -1.5)})) == [("flag", "red1")]


def test_a_players_own_flag_is_not_taken() -> None:
    assert judge(book(), {"blue1": FLAGS["blue"], "red1": FLAGS["red"]}).calls == []


def test_both_flags_can_be_taken_at_once() -> None:
    verdict = judge(book(), {"blue1": FLAGS["red"], "red1": FLAGS["blue"]})
    assert [thing.carrier for thing in verdict.state.objects] == ["blue1", "red1"]


def test_of_several_in_reach_the_nearest_takes_the_flag() -> None:
    x, y = FLAGS["blue"]
    verdict = judge(book(), {"red1": (x + 0.5, y), "red3": (x - 0.2, y)})
    assert calls(verdict) == [("flag", "red3")]
    assert verdict.state.states["red1"] == NORMAL


def test_of_equally_near_ones_the_lowest_name_takes_the_flag() -> None:
    x, y = FLAGS["blue"]
    assert calls(judge(book(), {"red4": (x, y), "red2": (x, y)})) == [("flag", "red2")]


def test_a_flag_that_is_carried_cannot_be_taken_at_its_place() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-1.0, 0.0), "red2": FLAGS["blue"]}, carrying(rules, "red1"))
    assert verdict.state.states["red2"] == NORMAL
    assert verdict.state.flag("blue").carrier == "red1"


def test_a_tagged_player_takes_no_flag() -> None:
    rules = book()
    verdict = judge(rules, {"red1": FLAGS["blue"]}, tagged(rules, "red1"))
    assert verdict.calls == []
    assert verdict.state.flag("blue").carrier is None


def test_a_taker_at_the_border_of_the_zone_and_in_tag_reach_is_safe() -> None:
    x, y = FLAGS["blue"]
    rules = book(flag_reach=0.5)
    verdict = judge(rules, {"red1": (x - 1.0, y), "blue1": (x - 1.3, y)})
    assert calls(verdict) == [("flag", "red1")]


# A flag carrier can be tagged anywhere outside the flag zones, its own half included.


def test_a_carrier_is_tagged_on_its_own_half_too() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-2.0, 0.0), "blue1": (-2.3, 0.0)}, carrying(rules, "red1"))
    assert verdict.state.states["red1"] == TAGGED
    assert ("tag", "red1", "blue1") in calls(verdict)


def test_a_tagged_carriers_flag_returns_to_its_place() -> None:
    rules = book()
    verdict = judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}, carrying(rules, "red1"))
    flag = verdict.state.flag("blue")
    assert flag.carrier is None
    assert (flag.x, flag.y) == FLAGS["blue"]
    assert "the flag of blue returns" in verdict.calls[0].text


def test_a_flag_that_returns_is_not_taken_at_the_same_instant_but_at_the_next() -> None:
    rules = book()
    places = {"red1": QUIET, "blue1": (2.3, 0.0), "red2": FLAGS["blue"]}
    verdict = judge(rules, places, carrying(rules, "red1"))
    assert calls(verdict) == [("tag", "red1", "blue1")]
    assert calls(judge(rules, places, verdict.state)) == [("flag", "red2")]


def test_a_carrier_inside_a_flag_zone_is_safe() -> None:
    rules = book()
    x, y = FLAGS["red"]
    verdict = judge(rules, {"red1": (x, y), "blue1": (x - 0.4, y - 0.4)}, carrying(rules, "red1"))
    assert verdict.state.states["red1"] == FLAGGED


def test_two_carriers_tag_each_other_and_both_flags_return() -> None:
    rules = book()
    verdict = judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}, carrying(rules, "red1", "blue1"))
    assert calls(verdict) == [("tag", "blue1", "red1"), ("tag", "red1", "blue1")]
    assert [thing.carrier for thing in verdict.state.objects] == [None, None]


def test_two_carriers_far_from_the_midline_tag_each_other_too() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-2.0, 0.0), "blue1": (-2.3, 0.0)}, carrying(rules, "red1", "blue1"))
    assert {verdict.state.states[name] for name in ("red1", "blue1")} == {TAGGED}


# In reach of its own home corner any player becomes normal; a carrier scores there.


def test_a_tagged_player_in_reach_of_its_own_home_corner_becomes_normal() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-6.0, -4.0 + 1.19)}, tagged(rules, "red1"))
    assert verdict.state.states["red1"] == NORMAL
    assert calls(verdict) == [("home", "red1")]


def test_just_out_of_reach_of_its_home_it_stays_tagged() -> None:
    rules = book()
    assert judge(rules, {"red1": (-6.0, -4.0 + 1.21)}, tagged(rules, "red1")).calls == []


def test_exactly_in_reach_of_its_home_is_near_enough() -> None:
    rules = book(home_reach=0.625)
    assert calls(judge(rules, {"red1": (-6.0, -2.75)}, tagged(rules, "red1"))) == [("home", "red1")]
    assert calls(judge(rules, {"red1": (-5.25, -3.0)}, tagged(rules, "red1"))) == [("home", "red1")]


def test_beyond_the_borders_of_the_field_it_is_the_distance_to_the_corner_that_counts() -> None:
    rules = book()
    assert calls(judge(rules, {"red1": (-6.5, -4.5)}, tagged(rules, "red1"))) == [("home", "red1")]


@pytest.mark.parametrize("corner", [(6.0, 4.0), (-6.0, 4.0), (6.0, -4.0)])
def test_no_other_corner_is_its_home(corner: tuple[float, float]) -> None:
    rules = book()
    assert judge(rules, {"red1": corner}, tagged(rules, "red1")).calls == []


def test_a_carrier_scores_at_home_and_the_flag_returns_to_its_place() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-5.5, -3.5)}, carrying(rules, "red1"))
    assert verdict.state.points == {"red": 1, "blue": 0}
    assert rules.score(verdict.state) == {"red": 1, "blue": 0}
    assert verdict.state.states["red1"] == NORMAL
    assert verdict.state.flag("blue").carrier is None
    assert calls(verdict) == [("capture", "red1")]


def test_a_carrier_does_not_score_at_its_own_flag_nor_elsewhere_on_its_half() -> None:
    rules = book()
    for place in (FLAGS["red"], (-3.0, 0.0), (-6.0, 4.0)):
        assert judge(rules, {"red1": place}, carrying(rules, "red1")).calls == []


def test_both_teams_can_score_at_once() -> None:
    rules = book()
    verdict = judge(rules, {"red1": HOMES["red"], "blue1": HOMES["blue"]}, carrying(rules, "red1", "blue1"))
    assert verdict.state.points == {"red": 1, "blue": 1}
    assert not verdict.round_over


def test_a_normal_player_at_home_is_not_called() -> None:
    assert judge(book(), {"red1": HOMES["red"], "blue1": HOMES["blue"]}).calls == []


# Order within one tick: home, then flag, then tag.


def test_a_carrier_at_home_and_in_tag_reach_scores() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-5.5, -3.5), "blue1": (-5.3, -3.5)}, carrying(rules, "red1"))
    assert calls(verdict) == [("capture", "red1"), ("tag", "blue1", "red1")]
    assert verdict.state.states["red1"] == NORMAL


def test_a_score_frees_the_flag_for_a_mate_at_the_same_instant() -> None:
    rules = book()
    verdict = judge(rules, {"red1": HOMES["red"], "red2": FLAGS["blue"]}, carrying(rules, "red1"))
    assert calls(verdict) == [("capture", "red1"), ("flag", "red2")]
    assert verdict.state.flag("blue").carrier == "red2"


def test_a_player_that_takes_a_flag_tags_at_the_same_instant() -> None:
    """It takes the flag first, and then tags with the flag in its hands."""
    x, y = FLAGS["blue"]
    rules = book(flag_reach=0.5)
    verdict = judge(rules, {"red1": (x - 1.0, y), "blue1": (x - 1.4, y)}, carrying(rules, "blue1"))
    assert calls(verdict) == [("flag", "red1"), ("tag", "blue1", "red1")]
    assert verdict.state.flag("red").carrier is None


def test_a_tagged_player_that_is_home_is_normal_for_the_rest_of_the_instant() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (-5.5, -3.5), "blue1": (-5.2, -3.5)}, tagged(rules, "red1"))
    assert calls(verdict) == [("home", "red1"), ("tag", "blue1", "red1")]


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


def test_each_half_belongs_to_a_team_and_has_a_home_and_a_flag_zone() -> None:
    rules = book()
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


def test_exactly_the_tagged_players_are_driven_each_to_its_own_home() -> None:
    rules = book()
    verdict = judge(rules, {"red1": (0.2, 0.0), "blue1": (-0.2, 0.0), "red2": FLAGS["blue"]})
    zones = {(zone.kind, zone.team): zone.region for zone in rules.zones(verdict.state)}
    assert set(verdict.state.driven) == {"red1", "blue1"}
    for name, region in verdict.state.driven.items():
        assert zones["home", rules.teams[name]].contains(*region.middle)


def test_a_player_that_is_home_is_no_longer_driven() -> None:
    rules = book()
    state = judge(rules, {"red1": QUIET, "blue1": (2.3, 0.0)}).state
    assert set(state.driven) == {"red1"}
    assert judge(rules, {"red1": HOMES["red"]}, state).state.driven == {}


def test_tagged_players_may_move_but_only_in_play() -> None:
    rules = book()
    state = tagged(rules, "red1")
    for stage, may in ((Stage.PLAY_ROUND, True), (Stage.ROUND_OVER, False), (Stage.GAME_OVER, False)):
        status = next(s for s in rules.statuses(state, stage, field(rules)) if s.name == "red1")
        assert (status.may_move, status.state, status.team) == (may, TAGGED, "red")


# Disqualified players neither tag, take nor score, and the flag of a disqualified carrier returns.


def test_a_disqualified_player_tags_nobody_and_is_not_tagged() -> None:
    rules = book()
    places = {"red1": QUIET, "blue1": (2.3, 0.0)}
    assert judge(rules, places, out(rules.initial(), "blue1")).calls == []
    assert judge(rules, places, out(rules.initial(), "red1")).calls == []


def test_a_disqualified_player_takes_no_flag_and_leaves_it_to_others() -> None:
    rules = book()
    x, y = FLAGS["blue"]
    state = out(rules.initial(), "red1")
    assert judge(rules, {"red1": (x, y)}, state).calls == []
    assert calls(judge(rules, {"red1": (x, y), "red2": (x + 0.5, y)}, state)) == [("flag", "red2")]


def test_a_disqualified_carrier_does_not_score_and_its_flag_returns() -> None:
    rules = book()
    verdict = judge(rules, {"red1": HOMES["red"]}, out(carrying(rules, "red1"), "red1"))
    assert calls(verdict) == [("flag_returns", "red1")]
    assert verdict.state.points == {"red": 0, "blue": 0}
    assert verdict.state.flag("blue").carrier is None


def test_a_disqualified_carriers_flag_can_be_taken_at_once() -> None:
    rules = book()
    verdict = judge(rules, {"red2": FLAGS["blue"]}, out(carrying(rules, "red1"), "red1"))
    assert calls(verdict) == [("flag_returns", "red1"), ("flag", "red2")]


def test_a_player_that_the_world_does_not_report_is_not_judged() -> None:
    rules = book()
    now = Observation({name: pose for name, pose in field(rules, {"blue1": QUIET}).poses.items() if name != "red1"})
    verdict = rules.judge(carrying(rules, "red1"), now, now, 1.0)
    assert verdict.calls == []
    assert verdict.state.flag("blue").carrier == "red1"
