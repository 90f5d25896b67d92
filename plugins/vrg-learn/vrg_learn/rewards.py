"""Rewards: the referee's calls, winning, and progress. Pure functions."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from vrg.agents.strategy import View
from vrg.bus.messages import Call
from vrg.coordinator.rulebook import DRAW, NOBODY
from vrg_learn.learning import Learning, Reward

WINNING = 1.0
"""The reward of each player of the team that wins; each of the others is given as much less than nothing."""


def for_calls(calls: Iterable[Call], table: Mapping[str, Reward], teams: Mapping[str, str]) -> dict[str, float]:
    """The reward of each player for some calls.

    Args:
        table: the rewards by rule; a call of another rule changes nothing. teams: the team of each player.
    """
    found = dict.fromkeys(teams, 0.0)
    for call in calls:
        reward = table.get(call.rule)
        if reward is None or not call.players:
            continue
        first, *others = call.players
        found[first] += reward.first
        for name in others:
            found[name] += reward.others
        for name, team in teams.items():
            found[name] += reward.team if team == teams[first] else reward.rest
    return found


def for_winning(winner: str | None, teams: Mapping[str, str]) -> dict[str, float]:
    """The reward of each player for the end of the game; nobody is given one for a draw, or while it goes on.

    Args:
        winner: as in `RefereeState`. teams: the team of each player.
    """
    if winner in (None, DRAW, NOBODY):
        return dict.fromkeys(teams, 0.0)
    return {name: WINNING if team == winner else -WINNING for name, team in teams.items()}


@dataclass(frozen=True)
class Standpoint:
    """How far a player is from its goal at one instant.

    Args:
        phase: what the player is and when: its role, its state and the round.
        potential: minus the distance to its goal, as a fraction of the field's diagonal; None if it has no goal.
    """

    phase: tuple[str, str, int]
    potential: float | None


def standpoint(view: View, learning: Learning) -> Standpoint:
    """The standpoint of a player by what it sees."""
    look = learning.look(view)
    x_min, y_min, x_max, y_max = look.bounds
    phase = view.me.role, view.me.state, view.referee.round
    if look.goal is None:
        return Standpoint(phase, None)
    return Standpoint(phase, -math.dist(view.position, look.goal) / math.hypot(x_max - x_min, y_max - y_min))


def for_progress(before: Standpoint, now: Standpoint, gamma: float) -> float:
    """The reward for progress between two decisions: the discounted difference of the potentials (Ng, 1999).

    It is 0 where the player has become another one, or has had no goal.

    Args:
        gamma: the discount of the program that learns.
    """
    if before.phase != now.phase or before.potential is None or now.potential is None:
        return 0.0
    return gamma * now.potential - before.potential
