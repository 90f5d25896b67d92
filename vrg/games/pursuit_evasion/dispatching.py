"""Dispatches pursuers to intruders: the auctions of the game (Algorithm 4.1), as functions of its state."""

from collections.abc import Sequence

from msgspec import structs

from vrg.bus.messages import Auction
from vrg.coordinator.auctions import closed, opened, reopened
from vrg.coordinator.rulebook import Call, Observation
from vrg.games.pursuit_evasion import DISPATCHED, RETURNING
from vrg.games.pursuit_evasion.settings import Settings
from vrg.games.pursuit_evasion.state import State

DETECTIONS = 2
"""The number of detections of an intruder that its first auction needs."""


def dispatch(
    state: State, pursuers: Sequence[str], now: Observation, clock: float, settings: Settings, calls: list[Call]
) -> State:
    """Open the auctions that are due, announce who has won and who has lost an intruder, and keep them up to date."""
    bidders = tuple(name for name in pursuers if name not in state.disqualified)
    for name in sorted(set(state.auctions) - set(state.crossing())):
        state = reset(state, name)  # it is disqualified
    for name in state.crossing():
        auction = state.auctions.get(name)
        if auction is None:
            if state.detections(name) >= DETECTIONS:
                auction = Auction(lot=name, bidders=bidders, opened=clock, lasts=settings.auction)
                state = opened(state, structs.replace(auction, evidence=state.evidence[name]))
                calls.append(Call(rule="auction", text=f"{name} has been seen twice: the pursuers bid for it"))
            continue
        auction = structs.replace(auction, bidders=bidders, evidence=state.evidence.get(name, ()))
        why = _lost(state, auction, clock, settings.lost_after)
        if why:
            calls.append(Call(rule="lost", text=f"{name} is lost: {why}; the pursuers bid again"))
            if auction.winner == state.dispatched[name][0]:
                auction = reopened(auction, clock)
            state = _called_back(state, name)
        elif auction.winner is not None and name not in state.dispatched:
            state = _sent(state, auction, auction.winner, now, clock, calls)
        state = opened(state, auction)
    return state


def reset(state: State, intruder: str) -> State:
    """Close the auction of an intruder that is accounted for. Its pursuer drives back to its post."""
    return closed(_called_back(state, intruder), intruder)


def _lost(state: State, auction: Auction, clock: float, patience: float) -> str:
    """Why the pursuer that was dispatched will not capture its intruder; empty if it may."""
    if auction.lot not in state.dispatched:
        return ""
    pursuer, since = state.dispatched[auction.lot]
    if auction.winner != pursuer:
        return f"{pursuer} cannot meet it"
    if pursuer in state.disqualified:
        return f"{pursuer} is disqualified"
    if clock - max(since, state.seen.get(auction.lot, since)) > patience:
        return "no pursuer sees it"
    return ""


def _sent(state: State, auction: Auction, winner: str, now: Observation, clock: float, calls: list[Call]) -> State:
    bids = ", ".join(f"{name} {cost:.1f} s" for name, cost in sorted(auction.bids.items()))
    poses = (now.poses[winner],) if winner in now.poses else ()
    text = f"{winner} is sent to meet {auction.lot} (bids: {bids})"
    calls.append(Call(rule="dispatch", text=text, players=(winner, auction.lot) if poses else (), poses=poses))
    dispatched = {**state.dispatched, auction.lot: (winner, clock)}
    return structs.replace(state.with_state([winner], DISPATCHED), dispatched=dispatched)


def _called_back(state: State, intruder: str) -> State:
    """The state in which the pursuer of an intruder is no longer dispatched."""
    if intruder not in state.dispatched:
        return state
    pursuer, _ = state.dispatched[intruder]
    others = {name: sent for name, sent in state.dispatched.items() if name != intruder}
    return structs.replace(state.with_state([pursuer], RETURNING), dispatched=others)
