"""The players of a batch decide as the shipped strategies do, from the same knowledge."""

from typing import Any

import numpy as np
import pytest

from vrg.agents.strategy import Action, Strategy, View, decided
from vrg.bus.messages import RefereeState, Stage
from vrg.config.setup import MatchSetup
from vrg.games.roboflag import TAGGED, TEAMS, flag_of
from vrg.games.sharks_and_minnows import SHARK
from vrg.types import Twist
from vrg_learn.action import fractions_of, limits_of
from vrg_learn.batch import roboflag_players, sharks_and_minnows_players, stepping
from vrg_learn.batch.matches import Batch
from vrg_learn.episode import Episode
from vrg_learn.matches import match_of

PLAY = 12.0
"""The time of play in s for which decisions are compared."""
THOROUGH = ("aggressive", "conservative", "aggressive-two-groups")
"""Their plans and decisions are functions that `balanced` calls, too."""


class Twin(Strategy):
    """Plays by a strategy, and lets that of a batch decide from the same knowledge."""

    def __init__(self, strategy: Strategy, setup: MatchSetup, number: int, players: Any) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.seed, self.strategy, self.players = strategy.seed, strategy, players
        batch = Batch(setup, 1, threads=1)
        self.names, self.records = batch.players, batch.records
        self.plans = stepping.plans(1, len(batch.players))[0]
        role = batch.roles[batch.players.index(self.name)]
        own = TEAMS.index(role) if role in TEAMS else 0
        self.plans.strategy[own] = number
        self.off: list[float] = []

    def act(self, view: View) -> Action:
        """What the strategy does."""
        action = decided(self.strategy, view)[0]
        if view.referee.stage is not Stage.PLAY_ROUND:
            self.players.forget(self.plans)
        else:
            row, a = self.names.index(self.name), self.records
            self.know(view, row)
            s, t, r, k = a.setting[0], a.standing[0], a.model[0], a.minds[0]
            self.players.plan(s, t, r, k, self.plans, view.time)
            if view.me.may_move and view.me.state != TAGGED:  # one that is tagged is led home
                v, w = self.players.decide(s, t, r, k, self.plans, row, view.time)
                limits = limits_of(self.robot)
                self.off.append(
                    float(np.abs(fractions_of(Twist(v, w), limits) - fractions_of(action.twist, limits)).max())
                )
        return action

    def know(self, view: View, row: int) -> None:
        """Put what the player knows into the records of the batch."""
        mind, state = self.records.minds[0], view.referee
        for n, name in enumerate(self.names):
            player = next(player for player in state.players if player.name == name)
            assert player.pose is not None
            mind.poses[n] = player.pose.x, player.pose.y, player.pose.theta
            mind.velocities[n] = view.velocities.get(name, (0.0, 0.0))
        mind.poses[row] = mind.own[row, :3] = view.pose.x, view.pose.y, view.pose.theta
        (self.know_flags if self.players is roboflag_players else self.know_roles)(state)

    def know_flags(self, state: RefereeState) -> None:
        """Put the state of RoboFlag into the records."""
        standing = self.records.standing[0]
        standing.clock = state.clock
        standing.states[:] = [("normal", "tagged", "flagged").index(player.state) for player in state.players]
        for team, name in enumerate(TEAMS):
            flag = state.object(flag_of(name))
            assert flag is not None
            standing.carriers[team] = -1 if flag.carrier is None else self.names.index(flag.carrier)
            auction = state.auction(f"{name} attack")
            if auction is not None and auction.winner is not None:
                self.plans.winner[team], self.plans.opened[team] = self.names.index(auction.winner), auction.opened

    def know_roles(self, state: RefereeState) -> None:
        """Put the state of Sharks and Minnows into the records."""
        standing = self.records.standing[0]
        standing.roles[:] = [player.role == SHARK for player in state.players]
        standing.active[:] = [player.state == "active" for player in state.players]
        safe = next(zone.region for zone in state.zones if zone.kind == "safe")
        standing.goal = int(safe.middle[0] + safe.middle[1] > 0.0)
        standing.limits[:] = self.robot.v_max


@pytest.mark.parametrize(
    ("game", "players", "strategy"),
    [
        pytest.param("roboflag", roboflag_players, name, marks=[pytest.mark.thorough] if name in THOROUGH else [])
        for name in roboflag_players.STRATEGIES
    ]
    + [("sharks-and-minnows", sharks_and_minnows_players, "sharks-and-minnows")],
)
def test_they_decide_as_the_strategies_do(game: str, players: Any, strategy: str) -> None:
    setup = match_of(game, engine="planar", lasers=False)
    number = players.STRATEGIES.index(strategy)
    for player in setup.players:
        setup = setup.substituted(player.name, strategy)
    twins: list[Twin] = []

    def twin(own: Strategy) -> Strategy:
        twins.append(Twin(own, setup, number, players))
        return twins[-1]

    episode = Episode(setup, (), wrap=twin)
    try:
        episode.start()
        while not episode.over and episode.state.total < PLAY:
            episode.decide({})
    finally:
        episode.close()
    off = np.array([value for twin in twins for value in twin.off])
    assert len(off) > 500
    # Bids take time in a match, ways lead around standing bodies, and a shark first finds out how fast it is.
    assert (off < 0.1).mean() > 0.9
