"""An agent that has never seen VRG writes a player that beats the built-in one, within ten calls."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from mcp_client import agent

from vrg.launch.sandbox.seal import missing

pytestmark = [pytest.mark.system, pytest.mark.skipif(missing() is not None, reason="this machine cannot seal")]

MINE = '''\
import math

from vrg.agents import STILL, Twist, View
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Mine(SharksAndMinnowsPlayer):
    """The built-in player, but as a minnow it is pushed away by sharks ahead, team mates and the sides."""

    def act(self, view: View):
        safe, field = view.zone("safe"), view.zone("field")
        if view.me.role != "minnow" or not view.me.may_move or view.me.mark is not None or safe is None:
            return super().act(view)
        x, y = view.position
        if safe.shrunk(0.8).contains(x, y):
            return STILL
        left, _, right, _ = field.bounds
        ahead = 1.0 if safe.middle[1] > y else -1.0
        way_x, way_y = 0.6 / max(0.1, x - left) - 0.6 / max(0.1, right - x), ahead
        for other in view.others():
            dx, dy = x - other.pose.x, y - other.pose.y
            distance = max(0.3, math.hypot(dx, dy))
            if other.role == "shark" and other.state == "active":
                if dy * ahead < 0.5:  # it is not yet behind
                    push = 6.0 / distance**3
                    way_x, way_y = way_x + push * (dx + math.copysign(0.4, dx)), way_y + push * dy
            elif distance < 1.5:
                way_x, way_y = way_x + 0.5 * dx / distance**2, way_y + 0.5 * dy / distance**2
        turn = math.remainder(math.atan2(way_y, way_x) - view.pose.theta, 2 * math.pi)
        return Twist(self.robot.v_max if abs(turn) < 1.0 else 0.1, 2.5 * turn)
'''


@pytest.mark.thorough
def test_an_agent_beats_the_built_in_player_within_ten_calls(tmp_path: Path) -> None:
    async def session() -> dict[str, Any]:
        async with agent(tmp_path) as me:
            games = await me.ask("list_games")
            assert "small" in str(games)
            [of] = [game for game in games["games"] if "small" in game["matches"]]
            rules = await me.ask("read_rules", match="small")
            assert rules["values_in_this_match"]["zone_depth"] == 2.0
            assert rules["to_build_upon"]["minnow"].endswith(":SharksAndMinnowsPlayer")
            view = await me.ask("read_api", topic="view")
            assert "counter-clockwise" in view["text"]
            assert "may_move" in view["text"]
            await me.ask("write_player", file="mine.py", code=MINE)
            checked = await me.ask("check_player", file="mine.py", match="small")
            assert not checked["wrong"]
            assert min(checked["drove_m"].values()) > 1.0
            played = await me.ask("play_match", match="small", strategies={"minnows": "mine.py"})
            assert played["winner"] == "minnows"
            played = await me.ask("play_match", match="small", strategies={"sharks": "mine.py"})
            call = next(call["call"] for call in played["calls"] if call["rule"] == "tag")
            why = await me.ask("why", run=played["run"], call=call)
            assert "distance between the outlines" in why["answer"]
            assert why["pictures"] == 1
            found: dict[str, Any] = {}
            [built_in] = of["built_in_strategies"]
            while me.calls < 10 and found.get("result") in (None, "undecided"):
                found = await me.ask("compare", first="mine.py", second=built_in, match="small", games=60)
            return {**found, "calls_until_then": me.calls}

    found = asyncio.run(session())
    print(found)
    assert found["result"] == "better"
    assert found["interval"][0] > 0.5
    assert found["calls_until_then"] <= 10
