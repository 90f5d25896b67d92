"""In a match in one process a strategy holds the very state that the referee has published."""

from vrg.bus.messages import Auction, FieldObject
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Contestant, Field
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings
from vrg.types import Pose


def test_who_changes_it_does_not_change_the_game() -> None:
    places = {"red1": Pose(-3.0, 0.0, 0.0), "blue1": Pose(3.0, 0.0, 0.0)}
    book = RoboFlag(
        Settings(),
        [Contestant(name=n, role=n.rstrip("1"), start=p, size=(0.5, 0.5), v_max=0.7) for n, p in places.items()],
    )
    match, now = Match(book), Field(places)
    for _ in range(3):
        match.step(0.1, now, [])
    before = match.standing()
    state = match.state(now, estop=False)
    state.score["red"] = 3
    state.objects.clear()
    state.numbers.clear()
    state.players.clear()
    assert state.auctions, "the attack is auctioned"
    for auction in state.auctions:
        auction.bids["red1"] = 0.0
        auction.bidders.clear()
    state.auctions.clear()
    assert match.standing() == before
    again = match.state(now, estop=False)
    assert again.score == {"red": 0, "blue": 0}
    assert all(isinstance(thing, FieldObject) for thing in again.objects)
    assert all(isinstance(auction, Auction) and auction.bidders for auction in again.auctions)
