"""Pursuit-evasion as processes: a bad radio, and a referee that dies in the middle of an auction."""

import json
import signal
from pathlib import Path

import pytest

from tests.system.harness import Match
from vrg.bus.messages import Auction
from vrg.config.loading import match_path
from vrg.coordinator.journal import read_journal

pytestmark = [pytest.mark.system, pytest.mark.thorough]

RULES = """
[radio]
loss = 0.3
delay = 0.2
jitter = 0.1

[rules]
auction = 20.0
intruder_speed = 0.15
time = 200.0
launch_window = 1.0
"""
"""Slow intruders, and auctions that are open for long."""


def test_an_auction_survives_the_death_of_the_referee(tmp_path: Path) -> None:
    text = match_path("pursuit-evasion-table-4-1").read_text().replace("[rules]", RULES)
    text = text.replace('engine = "pybullet"', 'engine = "planar"\nrate = 1.5')
    with Match(tmp_path, text, movers=("intruder1",)) as match:
        observer = match.observer
        found: list[Auction] = []

        def bidden() -> bool:
            found[:] = [auction for auction in observer.state.auctions if auction.bids]
            return bool(found)

        observer.wait_until(bidden, "a bid in an auction")
        auction, sender = found[0], observer.heard.states[-1].sender
        assert auction.winner is None
        old = match.child("coordinator")
        old.send_signal(signal.SIGKILL)
        match.wait_replaced("coordinator", old)
        observer.wait_until(
            lambda: observer.heard.states[-1].sender != sender and observer.state.halted, "the referee to be back"
        )
        again = observer.state.auction(auction.lot)
        assert again is not None, "the auction is still open"
        assert (again.opened, again.bidders, again.winner) == (auction.opened, auction.bidders, None)
        match.resume()
        observer.wait_until(
            lambda: any(call.rule == "dispatch" for call in observer.heard.calls), "somebody to win", 120.0
        )
        assert match.play_out() == 0
        result = json.loads(match.run.result.read_text())
        assert result["score"]["pursuers"] + result["score"]["intruders"] == 2
        assert result["radio"]["lost"] > 0
        links = [link for p in result["processes"].values() for link in p.get("radio", {}).values()]
        link = max(links, key=lambda link: link["arrived"])
        assert 0.2 <= link["delay"] <= 0.3
        assert 0.15 < link["lost"] / (link["lost"] + link["arrived"] + link["under_way"]) < 0.45
        calls = [call for record in read_journal(match.run.journal)[1] for call in record.calls]
        assert [call.number for call in calls] == list(range(1, len(calls) + 1))
        opened = [call.text for call in calls if call.rule == "auction"]
        assert len(opened) == len(set(opened)), "no auction was opened twice"
