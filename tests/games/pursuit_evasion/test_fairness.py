"""What is no fair play, and what happens then: guesses in place of sightings, and intruders that do not drive straight.

Also what nobody intends: collisions, and no room for a robot at its start.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import pytest

from tests.games.pursuit_evasion.making import LASER, SETTINGS, Play, book, contestants, crossing, field, move, sighting
from vrg.bus.messages import Call, Sighting
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Observation
from vrg.games.pursuit_evasion.proof import prove
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.state import State
from vrg.regions import Circle
from vrg.types import Pose, Vector

THERE = (5.0, 5.0)

# What a laser can have seen. p0 is at (1, 9) and heads along +x.


def seen_at(place: Vector, *, walls: Sequence[Circle] = (), others: Mapping[str, Vector] = {}, **laser: float) -> bool:
    """Whether i0 is detected at a place by p0, which tells of it and has such a laser."""
    rules = book()
    rules.contestants["p0"] = replace(rules.contestants["p0"], sweeps=(replace(LASER, **laser),))
    rules.walls = walls
    now = field(rules, {"i0": place, **others}, seen=[("p0", sighting(*place, 10.0))])
    return rules.judge(crossing(rules, "i0"), now, now, 1.0).state.detections("i0") == 1


def test_a_sighting_counts_only_within_the_range_of_the_pursuers_own_laser() -> None:
    assert seen_at((6.0, 9.0), range_max=5.0)
    assert seen_at((6.3, 9.0), range_max=5.0), "its near side"
    assert not seen_at((6.5, 9.0), range_max=5.0), "0.39 m of its body are before its centre"


def test_a_sighting_counts_only_within_the_field_of_view() -> None:
    assert seen_at((4.0, 6.5), fov=math.pi / 2)
    assert seen_at((4.0, 5.7), fov=math.pi / 2), "one of its corners"
    assert not seen_at((4.0, 5.0), fov=math.pi / 2)
    assert not seen_at((-1.0, 9.0), fov=math.pi), "behind it"


def test_a_sighting_counts_only_where_no_wall_and_no_robot_is_between() -> None:
    assert not seen_at((5.0, 9.0), walls=[Circle(3.0, 9.0, 0.5)])
    assert seen_at((5.0, 9.0), walls=[Circle(3.0, 9.7, 0.5)])
    assert not seen_at((5.0, 9.0), others={"p1": (2.0, 9.0)})


def test_a_pursuer_without_a_laser_has_seen_nobody() -> None:
    rules = book()
    rules.contestants["p0"] = replace(rules.contestants["p0"], sweeps=())
    seen = [("p0", sighting(*THERE, 9.9)), ("p0", sighting(*THERE, 10.0))]
    verdict = move(rules, crossing(rules, "i0"), {"i0": THERE}, {"i0": THERE}, seen=seen)
    assert verdict.state.detections("i0") == 0
    assert verdict.calls == []


# False alarms.


def told(play: Play, *seen: Sighting, who: str = "p0") -> None:
    play.tick({"i0": THERE}, seen=[(who, each) for each in seen])


def watching() -> Play:
    return Play(book(), crossing(book(), "i0"), 10.0)


def test_of_a_pursuer_that_tells_of_a_place_where_nobody_was_nothing_counts_for_5_s() -> None:
    play = watching()
    told(play, sighting(*THERE, 10.1), sighting(8.0, 5.0, 10.1))
    assert play.state.detections("i0") == 0, "not even the one that is right"
    while play.clock < 14.95:
        told(play, sighting(*THERE, play.clock + 0.1))
    assert play.state.detections("i0") == 0
    for _ in range(3):
        told(play, sighting(*THERE, play.clock + 0.1))
    assert play.state.detections("i0") == 2
    assert play.rulings.count("false_alarm") == 1


def test_each_false_sighting_begins_the_silence_anew() -> None:
    play = watching()
    for tick in range(150):
        told(play, sighting(*((8.0, 5.0) if tick % 40 == 0 else THERE), play.clock + 0.1))
    assert play.state.detections("i0") == 0
    assert play.rulings.count("false_alarm") == 1, "it is told once"


def test_the_others_are_still_believed() -> None:
    play = watching()
    for _ in range(3):
        play.tick({"i0": THERE}, seen=[("p0", sighting(8.0, 5.0, play.clock)), ("p1", sighting(*THERE, play.clock))])
    assert play.state.detections("i0") == 2


def test_who_takes_a_team_mate_or_an_intruder_that_waits_for_one_in_play_raises_no_alarm() -> None:
    play = watching()
    told(play, sighting(9.0, 9.3, 10.1), sighting(-2.0, 3.2, 10.1))
    told(play, sighting(*THERE, 10.2))
    assert play.rulings.count("false_alarm") == 0
    assert play.state.detections("i0") == 1


def test_its_own_place_is_no_place_where_somebody_is() -> None:
    play = watching()
    told(play, sighting(1.0, 9.0, 10.1))
    assert play.rulings[-1] == "false_alarm"


def test_nothing_of_who_guesses_is_published() -> None:
    """Neither a detection nor evidence: it learns of its guesses only that one was wrong."""
    play = watching()
    for _ in range(30):
        grid = [sighting(x + 0.5, 5.0, play.clock + 0.1) for x in range(1, 9)]
        told(play, *grid)
    assert (play.state.auctions, play.state.detected, play.state.evidence) == ({}, {}, {})


# Intruders drive straight on at constant speed: here at 0.7 m/s.


def crossed(way: Callable[[float], Vector], seconds: float = 18.0) -> tuple[list[str], State]:
    """The rulings while i0 moves, and the state then. Nobody else is near."""
    rules = PursuitEvasion(SETTINGS, contestants(intruders=1))
    play = Play(rules)
    while play.clock < seconds and not play.over:
        play.tick({"i0": way(play.clock)})
    return [rule for rule in play.rulings if rule not in ("launch", "enter", "all_done")], play.state


def test_who_drives_straight_on_crosses_the_area() -> None:
    assert crossed(lambda t: (-2.0 + 0.7 * t, 5.0), 12.0)[0] == []
    assert crossed(lambda t: (-2.0 + 0.7 * max(0.0, t - 1.5), 5.0), 30.0)[0] == ["escape"], "it gets up its speed"
    assert crossed(lambda t: (-2.0 + 0.7 * t, 5.0 + 0.2 * math.sin(t)), 30.0)[0] == ["escape"], "it trembles"


@pytest.mark.parametrize(
    ("way", "rule"),
    [
        (lambda t: (-2.0, 5.0), "slow"),
        (lambda t: (-2.0 + 0.7 * min(t, 6.0), 5.0), "slow"),
        (lambda t: (-2.0 + 0.3 * t, 5.0), "slow"),
        (lambda t: (-2.0 + 0.7 * (t if t < 6.0 else 12.0 - t), 5.0), "slow"),
        (lambda t: (-2.0 + 0.7 * t, 5.0 + 0.8 * math.sin(t)), "off_course"),
        (lambda t: (-2.0 + 0.69 * t, 5.0 + 0.06 * t), "off_course"),
    ],
    ids=["never starts", "stops", "creeps", "turns back", "weaves", "has another heading"],
)
def test_who_does_not_counts_as_captured(way: Callable[[float], Vector], rule: str) -> None:
    rulings, state = crossed(way)
    assert rulings == [rule]
    assert state.states["i0"] == "captured"
    assert state.points == {"pursuers": 1, "intruders": 0}


def test_after_a_halt_an_intruder_gets_up_its_speed_again() -> None:
    rules = PursuitEvasion(SETTINGS, contestants(intruders=1))
    play = Play(rules)
    for tick in range(60):
        play.tick({"i0": (-2.0 + 0.07 * tick, 5.0)})
    place = (2.13, 5.0)
    play.clock += 5.0
    for _ in range(68):
        play.tick({"i0": place})
    assert "slow" not in play.rulings
    for _ in range(5):
        play.tick({"i0": place})
    assert play.rulings.count("slow") == 1


def test_an_intruder_that_an_official_puts_elsewhere_has_its_course_from_there() -> None:
    rules = PursuitEvasion(SETTINGS, contestants(intruders=1))
    play = Play(rules)
    for tick in range(60):
        play.tick({"i0": (-2.0 + 0.07 * tick, 5.0)})
    play.before = field(rules, {"i0": (2.0, 2.0)}, time=play.clock)  # as `Match` does for who cannot have driven there
    for tick in range(20):
        play.tick({"i0": (2.0 + 0.07 * tick, 2.0)})
    assert play.rulings == ["launch", "enter"]


# Collisions.


def test_two_intruders_that_collide_are_both_out_and_count_for_nobody() -> None:
    rules = book()
    where = {"i0": (5.0, 5.0), "i1": (5.0, 5.68)}
    verdict = move(rules, crossing(rules, "i0", "i1"), where, where)
    assert [(c.rule, c.players) for c in verdict.calls[:2]] == [
        ("collision", ("i0", "i1")),
        ("collision", ("i1", "i0")),
    ]
    assert [verdict.state.states[n] for n in ("i0", "i1")] == ["out", "out"]
    assert rules.score(verdict.state) == {"pursuers": 0, "intruders": 0}
    assert set(verdict.place) == {"i0", "i1"}
    where["i1"] = (5.0, 5.7)
    assert move(rules, crossing(rules, "i0", "i1"), where, where).calls == []


def test_an_intruder_that_runs_into_a_robot_that_is_out_of_play_is_out_and_the_other_stays_what_it_is() -> None:
    rules = book()
    where = {"i0": (5.0, 5.0), "i1": (5.8, 5.0)}
    verdict = move(rules, crossing(rules, "i0", "i1").with_state(["i1"], "captured"), where, where)
    assert [verdict.state.states[n] for n in ("i0", "i1")] == ["out", "captured"]


# A start without room.


def test_a_robot_that_was_not_put_back_to_its_start_is_put_there_every_5_s() -> None:
    rules = book()
    play = Play(rules, crossing(rules, "i0"), 10.0)
    asked = []
    for _ in range(120):
        now = field(rules, {"i0": (10.5, 5.0)}, time=round(play.clock + 0.1, 6))
        verdict = rules.judge(play.state, play.before, now, round(play.clock + 0.1, 6))
        play.state, play.before, play.clock = verdict.state, now, round(play.clock + 0.1, 6)
        asked += [play.clock] if "i0" in verdict.place else []
    assert asked == [10.1, 15.0, 20.0]
    now = field(rules, time=25.0)
    assert "i0" not in rules.judge(play.state, play.before, now, 25.0).place


# Why: each number can prove a call wrong.


def proved(rules: PursuitEvasion, ticks: Sequence[Observation], state: State, rule: str) -> tuple[bool, bool]:
    """Whether the number of a call holds, and whether it would if the intruder had been seen elsewhere."""
    for before, now in pairwise(ticks):
        verdict = rules.judge(state, before, now, now.time)
        call = next((call for call in verdict.calls if call.rule == rule), None)
        if call is not None:
            break
        state = verdict.state
    assert call is not None
    told = Call(number=1, rule=rule, text="", players=tuple(call.players), poses=tuple(call.poses), clock=now.time)
    (measure,) = prove(rules, Case(told, state, before, now))
    fair = Pose(now.poses["i0"].x + 3.0, 5.0, 0.0)
    poses = [fair, *told.poses[1:]]
    changed = Call(number=1, rule=rule, text="", players=told.players, poses=poses, clock=now.time)
    right = replace(
        now, poses={**now.poses, "i0": fair}, sightings=[(w, sighting(fair.x, 5.0, s.time)) for w, s in now.sightings]
    )
    (other,) = prove(rules, Case(changed, state, before, right))
    return measure.holds, other.holds


@pytest.mark.parametrize("rule", ["off_course", "slow", "collision", "false_alarm"])
def test_the_number_that_decided_a_call_holds_and_could_have_failed(rule: str) -> None:
    rules = PursuitEvasion(SETTINGS, contestants(intruders=1))
    x = 9.4 if rule == "collision" else 2.0
    ticks = [
        field(
            rules,
            {
                "i0": (x, 5.0 + (0.3 * n if rule == "off_course" else 0.0)),
                "p2": (9.5, 5.5 if rule == "collision" else 1.0),
            },
            time=0.1 * n,
            seen=[("p0", sighting(7.0, 5.0, 0.1 * n))] if rule == "false_alarm" else [],
        )
        for n in range(80)
    ]
    if rule == "collision":
        rules.settings = SETTINGS.model_copy(update={"capture_distance": 0.1})
    assert proved(rules, ticks, crossing(rules, "i0"), rule) == (True, False)
