"""The referee's reasons: what it waits for, auctions, leases and calls."""

import math

from vrg.bus.messages import Auction, PlayerStatus
from vrg.games import game_of
from vrg.ui.scene import clock_text
from vrg_views.developer import words
from vrg_views.developer.insight import Insight
from vrg_views.developer.tables import Grid, GridRow, Tone, heading, item


def referee(insight: Insight) -> Grid:
    """What the referee waits for, auctions with bids, leases, and calls with their rules."""
    state = insight.state
    if state is None:
        return Grid([item(words.WAITING, Tone.QUIET)])
    found = []
    if state.halted is not None:
        found += [heading(words.HALTED), item(state.halted, Tone.CAUTION)]
        found += [item(words.WAY_OUT.format(state.way_out))] if state.way_out else []
    found.append(heading(words.CONDITIONS))
    found += [item(reason, Tone.CAUTION) for reason in state.waiting] or [item(words.NOTHING_WAITS, Tone.QUIET)]
    found.append(heading(words.AUCTIONS))
    found += [row for auction in state.auctions for row in _auction(auction)] or [item(words.NO_AUCTION, Tone.QUIET)]
    found.append(heading(words.LEASES))
    found += [row for p in state.players for row in _lease(insight, p)] or [item(words.NO_LEASE, Tone.QUIET)]
    found.append(heading(words.CALLS))
    game = game_of(state.game)
    for number, call in enumerate(reversed(insight.scene.calls)):
        tone = Tone.PLAIN if number == 0 else Tone.QUIET
        found.append(item(f"[{call.rule}] {call.text}", tone, label=clock_text(call.clock)))
        rule = game.rule_text(call.rule)
        if rule is not None and number == 0:
            source = f" ({rule.source})" if rule.source else ""
            found.append(item(f"Rule{source}: {rule.words}", Tone.GOOD))
    if not insight.scene.calls:
        found.append(item(words.NO_CALL, Tone.QUIET))
    return Grid(found)


def _auction(auction: Auction) -> list[GridRow]:
    opened = clock_text(auction.opened)
    if auction.winner is None:
        head = item(
            words.AUCTION_OPEN.format(lot=auction.lot, opened=opened, lasts=auction.lasts),
            Tone.CAUTION,
        )
    else:
        head = item(words.AUCTION_WON.format(lot=auction.lot, winner=auction.winner, opened=opened), Tone.GOOD)
    bids = [words.BID.format(player=p, cost=cost) for p, cost in sorted(auction.bids.items(), key=_by_cost)]
    bids += [words.NO_BID.format(player=p) for p in auction.bidders if p not in auction.bids]
    return [head, item(", ".join(bids), Tone.QUIET)] if bids else [head]


def _by_cost(bid: tuple[str, float]) -> tuple[float, str]:
    return bid[1], bid[0]


def _lease(insight: Insight, player: PlayerStatus) -> list[GridRow]:
    if player.lease is not None:
        text = words.LEASE_OF_REFEREE.format(player=player.name, v=player.lease.v, w=math.degrees(player.lease.w))
        return [item(text, Tone.CAUTION)]
    report, manual = insight.reports.get(player.name), insight.manuals.get(player.name)
    if report is None or not report.body.manual:
        return []
    if manual is None:
        return [item(words.LEASE_OF_PERSON.format(player=player.name), Tone.CAUTION)]
    rest = max(0.0, manual.stamp + manual.body.lease - insight.now)
    return [item(words.LEASE_UNTIL.format(player=player.name, rest=rest), Tone.CAUTION)]
