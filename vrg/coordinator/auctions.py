"""The referee's auctions, as pure functions (thesis 4.2.4: the coordinator keeps the marketplace).

A rule book opens an auction for a lot and names the bidders. Players bid the cost that the lot would have for them, and
may change their bids. When the auction has lasted long enough and a bid has arrived, the lowest bid wins. The winner
has the lot until it gives it back, or until the rule book closes the auction or opens it again. A player has at most
one lot: while it has one, it cannot bid for another.

Auctions are a part of the game's state. So they are in the journal, and are published to all.
"""

from collections.abc import Mapping, Sequence
from typing import TypeVar

from msgspec import structs

from vrg.bus.messages import Auction
from vrg.coordinator.rulebook import GameState, Offer

S = TypeVar("S", bound=GameState)


def opened(state: S, auction: Auction) -> S:
    """The state with one more auction. An auction of the same lot is replaced, and its bids are void."""
    return structs.replace(state, auctions={**state.auctions, auction.lot: auction})


def closed(state: S, lot: str) -> S:
    """The state without the auction of a lot."""
    return structs.replace(state, auctions={name: a for name, a in state.auctions.items() if name != lot})


def reopened(auction: Auction, clock: float) -> Auction:
    """The same auction, opened again at `clock`, s, without bids and winner."""
    return structs.replace(auction, opened=clock, bids={}, winner=None)


def auctioned(state: S, offers: Sequence[Offer], clock: float) -> tuple[S, list[str]]:
    """Take in bids, and decide the auctions that have lasted long enough.

    Args:
        offers: the bids since the tick before, in order. clock: the time of play in this round, s.

    Returns:
        the new state, and the reasons why bids were refused, in words.
    """
    auctions, refused = {lot: _of_bidders(state, auction) for lot, auction in state.auctions.items()}, []
    # A lot that is given back can be bid for at the same instant, in any order of arrival.
    for offer in sorted(offers, key=lambda offer: not _gives_back(auctions, offer)):
        auction = auctions.get(offer.lot)
        why = _refusal(auctions, offer)
        if auction is None or why:
            refused.append(f"the bid of {offer.bidder} for {offer.lot!r} is refused: {why}")
        else:
            auctions[offer.lot] = _with(auction, offer, clock)
    for lot in sorted(auctions):
        auction = auctions[lot]
        if auction.winner is None and auction.bids and clock >= auction.opened + auction.lasts - 1e-9:
            winner = lowest(auction.bids)
            auctions[lot] = structs.replace(auction, winner=winner)
            for other, open_one in auctions.items():
                if open_one.winner is None:
                    auctions[other] = structs.replace(open_one, bids=_without(open_one.bids, winner))
    if auctions == state.auctions:
        return state, refused
    return structs.replace(state, auctions=auctions), refused


def lowest(bids: Mapping[str, float]) -> str:
    """The player with the lowest bid; of equal ones that of the lowest name."""
    return min(bids, key=lambda name: (bids[name], name))


def _of_bidders(state: GameState, auction: Auction) -> Auction:
    """An auction without the bids of those that may not bid any more."""
    if auction.winner is not None:
        return auction
    left = {n: c for n, c in auction.bids.items() if n in auction.bidders and n not in state.disqualified}
    return structs.replace(auction, bids=left)


def _gives_back(auctions: Mapping[str, Auction], offer: Offer) -> bool:
    auction = auctions.get(offer.lot)
    return auction is not None and offer.cost is None and auction.winner == offer.bidder


def _refusal(auctions: Mapping[str, Auction], offer: Offer) -> str:
    """Why a bid does not count; empty if it does."""
    auction = auctions.get(offer.lot)
    if auction is None:
        return "there is no such auction"
    if offer.bidder not in auction.bidders:
        return f"only {', '.join(auction.bidders) or 'nobody'} may bid"
    if auction.winner is not None and not (auction.winner == offer.bidder and offer.cost is None):
        return f"{auction.winner} has won it already"
    won = [lot for lot, other in auctions.items() if other.winner == offer.bidder and lot != offer.lot]
    return f"it has won {won[0]}" if won else ""


def _with(auction: Auction, offer: Offer, clock: float) -> Auction:
    if auction.winner is not None:
        return reopened(auction, clock)  # the winner gives it back
    if offer.cost is None:
        return structs.replace(auction, bids=_without(auction.bids, offer.bidder))
    return structs.replace(auction, bids={**auction.bids, offer.bidder: offer.cost})


def _without(bids: Mapping[str, float], bidder: str) -> dict[str, float]:
    return {name: cost for name, cost in bids.items() if name != bidder}
