"""Bids of RoboFlag: per team and per epoch, they expire; the lowest bid to reach the flag goes."""

import pytest

from tests.games.roboflag.making import AWAY, DT, FLAGS, HOMES, Play, book
from vrg.bus.messages import Auction
from vrg.coordinator.rulebook import Observation
from vrg.games.roboflag import FLAGGED, attack_of

LOT = attack_of("red")
QUIET, NEAR = (2.0, 0.0), (2.3, 0.0)


@pytest.fixture
def play() -> Play:
    """A match after its first tick, in which the auctions have been opened."""
    play = Play(book())
    play.tick()
    return play


def lot(play: Play, name: str = LOT) -> Auction:
    return play.state.auctions[name]


def won(play: Play, *bids: tuple[str, float], name: str = LOT) -> str | None:
    """The winner after the time for bids."""
    play.tick(bids=[(bidder, name, cost) for bidder, cost in bids])
    play.ticks(0.3)
    return lot(play, name).winner


def test_each_team_has_one_lot_in_which_only_its_own_players_bid(play: Play) -> None:
    assert set(play.state.auctions) == {"red attack", "blue attack"}
    for team in ("red", "blue"):
        assert lot(play, attack_of(team)).bidders == tuple(f"{team}{i}" for i in range(1, 5))


def test_the_lowest_bid_goes(play: Play) -> None:
    assert won(play, ("red1", 7.0), ("red3", 5.0), ("red2", 6.0)) == "red3"


def test_of_equal_bids_the_lowest_name_goes(play: Play) -> None:
    assert won(play, ("red4", 5.0), ("red2", 5.0)) == "red2"


def test_the_teams_bid_apart(play: Play) -> None:
    play.tick(bids=[("red1", LOT, 5.0), ("blue1", "blue attack", 1.0), ("blue2", LOT, 0.0)])
    play.ticks(0.3)
    assert [lot(play, name).winner for name in ("red attack", "blue attack")] == ["red1", "blue1"]


def test_nobody_wins_before_the_time_for_bids_is_over_and_a_lower_bid_may_still_come(play: Play) -> None:
    play.tick(bids=[("red1", LOT, 5.0)])
    assert lot(play).winner is None
    assert won(play, ("red2", 4.0)) == "red2"


def test_who_has_won_keeps_it_until_the_epoch_is_over(play: Play) -> None:
    assert won(play, ("red1", 5.0)) == "red1"
    assert won(play, ("red2", 1.0)) == "red1"
    play.ticks(8.5)
    assert won(play) == "red1"


def test_an_epoch_lasts_ten_seconds_of_play_and_then_all_bids_are_void(play: Play) -> None:
    assert won(play, ("red1", 5.0)) == "red1"
    first = lot(play)
    while play.match.clock < first.opened + 10.0 - 1.5 * DT:
        play.tick()
    assert lot(play) == first
    play.tick()
    again = lot(play)
    assert again.opened == pytest.approx(first.opened + 10.0)
    assert (again.winner, again.bids) == (None, {})
    assert won(play, ("red2", 9.0)) == "red2"


def test_bids_that_nobody_has_won_by_expire_too() -> None:
    play = Play(book(bidding=20.0))
    play.tick()
    play.tick(bids=[("red1", LOT, 1.0)])
    play.ticks(9.8)
    assert lot(play).bids == {"red1": 1.0}
    play.ticks(0.2)
    assert lot(play).bids == {}


def test_a_halt_is_no_part_of_an_epoch(play: Play) -> None:
    assert won(play, ("red1", 5.0)) == "red1"
    play.match.halt("somebody is on the field")
    play.ticks(30.0)
    play.match.resume()
    play.tick()
    assert lot(play).winner == "red1"


def test_tagged_players_may_not_bid(play: Play) -> None:
    play.tick({"red1": QUIET, "blue1": NEAR})
    assert lot(play).bidders == ("red2", "red3", "red4")
    assert won(play, ("red1", 0.0), ("red2", 8.0)) == "red2"


def test_a_bid_of_a_player_that_is_tagged_meanwhile_is_void(play: Play) -> None:
    play.tick(bids=[("red1", LOT, 0.0), ("red2", LOT, 8.0)])
    play.tick({"red1": QUIET, "blue1": NEAR})
    play.ticks(0.3)
    assert lot(play).winner == "red2"


def test_a_player_that_is_home_again_may_bid_again(play: Play) -> None:
    play.tick({"red1": QUIET, "blue1": NEAR})
    play.tick({"red1": HOMES["red"]})
    assert "red1" in lot(play).bidders


def test_disqualified_players_may_not_bid(play: Play) -> None:
    play.match.disqualify("red1", "it has failed", Observation({}))
    assert won(play, ("red1", 0.0), ("red2", 8.0)) == "red2"
    assert lot(play).bidders == ("red2", "red3", "red4")


def test_nobody_bids_while_a_team_mate_carries_the_flag(play: Play) -> None:
    play.tick({"red1": FLAGS["blue"]})
    assert play.state.states["red1"] == FLAGGED
    assert set(play.state.auctions) == {"blue attack"}
    play.tick(bids=[("red2", LOT, 1.0)])
    assert set(play.state.auctions) == {"blue attack"}


def test_there_is_a_new_auction_at_once_when_the_flag_is_home_or_has_returned(play: Play) -> None:
    play.capture("red1")
    assert lot(play).opened == pytest.approx(play.match.clock)
    play.tick({"red1": FLAGS["blue"]})
    assert LOT not in play.state.auctions
    play.tick({"red1": QUIET, "blue1": NEAR})
    assert lot(play).bidders == ("red2", "red3", "red4")


def test_there_is_a_new_auction_at_once_if_the_winner_is_tagged(play: Play) -> None:
    assert won(play, ("red1", 1.0), ("red2", 2.0)) == "red1"
    play.tick({"red1": QUIET, "blue1": NEAR})
    again = lot(play)
    assert (again.winner, again.bids, again.opened) == (None, {}, pytest.approx(play.match.clock))
    assert again.bidders == ("red2", "red3", "red4")


def test_there_is_a_new_auction_at_once_if_the_winner_fails(play: Play) -> None:
    assert won(play, ("red1", 1.0)) == "red1"
    play.match.disqualify("red1", "it has failed", Observation({}))
    play.tick()
    assert lot(play).winner is None


def test_a_mate_that_is_tagged_does_not_end_the_epoch(play: Play) -> None:
    assert won(play, ("red1", 1.0)) == "red1"
    play.tick({"red2": QUIET, "blue1": NEAR})
    auction = lot(play)
    assert (auction.winner, auction.bidders) == ("red1", ("red1", "red3", "red4"))


def test_a_team_without_normal_players_has_no_auction() -> None:
    play = Play(book(red=1, blue=2))
    play.tick({"red1": QUIET, "blue1": NEAR})
    assert set(play.state.auctions) == {"blue attack"}
    play.tick({"red1": HOMES["red"], "blue1": AWAY["blue"]})
    assert set(play.state.auctions) == {"red attack", "blue attack"}


def test_the_winner_gives_the_attack_back(play: Play) -> None:
    assert won(play, ("red1", 1.0)) == "red1"
    play.tick(bids=[("red1", LOT, None)])
    assert lot(play).winner is None
    assert won(play, ("red2", 3.0)) == "red2"


def test_auctions_end_with_the_round_and_begin_anew_with_the_next() -> None:
    play = Play(book(round_time=2.0))
    play.ticks(2.0)
    assert play.state.auctions == {}
    play.pause()
    play.tick()
    assert lot(play).opened == pytest.approx(DT)
