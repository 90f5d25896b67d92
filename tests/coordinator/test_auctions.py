"""The referee's auctions: the lowest bid wins, and a player has at most one lot."""

import itertools
import math
import random
from collections.abc import Mapping, Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.codec import Received, checked, decode, encode
from vrg.bus.messages import Auction, Bid, RefereeState, Sighting, Stage
from vrg.coordinator.auctions import auctioned, closed, lowest, opened, reopened
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, Offer, RuleBook, Verdict
from vrg.errors import MessageError
from vrg.types import Pose

LASTS = 0.5
ALL = ["ann", "bob", "cat"]


def auction(lot: str = "rug", bidders: Sequence[str] = ALL, **others: object) -> Auction:
    return msgspec.structs.replace(Auction(lot=lot, bidders=tuple(bidders), opened=1.0, lasts=LASTS), **others)


def state(*auctions: Auction) -> GameState:
    made = GameState()
    for each in auctions or (auction(),):
        made = opened(made, each)
    return made


def bids(*offers: tuple[str, float | None], lot: str = "rug") -> list[Offer]:
    return [Offer(bidder, lot, cost) for bidder, cost in offers]


def after(start: GameState, *ticks: tuple[float, list[Offer]]) -> GameState:
    for clock, offers in ticks:
        start, _ = auctioned(start, offers, clock)
    return start


def winner(of: GameState, lot: str = "rug") -> str | None:
    return of.auctions[lot].winner


def test_the_lowest_bid_wins() -> None:
    assert winner(after(state(), (1.1, bids(("ann", 3.0), ("bob", 2.0), ("cat", 4.0))), (1.5, []))) == "bob"


def test_a_bid_of_nothing_is_the_lowest() -> None:
    assert winner(after(state(), (1.5, bids(("ann", 1e-9), ("bob", 0.0))))) == "bob"


def test_of_equal_bids_that_of_the_lowest_name_wins() -> None:
    for order in itertools.permutations(ALL):
        assert winner(after(state(), (1.5, bids(*((name, 2.0) for name in order))))) == "ann"
    assert lowest({"p2": 1.0, "p10": 1.0}) == "p10", "names are compared as texts"


def test_an_auction_lasts_at_least_its_time() -> None:
    bid = after(state(), (1.1, bids(("ann", 3.0))))
    assert winner(after(bid, (1.2, []), (1.4, []), (1.499, []))) is None
    assert winner(after(bid, (1.499, []), (1.5, []))) == "ann"


def test_the_sum_of_many_ticks_is_no_reason_to_wait_for_one_more() -> None:
    clock, now = 1.0, state()
    for _ in range(5):
        clock += 0.1
        now = after(now, (clock, bids(("ann", 3.0))))
    assert winner(now) == "ann"


def test_it_stays_open_while_nobody_bids_and_then_the_first_bid_wins() -> None:
    waiting = after(state(), (1.5, []), (20.0, []))
    assert winner(waiting) is None
    assert winner(after(waiting, (20.1, bids(("cat", 9.0))))) == "cat"


def test_a_bid_at_the_last_tick_counts() -> None:
    assert winner(after(state(), (1.1, bids(("ann", 3.0))), (1.5, bids(("bob", 1.0))))) == "bob"


def test_who_changes_its_bid_is_taken_at_its_last_word() -> None:
    now = after(state(), (1.1, bids(("ann", 1.0), ("bob", 2.0))), (1.2, bids(("ann", 3.0))))
    assert now.auctions["rug"].bids == {"ann": 3.0, "bob": 2.0}
    assert winner(after(now, (1.5, []))) == "bob"
    assert winner(after(state(), (1.5, bids(("ann", 1.0), ("ann", 5.0), ("bob", 2.0))))) == "bob", "also within a tick"


def test_a_bid_that_is_withdrawn_does_not_count() -> None:
    assert (
        winner(after(state(), (1.1, bids(("ann", 1.0), ("bob", 2.0))), (1.2, bids(("ann", None))), (1.5, []))) == "bob"
    )
    assert winner(after(state(), (1.1, bids(("ann", 1.0))), (1.2, bids(("ann", None))), (1.5, []))) is None


def test_who_has_not_bid_may_withdraw_all_the_same() -> None:
    now, refused = auctioned(state(), bids(("ann", None)), 1.1)
    assert refused == []
    assert now.auctions["rug"].bids == {}


def test_the_winner_has_it_until_it_gives_it_back() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0), ("bob", 2.0))))
    assert winner(after(won, (9.0, []))) == "ann"
    back = after(won, (9.0, bids(("ann", None))))
    again = back.auctions["rug"]
    assert (again.winner, again.bids, again.opened, again.lasts) == (None, {}, 9.0, LASTS)
    assert winner(after(back, (9.1, bids(("bob", 2.0))), (9.4, []))) is None, "it lasts its time again"
    assert winner(after(back, (9.1, bids(("bob", 2.0))), (9.5, []))) == "bob"


def test_who_has_given_it_back_may_bid_again() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0))))
    assert winner(after(won, (9.0, bids(("ann", None), ("ann", 3.0))), (9.5, []))) == "ann"


def test_a_loser_cannot_give_back_what_another_has_won() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0), ("bob", 2.0))))
    now, refused = auctioned(won, bids(("bob", None)), 2.0)
    assert winner(now) == "ann"
    assert refused == ["the bid of bob for 'rug' is refused: ann has won it already"]


def test_a_bid_that_comes_too_late_is_refused() -> None:
    won = after(state(), (1.5, bids(("ann", 3.0))))
    now, refused = auctioned(won, bids(("bob", 0.1)), 1.6)
    assert now == won
    assert refused == ["the bid of bob for 'rug' is refused: ann has won it already"]


def test_the_winner_cannot_change_the_bid_by_which_it_has_won() -> None:
    won = after(state(), (1.5, bids(("ann", 3.0))))
    now, refused = auctioned(won, bids(("ann", 1.0)), 1.6)
    assert now == won
    assert len(refused) == 1


def test_a_bid_for_what_is_not_auctioned_is_refused() -> None:
    now, refused = auctioned(state(), bids(("ann", 1.0), lot="vase"), 1.1)
    assert now == state()
    assert refused == ["the bid of ann for 'vase' is refused: there is no such auction"]
    assert auctioned(GameState(), bids(("ann", 1.0)), 1.1)[1] == [
        "the bid of ann for 'rug' is refused: there is no such auction"
    ]


@pytest.mark.parametrize("who", ["dan", "rug", "", "Ann"])
def test_a_bid_of_somebody_who_may_not_bid_is_refused(who: str) -> None:
    now, refused = auctioned(state(auction(bidders=["ann", "bob"])), bids((who, 1.0)), 1.5)
    assert winner(now) is None
    assert refused == [f"the bid of {who} for 'rug' is refused: only ann, bob may bid"]
    assert auctioned(state(auction(bidders=[])), bids((who, 1.0)), 1.5)[1] == [
        f"the bid of {who} for 'rug' is refused: only nobody may bid"
    ]


def test_who_may_bid_no_longer_does_not_win() -> None:
    """A rule book takes somebody off the list, who has bid before."""
    now = after(state(), (1.1, bids(("ann", 1.0), ("bob", 2.0))))
    now = opened(now, msgspec.structs.replace(now.auctions["rug"], bidders=("bob", "cat")))
    assert winner(after(now, (1.5, []))) == "bob"


def test_a_player_has_at_most_one_lot() -> None:
    """Ann is the best for both; the lot of the lower name is decided first, and her other bid is void."""
    both = state(auction("rug"), auction("vase"))
    now = after(both, (1.5, [*bids(("ann", 1.0), ("bob", 5.0)), *bids(("ann", 0.5), ("cat", 6.0), lot="vase")]))
    assert (winner(now, "rug"), winner(now, "vase")) == ("ann", "cat")
    alone = after(both, (1.5, [*bids(("ann", 1.0)), *bids(("ann", 0.5), lot="vase")]))
    assert (winner(alone, "rug"), winner(alone, "vase")) == ("ann", None)
    assert alone.auctions["vase"].bids == {}


def test_who_has_a_lot_cannot_bid_for_another_until_it_is_given_back_or_closed() -> None:
    won = after(state(auction("rug"), auction("vase")), (1.5, bids(("ann", 1.0))))
    now, refused = auctioned(won, bids(("ann", 1.0), lot="vase"), 1.6)
    assert refused == ["the bid of ann for 'vase' is refused: it has won rug"]
    assert winner(now, "vase") is None
    given_back = after(won, (1.6, [*bids(("ann", None)), *bids(("ann", 1.0), lot="vase")]))
    assert winner(given_back, "vase") == "ann"
    assert winner(after(closed(won, "rug"), (1.6, bids(("ann", 1.0), lot="vase"))), "vase") == "ann"


def test_an_open_auction_forgets_the_bid_of_who_has_won_another() -> None:
    """The second auction began later, so that it is still open when Ann wins the first."""
    now = state(auction("rug"), auction("vase", opened=1.3))
    now = after(now, (1.4, [*bids(("ann", 1.0)), *bids(("ann", 1.0), ("bob", 2.0), lot="vase")]), (1.5, []))
    assert winner(now, "rug") == "ann"
    assert now.auctions["vase"].bids == {"bob": 2.0}
    assert winner(after(now, (1.8, [])), "vase") == "bob"


def test_an_auction_that_is_opened_again_has_no_bids_and_no_winner() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0)))).auctions["rug"]
    again = reopened(won, 7.0)
    assert (again.lot, again.bidders, again.opened, again.lasts) == ("rug", tuple(ALL), 7.0, LASTS)
    assert (again.bids, again.winner) == ({}, None)


def test_an_auction_that_is_closed_is_gone_and_closing_nothing_changes_nothing() -> None:
    assert closed(state(), "rug").auctions == {}
    assert closed(state(), "vase") == state()


def test_of_one_lot_there_is_one_auction() -> None:
    now = after(state(), (1.1, bids(("ann", 1.0))))
    assert opened(now, auction(opened=2.0)).auctions == {"rug": auction(opened=2.0)}


def test_a_tick_in_which_nothing_happens_leaves_the_state_as_it_is() -> None:
    now = state()
    assert auctioned(now, [], 1.1)[0] is now


def test_the_state_that_was_handed_in_is_as_it_was() -> None:
    now = state(auction("rug"), auction("vase"))
    written = msgspec.json.encode(now)
    auctioned(now, [*bids(("ann", 1.0)), *bids(("ann", 1.0), lot="vase")], 1.5)
    assert msgspec.json.encode(now) == written


costs = st.floats(0, 1e6) | st.sampled_from([0.0, 1.0, 2.0])
lots = ["rug", "urn", "vase"]
books = st.dictionaries(st.tuples(st.sampled_from(ALL), st.sampled_from(lots)), costs, max_size=9)


@given(books, st.randoms(use_true_random=False), st.floats(1.0, 2.0))
def test_the_order_of_bids_does_not_matter(
    told: Mapping[tuple[str, str], float], rng: random.Random, clock: float
) -> None:
    offers = [Offer(who, lot, cost) for (who, lot), cost in told.items()]
    start = state(*(auction(lot, opened=1.0 + 0.2 * i) for i, lot in enumerate(lots)))
    one, other = start, start
    for order, which in ((offers, 0), (rng.sample(offers, len(offers)), 1)):
        end = after(start, (clock, order), (clock + 0.3, []), (clock + 0.8, []))
        one, other = (end, other) if which == 0 else (one, end)
    assert one == other


def test_a_bid_counts_whether_it_is_heard_before_or_after_the_winner_gives_back() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0))))
    offers = bids(("ann", None), ("bob", 2.0))
    ends = [after(won, (9.0, order), (9.5, [])) for order in (offers, offers[::-1])]
    assert [winner(end) for end in ends] == ["bob", "bob"]


@given(
    st.lists(
        st.tuples(st.sampled_from([*ALL, "dan"]), st.sampled_from([*lots, "nothing"]), st.none() | costs), max_size=40
    )
)
def test_whatever_is_bid_nobody_has_two_lots_and_who_wins_has_bid_and_may(
    told: list[tuple[str, str, float | None]],
) -> None:
    now = state(*(auction(lot, bidders=ALL[: 1 + i]) for i, lot in enumerate(lots)))
    for i in range(0, len(told), 4):
        now, _ = auctioned(now, [Offer(*each) for each in told[i : i + 4]], 1.0 + 0.1 * i)
        winners = [a.winner for a in now.auctions.values() if a.winner is not None]
        assert len(set(winners)) == len(winners)
        for each in now.auctions.values():
            assert set(each.bids) <= set(each.bidders)
            if each.winner is not None:
                assert each.bids[each.winner] == min(each.bids.values())
        assert msgspec.json.decode(msgspec.json.encode(now), type=GameState) == now


def test_auctions_survive_the_journal() -> None:
    seen = Sighting(x=1.0, y=2.0, time=3.0, xx=0.01, xy=-0.001, yy=0.02)
    now = after(state(auction(evidence=(seen,)), auction("vase")), (1.5, bids(("ann", 1.0), ("bob", 2.5))))
    assert msgspec.json.decode(msgspec.json.encode(now), type=GameState) == now
    assert msgspec.convert(msgspec.to_builtins(now), GameState) == now


# Messages.


@pytest.mark.parametrize("cost", [math.nan, math.inf, -math.inf, -1.0, -1e-9, 1.1e6])
def test_a_cost_that_is_none_cannot_be_sent_or_read(cost: float) -> None:
    with pytest.raises(MessageError):
        checked(Bid(lot="rug", cost=cost))
    with pytest.raises(MessageError):
        decode(encode(Received("bid", 1.0, 0, Bid(lot="rug", cost=cost))), Bid, "bid")


@pytest.mark.parametrize("cost", [None, 0.0, 1e6, 3])
def test_a_cost_and_no_cost_can_be_sent(cost: float | None) -> None:
    assert decode(encode(Received("bid", 1.0, 0, checked(Bid(lot="rug", cost=cost)))), Bid, "bid").body.cost == cost


@pytest.mark.parametrize("cost", [math.nan, math.inf, -1.0])
def test_no_state_of_the_referee_holds_a_cost_that_is_none(cost: float) -> None:
    body = RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(),
        clock=0.0, total=0.0, round=1, rounds=1, score={}, players=(), zones=(),
        auctions=(auction(bids={"ann": cost}),),
    )  # fmt: skip
    with pytest.raises(MessageError):
        decode(encode(Received("referee", 1.0, 0, body)), RefereeState, "referee")


# A match takes bids in.


class Book(RuleBook[GameState]):
    """A game in which a rug is auctioned from the beginning of each round to the end of the world."""

    name = "test-game"
    rounds = 2
    state_type = GameState

    def __init__(self) -> None:
        super().__init__([Contestant(name=n, role="t", start=Pose(0, 0, 0), size=(0.5, 0.3), v_max=1.0) for n in ALL])

    def initial(self) -> GameState:
        return state(auction(opened=0.0))

    def obstacles_to_start(self, state: GameState, now: Observation) -> dict[str, str]:
        return {} if now.poses else {"ann": "is not in the world"}

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        winner = state.auctions["rug"].winner
        return Verdict(state, [Call(rule="sold", text=f"to {winner} at {clock:.1f} s")] if winner else [])

    def next_round(self, state: GameState, now: Observation) -> Verdict[GameState]:
        return Verdict(state, winner="draw")


HERE = {name: Pose(0.0, 0.0, 0.0) for name in ALL}


def told(*offers: tuple[str, float | None]) -> Observation:
    return Observation(HERE, offers=bids(*offers))


def playing() -> Match:
    match = Match(Book())
    match.step(0.1, Observation(HERE), [])
    assert match.stage is Stage.PLAY_ROUND
    return match


def test_in_play_a_match_takes_bids_in_and_its_rule_book_sees_who_has_won_in_the_same_tick() -> None:
    match = playing()
    match.step(0.1, told(("ann", 3.0), ("bob", 2.0)), [])
    assert match.game.auctions["rug"].bids == {"ann": 3.0, "bob": 2.0}
    calls = [call.text for _ in range(4) for call in match.step(0.1, Observation(HERE), []).calls]
    assert calls == ["to bob at 0.5 s"]
    published = match.state(Observation(HERE), estop=False)
    assert [a.winner for a in published.auctions] == ["bob"]
    assert published.auction("rug") is published.auctions[0]
    assert published.auction("vase") is None


def test_before_play_bids_are_not_taken_in() -> None:
    match = Match(Book())
    match.step(0.1, Observation({}, offers=bids(("ann", 3.0))), [])
    match.step(0.1, told(("ann", 3.0)), [])
    assert match.stage is Stage.PLAY_ROUND, "it began with this tick"
    assert match.game.auctions["rug"].bids == {}


def test_while_play_is_halted_bids_are_not_taken_in() -> None:
    match = playing()
    match.step(0.1, told(("ann", 3.0)), [])
    match.halt("a test")
    for _ in range(10):
        match.step(0.1, told(("bob", 1.0)), [])
    assert match.game.auctions["rug"].bids == {"ann": 3.0}
    assert match.game.auctions["rug"].winner is None, "and its clock stands"


def test_a_match_that_goes_on_from_its_journal_knows_the_auction() -> None:
    match = playing()
    match.step(0.1, told(("ann", 3.0)), [])
    again = Match(Book(), match.standing())
    again.resume()
    assert again.game == match.game
    for _ in range(5):
        again.step(0.1, Observation(HERE), [])
    assert again.game.auctions["rug"].winner == "ann"


def test_a_player_that_is_disqualified_does_not_win_by_what_it_bid_before() -> None:
    match = playing()
    match.step(0.1, told(("ann", 1.0), ("bob", 2.0)), [])
    match.disqualify("ann", "it does not report", Observation(HERE))
    for _ in range(6):
        match.step(0.1, Observation(HERE), [])
    assert match.game.auctions["rug"].winner != "ann"
