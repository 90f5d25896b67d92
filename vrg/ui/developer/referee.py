"""The coordinator in the developers' view: what it waits for, auctions, leases and calls."""

import math

from vrg.bus.messages import Auction, PlayerStatus
from vrg.games import game_of
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight
from vrg.ui.developer.tables import Item, Tone
from vrg.ui.scene import clock_text


def referee(insight: Insight) -> list[Item]:
    """The coordinator: what it waits for, auctions with bids, leases, and calls with their rules."""
    state = insight.state
    if state is None:
        return [Item(words.WAITING, Tone.QUIET)]
    found = []
    if state.halted is not None:
        found += [Item(words.HALTED, heading=True), Item(state.halted, Tone.CAUTION)]
        found += [Item(words.WAY_OUT.format(state.way_out))] if state.way_out else []
    found.append(Item(words.CONDITIONS, heading=True))
    found += [Item(reason, Tone.CAUTION) for reason in state.waiting] or [Item(words.NOTHING_WAITS, Tone.QUIET)]
    found.append(Item(words.AUCTIONS, heading=True))
    found += [item for auction in state.auctions for item in _auction(auction)] or [Item(words.NO_AUCTION, Tone.QUIET)]
    found.append(Item(words.LEASES, heading=True))
    found += [item for p in state.players for item in _lease(insight, p)] or [Item(words.NO_LEASE, Tone.QUIET)]
    found.append(Item(words.CALLS, heading=True))
    game = game_of(state.game)
    for number, call in enumerate(reversed(insight.scene.calls)):
        tone = Tone.PLAIN if number == 0 else Tone.QUIET
        found.append(Item(f"[{call.rule}] {call.text}", tone, label=clock_text(call.clock), call=call))
        rule = game.rule_text(call.rule)
        if rule is not None and number == 0:
            source = f" ({rule.source})" if rule.source else ""
            found.append(Item(f"Rule{source}: {rule.words}", Tone.GOOD, label=" ", call=call))
    if not insight.scene.calls:
        found.append(Item(words.NO_CALL, Tone.QUIET))
    return found


def _auction(auction: Auction) -> list[Item]:
    opened = clock_text(auction.opened)
    if auction.winner is None:
        head = Item(
            words.AUCTION_OPEN.format(lot=auction.lot, opened=opened, lasts=auction.lasts),
            Tone.CAUTION,
        )
    else:
        head = Item(words.AUCTION_WON.format(lot=auction.lot, winner=auction.winner, opened=opened), Tone.GOOD)
    bids = [words.BID.format(player=p, cost=cost) for p, cost in sorted(auction.bids.items(), key=_by_cost)]
    bids += [words.NO_BID.format(player=p) for p in auction.bidders if p not in auction.bids]
    return [head, Item(", ".join(bids), Tone.QUIET, label=" ")] if bids else [head]


def _by_cost(bid: tuple[str, float]) -> tuple[float, str]:
    return bid[1], bid[0]


def _lease(insight: Insight, player: PlayerStatus) -> list[Item]:
    if player.lease is not None:
        text = words.LEASE_OF_REFEREE.format(player=player.name, v=player.lease.v, w=math.degrees(player.lease.w))
        return [Item(text, Tone.CAUTION)]
    report, manual = insight.reports.get(player.name), insight.manuals.get(player.name)
    if report is None or not report.body.manual:
        return []
    if manual is None:
        return [Item(words.LEASE_OF_PERSON.format(player=player.name), Tone.CAUTION)]
    rest = max(0.0, manual.stamp + manual.body.lease - insight.now)
    return [Item(words.LEASE_UNTIL.format(player=player.name, rest=rest), Tone.CAUTION)]
