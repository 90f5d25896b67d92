"""What a team decides: who attacks, who shields, who tags whom, where guards stand, and which way is safe."""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.games.roboflag.making import FLAGS, HOMES
from vrg.bus.messages import Auction
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED, attack_of
from vrg.games.roboflag.evasion import LEVEL, BestDirection, Flags, Floats, best_course
from vrg.games.roboflag.formation import ATTACKER_SPACING, FEINT_TIME, FORM_UP_DISTANCE, formed_up, groups, lane, places
from vrg.games.roboflag.posts import MAX_CHASERS, POST_DISTANCE, known_in, posts, shields, targets
from vrg.games.roboflag.situation import BORDER_CLEARANCE, Known, Situation, TeamField
from vrg.games.roboflag.tactics import ByNumbers, Everybody, GuardFlag, OneAttacker, Pair, Purge, ShieldCarrier, Tactic
from vrg.regions import Circle, Rectangle, Sector
from vrg.types import Vector

RADIUS = 0.35
FIELD = Rectangle(-6, -4, 6, 4)
ANGLE = {"red": 0.0, "blue": math.pi}


def ground(team: str = "red") -> TeamField:
    """The field of scale 2 as a team sees it."""
    red = team == "red"
    home = Sector(*HOMES[team], 1.2, ANGLE[team], math.pi / 2)
    other = "blue" if red else "red"
    return TeamField(
        field=FIELD,
        own_half=Rectangle(-6, -4, 0, 4) if red else Rectangle(0, -4, 6, 4),
        home=home,
        own_zone=Circle(*FLAGS[team], 1.0),
        their_zone=Circle(*FLAGS[other], 1.0),
        own_flag=FLAGS[team],
        their_flag=FLAGS[other],
        inner=FIELD.shrunk(BORDER_CLEARANCE),
        haven=home.shrunk(0.2),
        ahead=1.0 if red else -1.0,
        midline=0.0,
        tag_distance=0.6,
    )


def known(name: str, x: float = 0.0, y: float = 0.0, state: str = NORMAL) -> Known:
    return Known(name, (x, y), (0.0, 0.0), state, name.rstrip("0123456789"), RADIUS)


def situation(
    *players: Known,
    bids: Mapping[str, float] = {},
    winner: str | None = None,
    said: Mapping[str, str] = {},
    carrier: str | None = None,
    thief: str | None = None,
    team: str = "red",
) -> Situation:
    """What the first of the players knows."""
    me = players[0]
    auction = Auction(lot=attack_of(team), bidders=tuple(bids), opened=1.0, lasts=0.3, bids=dict(bids), winner=winner)
    return Situation(
        ground=ground(team),
        me=me,
        mates=[p for p in players if p.team == team and p is not me],
        opponents=[p for p in players if p.team != team],
        carrier=carrier,
        thief=thief,
        auction=auction,
        round=1,
        targets=said,
    )


REDS = [known(f"red{i}", -3.0, float(i)) for i in range(1, 5)]
BIDS = {"red1": 9.0, "red2": 3.0, "red3": 7.0, "red4": 5.0}


class TestWhoAttacks:
    def test_the_winner_is_first_and_the_others_follow_by_their_bids(self) -> None:
        assert situation(*REDS, bids=BIDS).ranked == ["red2", "red4", "red3", "red1"]
        assert situation(*REDS, bids=BIDS, winner="red3").ranked == ["red3", "red2", "red4", "red1"]
        assert situation(*REDS).ranked == ["red1", "red2", "red3", "red4"]

    def test_tagged_and_flagged_players_are_not_among_them(self) -> None:
        players = [known("red1", state=TAGGED), known("red2", state=FLAGGED), known("red3")]
        assert situation(*players, bids=BIDS).ranked == ["red3"]

    def test_conservative_the_lowest_bid_goes_and_nobody_shields_it(self) -> None:
        s = situation(*REDS, bids=BIDS)
        assert OneAttacker().attackers(s) == ["red2"]
        assert OneAttacker().escorts(situation(*REDS, carrier="red2")) == []

    def test_aggressive_all_go_and_all_others_shield(self) -> None:
        assert set(Everybody().attackers(situation(*REDS))) == set(BIDS)
        assert set(Everybody().escorts(situation(*REDS, carrier="red2"))) == {"red1", "red3", "red4"}

    @pytest.mark.parametrize(("tagged", "go"), [(0, 1), (1, 2), (2, 3), (3, 3), (4, 3)])
    def test_by_numbers_one_goes_for_each_tagged_opponent_and_one_more_but_one_stays(
        self, tagged: int, go: int
    ) -> None:
        blues = [known(f"blue{i}", 3.0, float(i), TAGGED if i <= tagged else NORMAL) for i in range(1, 5)]
        assert len(ByNumbers().attackers(situation(*REDS, *blues, bids=BIDS))) == go

    def test_by_numbers_the_last_one_that_is_left_goes(self) -> None:
        assert ByNumbers().attackers(situation(known("red1"))) == ["red1"]

    def test_balanced_the_two_lowest_bids_go_and_nobody_shields(self) -> None:
        assert Pair().attackers(situation(*REDS, bids=BIDS)) == sorted(BIDS, key=lambda name: BIDS[name])[:2]
        assert Pair().escorts(situation(*REDS, carrier="red2")) == []

    @pytest.mark.parametrize("tactic", [GuardFlag(), Purge()])
    def test_who_defends_sends_nobody(self, tactic: Tactic) -> None:
        assert list(tactic.attackers(situation(*REDS))) == []
        assert list(tactic.escorts(situation(*REDS, carrier="red1"))) == []

    def test_team_flag_tags_only_the_thief_and_tag_defense_everybody(self) -> None:
        assert not GuardFlag().chases
        assert Purge().chases

    def test_flagged_safety_all_shield(self) -> None:
        assert set(ShieldCarrier().escorts(situation(*REDS, carrier="red2"))) == {"red1", "red3", "red4"}

    def test_every_player_of_a_team_comes_to_the_same_result(self) -> None:
        for tactic in (OneAttacker(), Everybody(), ByNumbers(), Pair(), ShieldCarrier()):
            results = [
                tuple(tactic.attackers(situation(*REDS[i:], *REDS[:i], bids=BIDS, winner="red4"))) for i in range(4)
            ]
            assert len(set(results)) == 1


class TestThreats:
    def threats(self, *blues: Known, thief: str | None = None) -> list[str]:
        return [threat.name for threat in situation(known("red1", -3, 0), *blues, thief=thief).threats]

    def test_opponents_on_the_own_half_are_threats(self) -> None:
        assert self.threats(known("blue1", -1, 0), known("blue2", 1, 0)) == ["blue1"]

    def test_whoever_is_on_the_midline_is_one(self) -> None:
        assert self.threats(known("blue1", 0.0, 0.0)) == ["blue1"]

    def test_inside_the_own_flag_zone_nobody_can_be_tagged(self) -> None:
        assert self.threats(known("blue1", *FLAGS["red"])) == []

    def test_the_thief_is_one_wherever_it_is(self) -> None:
        assert self.threats(known("blue1", 4.0, 0.0, FLAGGED), thief="blue1") == ["blue1"]
        assert self.threats(known("blue1", *FLAGS["red"], FLAGGED), thief="blue1") == ["blue1"]

    def test_a_tagged_opponent_is_none(self) -> None:
        assert self.threats(known("blue1", -1, 0, TAGGED)) == []


class TestTargets:
    def test_the_shortest_ways_first_and_one_for_each(self) -> None:
        reds = [known("red1", -3, 0), known("red2", -1, 0)]
        blues = [known("blue1", -2, 0), known("blue2", -0.5, 0)]
        found = targets(situation(*reds, *blues), reds, blues)
        assert {name: target.name for name, target in found.items()} == {"red2": "blue2", "red1": "blue1"}

    def test_a_thief_is_chased_by_two(self) -> None:
        reds = [known(f"red{i}", -3.0, float(i)) for i in range(3)]
        blue = known("blue1", -2, 0, FLAGGED)
        found = targets(situation(*reds, blue, thief="blue1"), reds, [blue])
        assert set(found) == {"red0", "red1"}
        assert MAX_CHASERS == 2

    def test_who_has_said_whom_it_tags_keeps_it_unless_another_one_is_much_nearer(self) -> None:
        reds = [known("red1", -3.0, 0.0), known("red2", -2.9, 0.0)]
        blue = known("blue1", -1, 0)
        assert set(targets(situation(*reds, blue), reds, [blue])) == {"red2"}
        assert set(targets(situation(*reds, blue, said={"red1": "blue1"}), reds, [blue])) == {"red1"}
        reds[1] = known("red2", -1.5, 0.0)
        assert set(targets(situation(*reds, blue, said={"red1": "blue1"}), reds, [blue])) == {"red2"}

    def test_without_threats_nobody_has_a_target(self) -> None:
        assert targets(situation(*REDS), REDS, []) == {}

    def test_the_order_of_players_does_not_decide(self) -> None:
        reds = [known("red1", -3, 1), known("red2", -3, -1), known("red3", -3, 0)]
        blues = [known("blue1", -1, 0), known("blue2", -1, 0.5)]
        one = targets(situation(*reds, *blues), reds, blues)
        other = targets(situation(*reds, *blues), reds[::-1], blues[::-1])
        assert {n: t.name for n, t in one.items()} == {n: t.name for n, t in other.items()}


class TestPosts:
    @example(3, [(5.0, -2.0), (5.0, -2.0), (6.0, 0.0)], "blue")
    @given(
        st.integers(1, 4),
        st.lists(st.tuples(st.floats(-6, 6), st.floats(-4, 4)), max_size=4),
        st.sampled_from(["red", "blue"]),
    )
    def test_posts_are_just_outside_the_own_flag_zone_and_apart(
        self, number: int, hunters: list[Vector], team: str
    ) -> None:
        sign = -1.0 if team == "red" else 1.0
        guards = [known(f"{team}{i}", sign * 3.0, 0.7 * i) for i in range(number)]
        other = "blue" if team == "red" else "red"
        opponents = [known(f"{other}{i}", x, y) for i, (x, y) in enumerate(hunters)]
        found = posts(situation(*guards, *opponents, team=team), guards)
        assert set(found) == {guard.name for guard in guards}
        zone = ground(team).own_zone
        for place in found.values():
            assert math.dist(place, (zone.x, zone.y)) == pytest.approx(zone.radius + POST_DISTANCE)
        spots = list(found.values())
        for i, a in enumerate(spots):
            for b in spots[:i]:
                assert math.dist(a, b) > 2 * RADIUS, "guards at their posts do not touch"

    @pytest.mark.parametrize("team", ["red", "blue"])
    def test_a_guard_stands_between_the_flag_and_the_opponent(self, team: str) -> None:
        sign = -1.0 if team == "red" else 1.0
        flag, hunter = FLAGS[team], (sign * 1.0, 2.5)
        other = "blue1" if team == "red" else "red1"
        guard = known(f"{team}1", sign * 3.0, 0.0)
        (post,) = posts(situation(guard, known(other, *hunter), team=team), [guard]).values()
        bearing = math.atan2(hunter[1] - flag[1], hunter[0] - flag[0])
        assert math.atan2(post[1] - flag[1], post[0] - flag[0]) == pytest.approx(bearing)

    def test_without_opponents_they_face_the_other_half(self) -> None:
        guards = [known(f"red{i}", -3.0, float(i)) for i in range(3)]
        spots = posts(situation(*guards), guards).values()
        assert all(x > FLAGS["red"][0] for x, _ in spots)

    def test_guards_keep_their_order_so_that_their_ways_do_not_cross(self) -> None:
        guards = [known("red1", -2.0, 3.5), known("red2", -2.0, -1.0), known("red3", -2.0, 1.6)]
        found = posts(situation(*guards), guards)
        assert found["red2"][1] < found["red3"][1] < found["red1"][1]

    def test_a_tagged_opponent_is_not_faced(self) -> None:
        guard = known("red1", -3.0, 0.0)
        with_one = posts(situation(guard, known("blue1", -1, 3, TAGGED)), [guard])
        assert with_one == posts(situation(guard), [guard])


class TestShields:
    def test_a_shield_is_between_the_carrier_and_the_opponent(self) -> None:
        carrier, escort, blue = known("red1", 0, 0, FLAGGED), known("red2", 1, 1), known("blue1", 4, 0)
        found = shields(situation(escort, carrier, blue, carrier="red1"), [escort], carrier)
        (x, y), opponent = found["red2"]
        assert opponent == "blue1"
        assert 0.0 < x < 4.0
        assert y == pytest.approx(0.0)

    def test_the_nearest_opponents_are_shielded_first_each_by_the_escort_that_is_nearest(self) -> None:
        carrier = known("red1", 0, 0, FLAGGED)
        escorts = [known("red2", 0, 2), known("red3", 0, -2)]
        blues = [known("blue1", 0, 3), known("blue2", 0, -2.5), known("blue3", 5, 0)]
        found = shields(situation(escorts[0], escorts[1], carrier, *blues, carrier="red1"), escorts, carrier)
        assert {name: opponent for name, (_, opponent) in found.items()} == {"red2": "blue1", "red3": "blue2"}

    def test_tagged_opponents_need_no_shield(self) -> None:
        carrier, escort = known("red1", 0, 0, FLAGGED), known("red2", 1, 1)
        blue = known("blue1", 2, 0, TAGGED)
        assert shields(situation(escort, carrier, blue, carrier="red1"), [escort], carrier) == {}

    def test_an_opponent_at_the_very_place_of_the_carrier_is_no_error(self) -> None:
        carrier, escort, blue = known("red1", 1, 1, FLAGGED), known("red2", 1, 2), known("blue1", 1, 1)
        found = shields(situation(escort, carrier, blue, carrier="red1"), [escort], carrier)
        assert all(map(math.isfinite, found["red2"][0]))

    def test_players_of_some_names_are_found_in_the_order_of_the_names(self) -> None:
        assert [k.name for k in known_in(["red3", "red9", "red1"], REDS)] == ["red3", "red1"]


class TestFormation:
    def test_attackers_form_up_on_their_half_inside_the_field_and_apart(self) -> None:
        wrong = []
        for team, flanks, number in itertools.product(("red", "blue"), (1, 2), (1, 2, 3, 4, 5, 8)):
            names = [f"{team}{i}" for i in range(number)]
            g = ground(team)
            found = places(g, names, flanks)
            rows = [sorted(found[name][1] for name in group) for group in groups(names, flanks)]
            spots = sorted(y for _, y in found.values())
            formed = {
                "everybody": set(found) == set(names),
                "inside the field": all(g.inner.distance(*place) < 1e-9 for place in found.values()),
                "on their half": all(g.beyond(x) == pytest.approx(-FORM_UP_DISTANCE) for x, _ in found.values()),
                "together": all(b - a <= ATTACKER_SPACING + 1e-9 for ys in rows for a, b in itertools.pairwise(ys)),
                "apart": all(b - a > 0.1 for a, b in itertools.pairwise(spots)),
            }
            wrong += [f"{number} of {team}, {flanks} flanks: not {what}" for what, well in formed.items() if not well]
        assert not wrong, "\n".join(wrong)

    def test_two_groups_are_along_the_two_borders(self) -> None:
        found = places(ground(), ["red1", "red2", "red3", "red4"], 2)
        assert {name for name, (_, y) in found.items() if y < 0} == {"red1", "red3"}
        assert groups(["red1", "red2", "red3", "red4"], 2) == [["red1", "red3"], ["red2", "red4"]]

    @pytest.mark.parametrize("flanks", [1, 2])
    def test_neither_team_has_the_better_places(self, flanks: int) -> None:
        numbers = range(1, 5)
        red = places(ground("red"), [f"red{n}" for n in numbers], flanks)
        blue = places(ground("blue"), [f"blue{n}" for n in numbers], flanks)
        for n in numbers:
            x, y = blue[f"blue{n}"]
            assert red[f"red{n}"] == pytest.approx((-x, -y)), "turned by half a turn about the centre"

    def test_all_must_be_in_their_places(self) -> None:
        formation = places(ground(), ["red1", "red2"], 1)
        there = [known(name, *place) for name, place in formation.items()]
        assert formed_up(there, formation)
        assert not formed_up([there[0], known("red2", -5.0, 0.0)], formation)
        assert formed_up([*there, known("red3", -5.0, 0.0)], formation), "who does not attack is not waited for"

    def test_attackers_that_find_no_way_drive_to_both_sides_behind_the_midline_and_both_teams_alike(self) -> None:
        sides = []
        for now in (0.0, FEINT_TIME):
            red, blue = (lane(g.inner.bounds, g.midline, g.ahead, now) for g in (ground("red"), ground("blue")))
            assert red == pytest.approx((-blue[0], -blue[1])), "turned by half a turn about the centre"
            assert red[0] == -FORM_UP_DISTANCE
            sides.append(red[1])
        assert sides[0] == -sides[1] != 0.0


def everywhere(points: Floats) -> Flags:
    inside: Flags = np.ones(points.shape[:-1], bool)
    return inside


def nowhere(points: Floats) -> Flags:
    return ~everywhere(points)


def course(
    place: Vector, goal: Vector, hunters: Sequence[Vector], margin: float = 0.3, **options: object
) -> BestDirection:
    wanted = {"inside": everywhere, "harmless": nowhere, **options}
    rows = np.array(hunters, dtype=float).reshape(-1, 2)
    return best_course(place, goal, rows, speed=0.7, reach=0.6, margin=margin, **wanted)  # type: ignore[arg-type]


def turn(found: BestDirection, towards: Vector) -> float:
    """The angle between a course and a direction, rad."""
    return abs(math.remainder(math.atan2(found.heading[1], found.heading[0]) - math.atan2(*towards[::-1]), math.tau))


class TestEvasion:
    @given(st.floats(-5, 5), st.floats(-3, 3), st.floats(-5, 5), st.floats(-3, 3))
    def test_with_nobody_about_it_drives_straight_to_the_goal(self, x: float, y: float, gx: float, gy: float) -> None:
        if math.dist((x, y), (gx, gy)) > 0.5:
            found = course((x, y), (gx, gy), [])
            assert turn(found, (gx - x, gy - y)) < 1e-6
            assert math.hypot(*found.heading) == pytest.approx(1.0)
            assert found.margin == LEVEL

    def test_a_hunter_behind_does_not_matter(self) -> None:
        assert turn(course((0, 0), (4, 0), [(-3, 0)]), (1, 0)) < 1e-6

    def test_a_hunter_ahead_is_avoided(self) -> None:
        found = course((0, 0), (5, 0), [(1.4, 0)])
        assert turn(found, (1, 0)) > 0.2

    def test_it_avoids_on_the_side_where_there_is_room(self) -> None:
        field = Rectangle(-1, -0.5, 6, 6)

        def inside(points: Floats) -> Flags:
            x, y = points[..., 0], points[..., 1]
            flags: Flags = (x >= -1) & (x <= 6) & (y >= -0.5) & (y <= 6)
            return flags

        found = course((0, 0), (5, 0), [(2.5, 0)], inside=inside)
        assert found.heading[1] >= -1e-9
        assert field.contains(0.4 * found.heading[0], 0.4 * found.heading[1])

    def test_a_place_where_nobody_can_be_tagged_is_driven_through_whoever_is_there(self) -> None:
        assert turn(course((0, 0), (4, 0), [(2, 0)], harmless=everywhere), (1, 0)) < 1e-6

    def test_shut_in_on_three_sides_it_leaves_by_the_fourth(self) -> None:
        found = course((0, 0), (4, 0), [(1.2, 0), (0, 1.2), (0, -1.2), (-3.0, 0)])
        assert turn(found, (-1, 0)) < 0.9
        assert found.margin >= 0.3

    def test_shut_in_all_around_it_takes_the_least_dangerous_way(self) -> None:
        found = course((0, 0), (4, 0), [(1.0, 0), (0, 1.0), (0, -1.0), (-1.3, 0)])
        assert found.progress == 0.0
        assert found.margin < 0.3

    def test_the_first_points_of_the_way_are_as_safe_as_it_says(self) -> None:
        hunters = [(2.0, 0.5), (3.0, -1.0)]
        found = course((0, 0), (5, 0), hunters)
        point = (0.4 * found.heading[0], 0.4 * found.heading[1])
        spare = min((max(math.dist(point, h) - 0.6, 0) - 0.4) / 0.7 for h in hunters)
        assert found.margin == pytest.approx(min(spare, LEVEL))
        assert found.margin >= 0.3

    def test_who_dares_more_gets_nearer(self) -> None:
        hunters = [(2.5, 0.8), (2.5, -0.8)]
        careful, bold = (course((0, 0), (5, 0), hunters, margin) for margin in (1.0, -1.5))
        assert bold.progress >= careful.progress

    @given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-3, 3)), max_size=5), st.floats(-1.5, 2.0))
    def test_there_is_always_an_answer(self, hunters: list[Vector], margin: float) -> None:
        found = course((0.5, 0.5), (4, 0), hunters, margin)
        assert math.hypot(*found.heading) == pytest.approx(1.0)
        assert math.isfinite(found.progress)
        assert found.margin <= LEVEL

    def test_at_the_goal_it_is_no_error(self) -> None:
        found = course((1, 1), (1, 1), [(3, 1)])
        assert math.hypot(*found.heading) == pytest.approx(1.0)
