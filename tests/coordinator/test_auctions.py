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


A3, B2 = ("ann", 3.0), ("bob", 2.0)


@pytest.mark.parametrize(
    ("ticks", "wins"),
    [
        ([(1.1, bids(A3, B2, ("cat", 4.0))), (1.5, [])], "bob"),
        ([(1.5, bids(("ann", 1e-9), ("bob", 0.0)))], "bob"),
        ([(1.1, bids(A3)), (1.2, []), (1.4, []), (1.499, [])], None),
        ([(1.1, bids(A3)), (1.499, []), (1.5, [])], "ann"),
        ([(1.5, []), (20.0, [])], None),
        ([(1.5, []), (20.0, []), (20.1, bids(("cat", 9.0)))], "cat"),
        ([(1.1, bids(A3)), (1.5, bids(("bob", 1.0)))], "bob"),
        ([(1.1, bids(("ann", 1.0), B2)), (1.2, bids(A3)), (1.5, [])], "bob"),
        ([(1.5, bids(("ann", 1.0), ("ann", 5.0), B2))], "bob"),
        ([(1.1, bids(("ann", 1.0), B2)), (1.2, bids(("ann", None))), (1.5, [])], "bob"),
        ([(1.1, bids(("ann", 1.0))), (1.2, bids(("ann", None))), (1.5, [])], None),
        ([(1.5, bids(("ann", 1.0), B2)), (9.0, [])], "ann"),
        ([(1.5, bids(("ann", 1.0), B2)), (2.0, bids(("bob", None)))], "ann"),
        ([(1.5, bids(("ann", 1.0))), (9.0, bids(("ann", None), A3)), (9.5, [])], "ann"),
        ([(1.5, bids(("ann", 1.0))), (9.0, bids(("ann", None), B2)), (9.5, [])], "bob"),
        ([(1.5, bids(("ann", 1.0))), (9.0, bids(B2, ("ann", None))), (9.5, [])], "bob"),
    ],
    ids=[
        "the lowest", "nothing is the lowest", "it lasts its time", "and no longer", "it stays open while nobody bids",
        "then the first bid", "a bid at the last tick", "the last word", "the last word within a tick",
        "not one that is withdrawn", "withdrawn by the only one", "the winner keeps it", "no loser gives it back",
        "who gave it back bids again", "a bid after it was given back", "a bid before it was given back",
    ],
)  # fmt: skip
def test_an_auction_is_won_by(ticks: Sequence[tuple[float, list[Offer]]], wins: str | None) -> None:
    assert winner(after(state(), *ticks)) == wins


def test_of_equal_bids_that_of_the_lowest_name_wins() -> None:
    for order in itertools.permutations(ALL):
        assert winner(after(state(), (1.5, bids(*((name, 2.0) for name in order))))) == "ann"
    assert lowest({"p2": 1.0, "p10": 1.0}) == "p10", "names are compared as texts"


def test_the_sum_of_many_ticks_is_no_reason_to_wait_for_one_more() -> None:
    clock, now = 1.0, state()
    for _ in range(5):
        clock += 0.1
        now = after(now, (clock, bids(A3)))
    assert winner(now) == "ann"


def test_an_auction_that_is_given_back_or_opened_again_has_no_bids_and_no_winner_and_lasts_its_time_again() -> None:
    won = after(state(), (1.5, bids(("ann", 1.0), B2)))
    back = after(won, (9.0, bids(("ann", None))))
    for again in (back.auctions["rug"], reopened(won.auctions["rug"], 9.0)):
        assert again == auction(opened=9.0)
    assert winner(after(back, (9.1, bids(B2)), (9.4, []))) is None
    assert winner(after(back, (9.1, bids(B2)), (9.5, []))) == "bob"


WON = after(state(), (1.5, bids(A3)))


@pytest.mark.parametrize(
    ("before", "offer", "why"),
    [
        (WON, Offer("bob", "rug", None), "ann has won it already"),
        (WON, Offer("bob", "rug", 0.1), "ann has won it already"),
        (WON, Offer("ann", "rug", 1.0), "ann has won it already"),
        (state(), Offer("ann", "vase", 1.0), "there is no such auction"),
        (GameState(), Offer("ann", "rug", 1.0), "there is no such auction"),
        *((state(auction(bidders=["ann", "bob"])), Offer(who, "rug", 1.0), "only ann, bob may bid")
          for who in ("dan", "rug", "", "Ann")),
        (state(auction(bidders=[])), Offer("ann", "rug", 1.0), "only nobody may bid"),
    ],
)  # fmt: skip
def test_a_bid_is_refused_in_words_and_changes_nothing(before: GameState, offer: Offer, why: str) -> None:
    said = f"the bid of {offer.bidder} for {offer.lot!r} is refused: {why}"
    assert auctioned(before, [offer], 1.6) == (before, [said])


def test_who_has_not_bid_may_withdraw_and_nothing_changes() -> None:
    now = state()
    assert auctioned(now, bids(("ann", None)), 1.1) == (now, [])
    assert auctioned(now, [], 1.1)[0] is now


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


def test_an_auction_that_is_closed_is_gone_and_closing_nothing_changes_nothing() -> None:
    assert closed(state(), "rug").auctions == {}
    assert closed(state(), "vase") == state()


def test_of_one_lot_there_is_one_auction() -> None:
    now = after(state(), (1.1, bids(("ann", 1.0))))
    assert opened(now, auction(opened=2.0)).auctions == {"rug": auction(opened=2.0)}


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
    one, other = (
        after(start, (clock, order), (clock + 0.3, []), (clock + 0.8, []))
        for order in (offers, rng.sample(offers, len(offers)))
    )
    assert one == other


@given(
    st.lists(
        st.tuples(st.sampled_from([*ALL, "dan"]), st.sampled_from([*lots, "nothing"]), st.none() | costs), max_size=40
    )
)
def test_whatever_is_bid_nobody_has_two_lots_and_who_wins_has_bid(told: list[tuple[str, str, float | None]]) -> None:
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
    now = after(state(auction(evidence=(seen,)), auction("vase")), (1.5, bids(A3, ("bob", 2.5))))
    assert msgspec.json.decode(msgspec.json.encode(now), type=GameState) == now
    assert msgspec.convert(msgspec.to_builtins(now), GameState) == now


# Messages.


@pytest.mark.parametrize("cost", [math.nan, math.inf, -math.inf, -1.0, -1e-9, 1.1e6])
def test_a_cost_that_is_none_cannot_be_sent_or_read_nor_be_in_a_state_of_the_referee(cost: float) -> None:
    state = RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(),
        clock=0.0, total=0.0, round=1, rounds=1, score={}, players=(), zones=(),
        auctions=(auction(bids={"ann": cost}),),
    )  # fmt: skip
    with pytest.raises(MessageError):
        checked(Bid(lot="rug", cost=cost))
    for body in (Bid(lot="rug", cost=cost), state):
        with pytest.raises(MessageError):
            decode(encode(Received("key", 1.0, 0, body)), type(body), "key")


@pytest.mark.parametrize("cost", [None, 0.0, 1e6, 3])
def test_a_cost_and_no_cost_can_be_sent(cost: float | None) -> None:
    assert decode(encode(Received("bid", 1.0, 0, checked(Bid(lot="rug", cost=cost)))), Bid, "bid").body.cost == cost


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


def test_before_play_and_while_it_is_halted_bids_are_not_taken_in() -> None:
    match = Match(Book())
    match.step(0.1, Observation({}, offers=bids(A3)), [])
    match.step(0.1, told(A3), [])
    assert match.stage is Stage.PLAY_ROUND, "it began with this tick"
    assert match.game.auctions["rug"].bids == {}
    match.step(0.1, told(A3), [])
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
