"""Soccer with a real ball, which a source of fixes sees, or loses."""

import random
from dataclasses import replace

import pytest
from msgspec import structs
from test_soccer import BALL, contestants, field

from vrg.coordinator.rulebook import Observation
from vrg.regions import Circle
from vrg_games.soccer import BLUES, REDS
from vrg_games.soccer.rules import GRACE, Soccer
from vrg_games.soccer.settings import Settings


@pytest.fixture
def book() -> Soccer:
    made = Soccer(Settings(), contestants(), 7)
    made.equip([replace(BALL, tracked=True)])
    return made


def lost(seen: Observation) -> Observation:
    return replace(seen, things={name: structs.replace(thing, lost=True) for name, thing in seen.things.items()})


def test_of_a_lost_ball_neither_goals_nor_kicks_are_judged_nor_its_progress(book: Soccer) -> None:
    state = structs.replace(book.initial(), kick="", last=REDS, since=1.0)
    inside, goal, out = field(book, 2.9, 0.3), field(book, 3.1, 0.3), field(book, 0.5, 2.1)
    for before, now in ((lost(inside), goal), (inside, lost(goal)), (lost(field(book, 0.5, 1.9)), out)):
        verdict = book.judge(state, before, now, 50.0)
        assert (list(verdict.calls), verdict.round_over, dict(verdict.place)) == ([], False, {})
        assert verdict.state == structs.replace(state, since=50.0), "it begins to be without progress when it is seen"
    assert [call.rule for call in book.judge(state, inside, goal, 5.0).calls] == ["goal"]


def test_a_ball_that_is_found_behind_the_line_is_out_and_no_goal(book: Soccer) -> None:
    state, behind = structs.replace(book.initial(), kick="", last=REDS), field(book, 3.1, 0.3)
    state = book.judge(state, lost(field(book, 2.9, 0.3)), behind, 10.0).state
    assert [call.rule for call in book.judge(state, behind, behind, 10.1).calls] == ["free_kick"]


def test_the_time_ends_the_match_also_while_the_ball_is_lost(book: Soccer) -> None:
    here = lost(field(book, 0.0, 0.0))
    verdict = book.judge(book.initial(), here, here, book.settings.time)
    assert ([call.rule for call in verdict.calls], verdict.round_over) == (["time_up"], True)


def test_people_put_a_real_ball_near_its_spot_and_are_waited_for(book: Soccer) -> None:
    state = structs.replace(book.initial(), kick="", last=REDS)
    out = book.judge(state, field(book, 1.0, 1.95), field(book, 1.0, 2.1), 10.0)
    assert (out.state.kick, out.state.spot) == (BLUES, (1.0, 1.8))
    assert [zone.region for zone in book.zones(out.state) if zone.name == "spot"] == [Circle(1.0, 1.8, 0.15)]
    there, state = field(book, 1.0, 2.3), out.state
    for clock in (11.0, 10.0 + 2 * GRACE, 30.0):
        waited = book.judge(state, there, there, clock)
        assert (list(waited.calls), waited.state.placing) == ([], True)
        state = waited.state
    near = field(book, 1.1, 1.75)
    rolls = replace(near, things={name: structs.replace(thing, vy=-0.5) for name, thing in near.things.items()})
    assert book.judge(state, there, rolls, 30.5).state.placing, "it only passes there"
    put = book.judge(state, there, near, 31.0).state
    assert "spot" not in [zone.name for zone in book.zones(put)]
    assert (put.kick, put.placing, put.spot, put.since) == (BLUES, False, (1.1, 1.75), 31.0)
    taken = book.judge(put, field(book, 1.1, 1.75), field(book, 1.3, 1.6, blue=(1.4, 1.6)), 33.0)
    assert (list(taken.calls), taken.state.kick) == ([], "")


def test_no_call_is_about_a_ball_that_is_lost_at_random(book: Soccer) -> None:
    rng, state, before = random.Random(3), book.initial(), field(book, 0.0, 0.0)
    for look in range(2000):
        x, y = rng.uniform(-3.3, 3.3), rng.uniform(-2.3, 2.3)
        now = field(book, x, y, 0.1 * look)
        now = lost(now) if rng.random() < 0.5 else now
        verdict = book.judge(state, before, now, min(90.0, 0.1 * look))
        unseen = now.things["ball"].lost or before.things["ball"].lost
        assert not (unseen and verdict.calls)
        state, before = verdict.state, now
