"""Whether teams look as if they played: nobody stands about, bodies are gone round, and tagged players come home."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.games.roboflag.making import FLAGS, HOMES
from tests.games.roboflag.playing import HERE, Moment, four_each, watched
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED

SPEED = 0.7
STANDS = 0.2
"""Whoever has not moved by this distance stands, m."""
LONGEST = {"Normal/Attack": 6.0, "Normal/Escort": 8.0, "Normal/Tag": 8.0, "Flagged/Evade": 10.0, "Referee": 6.0}
"""How long somebody may stand that has something else to do than to guard, s."""
BODIES = 0.45
"""The distance of the centres of two Pioneers below which they have pushed each other, m."""

MATCHES = [
    ("aggressive", "conservative", 0),
    pytest.param("balanced", "mixed", 1, marks=pytest.mark.thorough),
    pytest.param("aggressive-two-groups", "tag-defense", 2, marks=pytest.mark.thorough),
    pytest.param("flagged-safety", "hail-mary", 3, marks=pytest.mark.thorough),
]


def standing_times(seen: Sequence[Moment], name: str) -> dict[str, float]:
    """The longest time in s that a player stood, for each thing that it was doing."""
    longest: dict[str, float] = {}
    since, place, doing = 0.0, (math.inf, math.inf), ""
    for moment in seen:
        here, mode = moment.place(name), moment.modes[name]
        if not moment.playing or mode != doing or math.dist(here, place) > STANDS:
            since, place, doing = moment.time, here, mode
        longest[doing] = max(longest.get(doing, 0.0), moment.time - since)
    return longest


@pytest.mark.parametrize(("red", "blue", "seed"), MATCHES)
def test_a_match_looks_played(red: str, blue: str, seed: int, tmp_path: Path) -> None:
    seen = watched(tmp_path, four_each(red, blue), 60.0, seed)
    names = [player.name for player in seen[-1].state.players]
    for name in names:
        for mode, time in standing_times(seen, name).items():
            assert time <= LONGEST.get(mode, math.inf), f"{name} stood for {time:.1f} s in {mode}"
    _tagged_players_come_home(seen, names)
    _only_the_referee_drives_the_tagged(seen, names)
    assert any(moment.status(name).state != NORMAL for moment in seen for name in names), "something happened"


def _tagged_players_come_home(seen: Sequence[Moment], names: Sequence[str]) -> None:
    for name in names:
        home = HOMES[name.rstrip("0123456789")]
        since: tuple[float, float] | None = None
        for moment in seen:
            if moment.status(name).state != TAGGED or not moment.playing:
                since = None
                continue
            since = since or (moment.time, math.dist(moment.place(name), home) / SPEED)
            assert moment.time - since[0] < 2.0 * since[1] + 10.0, f"{name} is not home at {moment.time:.1f} s"


def _only_the_referee_drives_the_tagged(seen: Sequence[Moment], names: Sequence[str]) -> None:
    for before, moment in itertools.pairwise(seen):
        for name in names:
            tagged = [m.playing and m.status(name).state == TAGGED for m in (before, moment)]
            if all(tagged):
                assert moment.status(name).lease is not None
                assert moment.modes[name] == "Referee"
            elif not any(tagged):
                assert moment.status(name).lease is None


def test_a_standing_mate_on_the_way_to_the_flag_is_gone_round(tmp_path: Path) -> None:
    players = [
        ("red1", -2.0, -1.6, "conservative"),
        ("red2", -0.8, -1.6, f"{HERE}:Standing"),
        ("red3", -1.2, 0.2, f"{HERE}:Standing"),
        ("blue1", 5.0, -3.4, f"{HERE}:Standing"),
    ]
    seen = watched(tmp_path, players, 60.0, rules="round_time = 55.0")
    taken = [moment.time for moment in seen if moment.status("red1").state == FLAGGED]
    assert taken, "it takes the flag"
    assert taken[0] < 3.0 * math.dist((-2.0, -1.6), FLAGS["blue"]) / SPEED
    assert seen[-1].state.score["red"] >= 1, "and brings it home"
    assert min(math.dist(m.place("red1"), m.place("red2")) for m in seen) > BODIES


@pytest.mark.parametrize("aside", [0.0, 0.15, -0.3])
def test_two_mates_that_meet_head_on_in_an_empty_field_pass_each_other(aside: float, tmp_path: Path) -> None:
    players = [
        ("red1", -0.6, 0.0, f"{HERE}:Crossing"),
        ("red2", -5.4, aside, f"{HERE}:Crossing"),
        ("blue1", 5.0, -3.4, f"{HERE}:Standing"),
    ]
    seen = watched(tmp_path, players, 25.0)
    for name, goal in (("red1", (-5.4, 0.0)), ("red2", (-0.6, aside))):
        assert min(math.dist(moment.place(name), goal) for moment in seen) < 0.5
    assert min(math.dist(m.place("red1"), m.place("red2")) for m in seen) > BODIES


def test_a_lone_attacker_against_nobody_who_moves_wins(tmp_path: Path) -> None:
    players = [("red1", -1.5, 0.0, "aggressive"), ("blue1", 5.5, 3.0, f"{HERE}:Standing")]
    seen = watched(tmp_path, players, 150.0)
    assert seen[-1].state.winner == "red"


def test_whoever_only_stands_on_the_other_half_is_tagged_and_driven_home(tmp_path: Path) -> None:
    """The player itself wants to stand, but the referee drives its robot."""
    players = [("red1", -1.5, 0.0, f"{HERE}:Intruding"), ("blue1", 3.0, 1.5, "tag-defense")]
    seen = watched(tmp_path, players, 60.0)
    from_tag = itertools.dropwhile(lambda moment: moment.status("red1").state != TAGGED, seen)
    tagged = list(itertools.takewhile(lambda moment: moment.status("red1").state == TAGGED, from_tag))
    assert tagged
    first, last = tagged[0], tagged[-1]
    assert last.time - first.time < 1.5 * math.dist(first.place("red1"), HOMES["red"]) / SPEED + 5.0
    assert math.dist(last.place("red1"), HOMES["red"]) < 1.4, "it is at home when it plays again"
