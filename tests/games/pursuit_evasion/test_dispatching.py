"""Two detections, one auction for each intruder, and the pursuer that is sent, tick by tick."""

import random
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.games.pursuit_evasion.making import SETTINGS, STARTS, Play, book, crossing, field, move, out, sighting
from vrg.bus.messages import PlayerStatus, Sighting, Stage
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Disqualification, Observation, Offer
from vrg.games.pursuit_evasion import SIGHTINGS_AT_ONCE
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.state import State
from vrg.types import Pose, Vector

THERE = (5.0, 5.0)


def counts(state: State) -> dict[str, int]:
    """The number of detections of each intruder that was seen, as far as it is counted."""
    return {name: len(times) for name, times in state.detected.items() if times}


def detections(*seen: tuple[str, Sighting], time: float = 10.0, place: Vector = THERE) -> int:
    """How often i0 counts as seen after one tick in which these sightings come in. It stands."""
    rules = book()
    state = move(rules, crossing(rules, "i0"), {"i0": place}, {"i0": place}, time=time, seen=seen).state
    return state.detections("i0")


def at(time: float, dx: float = 0.0, dy: float = 0.0) -> Sighting:
    return sighting(THERE[0] + dx, THERE[1] + dy, time)


@pytest.fixture
def rules() -> PursuitEvasion:
    """The rule book of three pursuers and two intruders."""
    return book()


# Detections.

SEEN: dict[str, tuple[list[tuple[str, Sighting]], int]] = {
    "at distinct times": ([("p0", at(9.8)), ("p0", at(9.9))], 2),
    "by distinct pursuers": ([("p0", at(9.8)), ("p2", at(9.9))], 2),
    "out of order": ([("p1", at(9.9)), ("p0", at(9.8))], 2),
    "by two at one time": ([("p0", at(9.9)), ("p1", at(9.9, 0.1))], 1),
    "by one twice at one time": ([("p0", at(9.9)), ("p0", at(9.9))], 1),
    "but it was a wall": ([("p0", at(9.9, 0.71)), ("p0", at(9.8, 0.0, -3.0))], 0),
    "somewhat aside": ([("p0", at(9.9, 0.69))], 1),
    # A sighting is judged by the look at the field that is nearest to it, at most 0.2 s away.
    "too long ago": ([("p0", at(9.79))], 0),
    "some time ago": ([("p0", at(9.81))], 1),
    "in the near future": ([("p0", at(10.19))], 1),
    "in the future": ([("p0", at(10.21))], 0),
}


@pytest.mark.parametrize(("seen", "count"), SEEN.values(), ids=SEEN)
def test_how_often_an_intruder_counts_as_seen(seen: list[tuple[str, Sighting]], count: int) -> None:
    assert detections(*seen) == count


def test_an_older_sighting_that_comes_a_tick_later_is_a_detection_too() -> None:
    play = Play(book(), crossing(book(), "i0"), 10.0)
    play.tick({"i0": THERE}, seen=[("p0", at(10.1))])
    play.tick({"i0": THERE}, seen=[("p1", at(10.0))])
    assert counts(play.state) == {"i0": 2}


def test_what_an_intruder_a_stranger_or_somebody_who_is_out_says_does_not_count() -> None:
    assert detections(("i0", at(9.9)), ("i1", at(9.8)), ("nobody", at(9.7))) == 0
    rules = book()
    state = move(
        rules, out(crossing(rules, "i0"), "p0"), {"i0": THERE}, {"i0": THERE}, seen=[("p0", at(9.9)), ("p1", at(9.8))]
    ).state
    assert counts(state) == {"i0": 1}


def test_an_intruder_that_waits_or_is_out_of_play_is_not_detected() -> None:
    rules = book(seed=1)
    for kind in ("waiting", "captured", "escaped"):
        state = rules.initial().with_state(["i1"], kind)
        seen = [("p0", sighting(-2.0, 3.0, 9.9))]
        assert counts(move(rules, state, {}, {}, clock=0.5, seen=seen).state) == {}


@pytest.mark.parametrize(("x", "expected"), [(5.0, {"i0": 1}), (6.0, {})])
def test_a_late_sighting_counts_for_where_the_intruder_was_then(x: float, expected: dict[str, int]) -> None:
    """It stood at 5 m, and has come to 6 m since the measurement."""
    play = Play(book(), crossing(book(), "i0"), 10.0)
    for way in (0.0, 0.0, 0.5, 1.0):
        play.tick({"i0": (5.0 + way, 5.0)})
    play.tick({"i0": (6.0, 5.0)}, seen=[("p0", sighting(x, 5.0, 10.1))])
    assert counts(play.state) == expected


def test_of_two_intruders_that_one_is_detected_which_is_nearer(rules: PursuitEvasion) -> None:
    where = {"i0": (5.0, 5.0), "i1": (5.0, 5.8)}
    seen = [("p0", sighting(5.0, 5.3, 9.8)), ("p0", sighting(5.0, 5.5, 9.9))]
    state = move(rules, crossing(rules, "i0", "i1"), where, where, seen=seen).state
    assert counts(state) == {"i0": 1, "i1": 1}


@given(st.integers(0, 10_000))
def test_sightings_are_counted_as_by_hand(seed: int) -> None:
    """Two intruders that stand; random sightings in one tick, from anybody and any time, each a distinct one.

    Of a pursuer that tells of a place where nobody is, none counts.
    """
    rng = np.random.default_rng(seed)
    rules = book()
    where = {"i0": tuple(rng.uniform(2, 8, 2).tolist()), "i1": tuple(rng.uniform(2, 8, 2).tolist())}
    bearings = [[np.arctan2(y - STARTS[p].y, x - STARTS[p].x) for x, y in where.values()] for p in ("p0", "p1")]
    if any(abs(a - b) < 0.8 for a, b in bearings):
        return  # one may hide the other
    seen, right, wrong = [], [], set()
    for i, time in enumerate(np.sort(rng.uniform(9.7, 10.3, SIGHTINGS_AT_ONCE)).tolist()):
        name = ("i0", "i1")[i % 2]
        x, y = (np.array(where[name]) + rng.normal(0, 0.5, 2)).tolist()
        who = rng.choice(["p0", "p1", "i1", "stranger"])
        seen.append((str(who), sighting(x, y, time)))
        gaps = {n: np.hypot(x - wx, y - wy) for n, (wx, wy) in where.items()}
        nearest = min(gaps, key=lambda n: gaps[n])
        bodies = {**{n: (p.x, p.y) for n, p in STARTS.items() if n != "i2"}, **where}
        alone = min(np.hypot(x - bx, y - by) for n, (bx, by) in bodies.items() if n != who)
        if min(abs(gaps[nearest] - 0.7), abs(alone - 0.7), abs(abs(10.0 - time) - 0.2)) < 1e-6:
            return
        if abs(10.0 - time) > 0.2 or who not in ("p0", "p1"):
            continue
        if alone > 0.7:
            wrong.add(who)
        elif gaps[nearest] < 0.7:
            right.append((who, nearest))
    state = move(rules, crossing(rules, "i0", "i1"), where, where, seen=seen).state
    expected = Counter(name for who, name in right if who not in wrong)
    assert counts(state) == {n: min(2, count) for n, count in expected.items()}


def test_what_is_published_of_an_intruder_is_what_pursuers_have_seen_oldest_first() -> None:
    play = Play(book(), crossing(book(), "i0"), 10.0)
    for i in range(60):
        play.tick({"i0": THERE}, seen=[("p0", at(10.0 + 0.1 * i, 0.01 * i))])
    evidence = play.state.auctions["i0"].evidence
    times = [s.time for s in evidence]
    assert times == sorted(times)
    assert 2 <= len(evidence) <= 8
    assert times[-1] > 15.5, "the newest are among them"
    assert all(s.x != THERE[0] for s in evidence), "what was seen, not where it is"


@pytest.mark.parametrize(("xx", "xy", "yy"), [(1.0, 1.0, 1.0), (1.0, -5.0, 1.0), (-1.0, 0.0, -1.0)])
def test_there_is_no_sighting_with_an_impossible_covariance(xx: float, xy: float, yy: float) -> None:
    """No course can be fitted to it, and it would stop all who try."""
    with pytest.raises(ValueError, match="positive definite"):
        structs.replace(at(9.8), xx=xx, xy=xy, yy=yy)


# Auctions.


@pytest.fixture
def play() -> Play:
    """i0 has been seen twice: its auction was opened at 10.2 s. It is in the middle of the area and stands."""
    rules = book()
    play = Play(rules, crossing(rules, "i0"), 10.0)
    play.tick({"i0": THERE}, seen=[("p0", at(10.1))])
    play.tick({"i0": THERE}, seen=[("p1", at(10.2))])
    return play


def wait(play: Play, ticks: int, *, seen: bool = True) -> None:
    for _ in range(ticks):
        play.tick({"i0": THERE}, seen=[("p0", at(play.clock + 0.1))] if seen else [])


@pytest.fixture
def chase(play: Play) -> Play:
    """p1 has been dispatched to i0."""
    play.tick({"i0": THERE}, bids=[("p0", "i0", 4.0), ("p1", "i0", 2.0)])
    wait(play, 5)
    return play


def test_there_is_no_auction_before_two_detections(rules: PursuitEvasion) -> None:
    play = Play(rules, crossing(rules, "i0"), 10.0)
    for time in (10.1, None, None, 10.1):
        play.tick({"i0": THERE}, seen=[] if time is None else [("p0", at(time))], bids=[("p0", "i0", 1.0)])
    assert play.state.auctions == {}
    assert play.state.states["p0"] == "watching"
    play.tick({"i0": THERE}, seen=[("p2", at(10.5))])
    assert list(play.state.auctions) == ["i0"]


def test_two_detections_open_one_auction_for_all_pursuers(play: Play) -> None:
    auction = play.state.auctions["i0"]
    assert (auction.lot, auction.bidders, auction.winner, auction.bids) == ("i0", ("p0", "p1", "p2"), None, {})
    assert auction.opened == pytest.approx(10.2)
    assert [s.time for s in auction.evidence] == [10.1, 10.2]
    assert [rule for rule in play.rulings if rule != "launch"] == ["auction"]
    wait(play, 10)
    assert play.rulings.count("auction") == 1


def test_the_lowest_bid_is_dispatched_and_the_winner_is_announced_to_all(chase: Play) -> None:
    assert chase.state.auctions["i0"].winner == "p1"
    assert chase.state.states["p1"] == "dispatched"
    assert chase.state.states["p0"] == chase.state.states["p2"] == "watching"
    assert [text for rule, text in chase.calls if rule == "dispatch"] == [
        "p1 is sent to meet i0 (bids: p0 4.0 s, p1 2.0 s)"
    ]


def test_ties_go_to_the_lowest_name(play: Play) -> None:
    play.tick({"i0": THERE}, bids=[("p2", "i0", 2.0), ("p0", "i0", 2.0), ("p1", "i0", 2.0)])
    wait(play, 5)
    assert play.state.auctions["i0"].winner == "p0"


def test_while_nobody_can_meet_it_the_auction_stays_open(play: Play) -> None:
    wait(play, 40)
    assert play.state.auctions["i0"].winner is None
    assert play.rulings.count("dispatch") == 0
    play.tick({"i0": THERE}, bids=[("p2", "i0", 9.0)])
    assert play.state.states["p2"] == "dispatched"


def test_an_intruder_may_not_bid(play: Play) -> None:
    play.tick({"i0": THERE}, bids=[("i0", "i0", 0.0), ("i1", "i0", 0.0)])
    assert play.state.auctions["i0"].bids == {}


def test_a_dispatched_pursuer_may_move_and_is_told_what_is_seen_later(chase: Play) -> None:
    last = chase.state.auctions["i0"].evidence[-1].time
    wait(chase, 10)
    assert chase.state.auctions["i0"].evidence[-1].time > last
    statuses: dict[str, PlayerStatus] = {
        s.name: s for s in chase.rules.statuses(chase.state, Stage.PLAY_ROUND, field(chase.rules))
    }
    assert {n for n, s in statuses.items() if s.may_move} == {"p1", "i0"}


# Lost intruders.


def test_a_winner_that_cannot_meet_it_gives_it_back_and_it_is_auctioned_again(chase: Play) -> None:
    chase.tick({"i0": THERE, "p1": (5, 8)}, seen=[("p0", at(chase.clock))], bids=[("p1", "i0", None)])
    auction = chase.state.auctions["i0"]
    assert (auction.winner, auction.bids, auction.opened) == (None, {}, pytest.approx(chase.clock))
    assert chase.state.states["p1"] == "returning"
    assert chase.calls[-1] == ("lost", "i0 is lost: p1 cannot meet it; the pursuers bid again")
    chase.tick({"i0": THERE, "p1": (5, 8)}, bids=[("p2", "i0", 3.0)])
    wait(chase, 5)
    assert chase.state.auctions["i0"].winner == "p2"
    assert chase.state.states["p2"] == "dispatched"
    assert chase.rulings.count("lost") == 1


def test_a_pursuer_on_its_way_back_may_be_dispatched_again(chase: Play) -> None:
    chase.tick({"i0": THERE, "p1": (5, 8)}, bids=[("p1", "i0", None)])
    for _ in range(6):
        chase.tick({"i0": THERE, "p1": (5, 8)}, seen=[("p0", at(chase.clock + 0.1))], bids=[("p1", "i0", 1.0)])
    assert chase.state.states["p1"] == "dispatched"


def test_when_the_winner_is_out_it_is_auctioned_again_among_the_others(chase: Play) -> None:
    chase.state = out(chase.state, "p1")
    wait(chase, 1)
    auction = chase.state.auctions["i0"]
    assert (auction.winner, auction.bidders) == (None, ("p0", "p2"))
    assert chase.calls[-1] == ("lost", "i0 is lost: p1 is disqualified; the pursuers bid again")
    assert chase.state.dispatched == {}


def test_an_intruder_that_nobody_sees_for_long_is_auctioned_again(chase: Play) -> None:
    wait(chase, 5)
    since = chase.clock
    while "lost" not in chase.rulings and chase.clock < since + 10.0:
        wait(chase, 1, seen=False)
    assert chase.clock - since == pytest.approx(SETTINGS.lost_after, abs=0.11)
    assert chase.calls[-1][1] == "i0 is lost: no pursuer sees it; the pursuers bid again"
    assert chase.state.auctions["i0"].winner is None
    assert chase.state.states["p1"] in ("returning", "watching")
    wait(chase, 60, seen=False)
    assert chase.rulings.count("lost") == 1, "it is lost once"


def test_an_intruder_that_is_seen_from_time_to_time_is_not_lost(chase: Play) -> None:
    for i in range(100):
        wait(chase, 1, seen=i % 30 == 0)
    assert "lost" not in chase.rulings


def test_who_is_dispatched_to_an_intruder_that_was_seen_long_ago_has_all_the_time_to_find_it(play: Play) -> None:
    wait(play, 100, seen=False)
    play.tick({"i0": THERE}, bids=[("p2", "i0", 3.0)])
    since = play.clock
    assert play.state.states["p2"] == "dispatched"
    while "lost" not in play.rulings:
        wait(play, 1, seen=False)
    assert play.clock - since == pytest.approx(SETTINGS.lost_after, abs=0.11)


def test_a_pursuer_that_is_out_is_not_dispatched_by_what_it_bid_before(play: Play) -> None:
    play.tick({"i0": THERE}, bids=[("p0", "i0", 4.0), ("p1", "i0", 2.0)])
    play.state = out(play.state, "p1")
    wait(play, 6)
    assert play.state.auctions["i0"].winner == "p0"
    assert [text.split()[0] for rule, text in play.calls if rule == "dispatch"] == ["p0"]


def test_when_an_intruder_is_out_its_pursuer_is_free_for_others(chase: Play) -> None:
    chase.state = out(chase.state, "i0")
    chase.tick({"i0": THERE, "p1": (5, 8)})
    assert chase.state.auctions == {}
    assert chase.state.states["p1"] == "returning"


def test_an_auction_that_lasts_hardly_any_time_sends_whom_it_has_found() -> None:
    """One gives the intruder back, and another bids for it in the same tick."""
    rules = book(SETTINGS.model_copy(update={"auction": 0.0}))
    play = Play(rules, crossing(rules, "i0"), 10.0)
    play.tick({"i0": THERE})
    play.tick({"i0": THERE}, seen=[("p0", at(10.1)), ("p0", at(10.2))])
    play.tick({"i0": THERE}, bids=[("p1", "i0", 2.0)])
    assert play.state.states["p1"] == "dispatched"
    play.tick({"i0": THERE}, bids=[("p1", "i0", None), ("p2", "i0", 3.0)])
    play.tick({"i0": THERE})
    assert play.state.auctions["i0"].winner == "p2"
    assert play.state.states["p2"] == "dispatched"


def test_two_intruders_are_auctioned_each_by_itself_and_nobody_is_sent_to_both(rules: PursuitEvasion) -> None:
    play = Play(rules, crossing(rules, "i0", "i1"), 30.0)
    where = {"i0": (5.0, 5.0), "i1": (5.0, 3.0)}
    for _ in range(10):
        seen = [("p0", sighting(*where[n], play.clock + 0.1)) for n in where]
        bids = [(p, n, cost) for p, cost in (("p0", 1.0), ("p1", 2.0), ("p2", 3.0)) for n in where]
        play.tick(where, seen=seen, bids=bids)
    assert {n: a.winner for n, a in play.state.auctions.items()} == {"i0": "p0", "i1": "p1"}
    assert [play.state.states[p] for p in ("p0", "p1", "p2")] == ["dispatched", "dispatched", "watching"]


# A whole match.


def test_a_match_from_the_start_to_a_capture_an_escape_and_a_draw() -> None:
    rules = book(seed=3)
    match, poses = Match(rules), dict(STARTS)
    poses.pop("i2")
    calls = []
    for i in range(900):
        time = 0.1 * i
        state = match.state(Observation(poses, time=time), estop=False)
        for status in state.players:
            if status.may_move and status.name[0] == "i":
                old = poses[status.name]
                poses[status.name] = Pose(old.x + 0.07, old.y, 0.0)
        p1 = state.player("p1")
        if p1 is not None and p1.state == "dispatched":
            poses["p1"] = Pose(poses["p1"].x, max(5.0, poses["p1"].y - 0.07), 0.0)
        elif p1 is not None and p1.may_move:
            poses["p1"] = STARTS["p1"]
        seen = [("p0", sighting(poses["i0"].x, poses["i0"].y, time))] if 0.5 < poses["i0"].x < 9.0 else []
        offers = [Offer("p1", a.lot, 3.0) for a in state.auctions if a.winner is None]
        outcome = match.step(0.1, Observation(dict(poses), time=time, sightings=seen, offers=offers), [])
        calls += [c.rule for c in outcome.calls]
        again = Match(rules, match.standing())
        assert again.game == match.game
        if match.over:
            break
    once = ["begin", "auction", "dispatch", "capture", "escape", "all_done", "game_over"]
    assert sorted(calls) == sorted([*once, "launch", "enter", "launch", "enter"])
    assert calls[-2:] == ["all_done", "game_over"]
    assert match.winner == "draw"
    assert match.game.auctions == {}
    assert match.game.states["p1"] in ("returning", "watching")


def test_a_disqualified_bidder_in_a_real_match_is_never_sent(rules: PursuitEvasion) -> None:
    match = Match(rules)
    match.step(0.1, field(rules, time=0.0), [])
    for i in range(1, 30):
        time, where = 0.1 * i, {"i0": THERE}
        seen = [("p0", at(time))]
        offers = [Offer("p1", "i0", 1.0), Offer("p0", "i0", 5.0)] if i < 5 else []
        match.step(0.1, field(rules, where, time=time, seen=seen, offers=offers), [])
        if i == 5:
            assert match.game.auctions["i0"].bids == {"p0": 5.0, "p1": 1.0}
            match.disqualify("p1", "it does not report", field(rules, where))
        auction = match.game.auctions.get("i0")
        assert auction is None or i < 5 or auction.winner != "p1"


@given(st.integers(0, 10_000))
def test_whatever_players_do_the_books_are_in_order(seed: int) -> None:
    """Anything may be seen, bid and given back, players drop out, robots are anywhere."""
    rng, rules = random.Random(seed), book(intruders=3, seed=seed)
    play = Play(rules)
    for _ in range(60):
        where = {n: (rng.uniform(-1, 11), rng.uniform(-1, 11)) for n in rules.contestants if rng.random() < 0.1}
        where = {n: (p.x, p.y) for n, p in play.before.poses.items()} | where
        names = list(rules.contestants)
        seen = [
            (
                rng.choice(names),
                sighting(x + rng.gauss(0, 0.3), y + rng.gauss(0, 0.3), play.clock + rng.uniform(-1, 0.2)),
            )
            for x, y in where.values()
            if rng.random() < 0.5
        ]
        bids = [(rng.choice(names), rng.choice(names), rng.choice([None, rng.uniform(0, 9)])) for _ in range(6)]
        if rng.random() < 0.02:
            gone = {**play.state.disqualified, rng.choice(names): Disqualification(why="x")}
            play.state = structs.replace(play.state, disqualified=gone)
        play.tick(where, seen=seen, bids=bids)
        state = play.state
        sent = {name: who for name, (who, _) in state.dispatched.items()}
        assert len(set(sent.values())) == len(sent), "one intruder a pursuer"
        assert set(sent) <= set(state.auctions)
        assert set(state.auctions) <= {n for n in rules.intruders if state.states[n] == "crossing"}
        for lot, auction in state.auctions.items():
            assert state.detections(lot) >= 2, "no dispatch before two detections"
            assert auction.winner == sent.get(lot)
        chasing = {n for n in rules.pursuers if state.states[n] == "dispatched"}
        assert chasing == set(sent.values())
        finished = [n for n in rules.intruders if state.states[n] in ("captured", "escaped")]
        assert state.points["pursuers"] + state.points["intruders"] == len(finished)
