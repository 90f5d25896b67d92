"""The whole state of a match as one vector, for programs that learn with what no player sees."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vrg.bus.messages import DISQUALIFIED, TIME_LIMIT, Body, RefereeState
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.games import GAMES
from vrg.regions import surrounding
from vrg.types import STILL, Pose
from vrg_learn.learning import Learning, left
from vrg_learn.observation import Vector


class StateLayout:
    """Lays out the whole state of a match: all players in the order of the match file, then the things and the clock.

    Of each player there are its true place from the middle of the field (as a fraction of the diagonal), the cosine and
    the sine of its heading, its velocity ahead, to the left and of turning (as fractions of its robot's top speeds),
    and which role and which state it has. For each thing of the game, such as a flag, there is its carrier. Last come
    the time that is left, the round, and the points of each team in relation to all points.

    Args:
        setup: the match. learning: of its game.

    Attributes:
        names: the name of each value, in order.
    """

    def __init__(self, setup: MatchSetup, learning: Learning) -> None:
        book = rulebook_of(setup)
        game, first = GAMES.get(setup.game), book.initial()
        zones = [zone.region.bounds for zone in book.zones(first)]
        x_min, y_min, x_max, y_max = surrounding(zones) if zones else (-0.5, -0.5, 0.5, 0.5)
        self._middle = (x_min + x_max) / 2, (y_min + y_max) / 2
        self._reach = math.hypot(x_max - x_min, y_max - y_min)
        self._robots = {player.name: player.robot for player in setup.players}
        self._roles = [role.name for role in game.roles]
        self._states = [*learning.states, DISQUALIFIED]
        self._teams = list(dict.fromkeys(role.team for role in game.roles))
        things = [thing.name for thing in first.objects]
        parts = ["x", "y", "cos heading", "sin heading", "v", "side", "w", *self._roles, *self._states]
        self.names = [f"{player}: {part}" for player in self._robots for part in parts]
        self.names += [f"{thing}: carried by {player}" for thing in things for player in self._robots]
        self.names += ["time left", "round", *(f"points of {team}" for team in self._teams)]

    def vector(self, state: RefereeState, bodies: Mapping[str, Body]) -> Vector:
        """Return the state, shape (len(names),), all within [-1, 1].

        Args:
            state: the referee's. bodies: where the robots really are, by name.
        """
        values = list(self._values(state, bodies))
        return np.clip(np.array(values, dtype=np.float32), -1.0, 1.0)

    def _values(self, state: RefereeState, bodies: Mapping[str, Body]) -> Iterator[float]:
        players = {player.name: player for player in state.players}
        for name, robot in self._robots.items():
            body, player = bodies.get(name), players[name]
            pose, twist = (Pose(*self._middle, 0.0), STILL) if body is None else (body.pose, body.twist)
            yield (pose.x - self._middle[0]) / self._reach
            yield (pose.y - self._middle[1]) / self._reach
            yield from (math.cos(pose.theta), math.sin(pose.theta))
            yield from (twist.v / robot.v_max, twist.side / robot.v_max, twist.w / robot.w_max)
            yield from _one_of(self._roles, player.role)
            yield from _one_of(self._states, player.state)
        for thing in state.objects:
            yield from _one_of(self._robots, thing.carrier)
        yield left(state.clock, state.numbers.get(TIME_LIMIT))
        yield state.round / max(1, state.rounds)
        points = sum(map(abs, state.score.values()))
        yield from (state.score.get(team, 0) / max(1, points) for team in self._teams)


def _one_of(words: Sequence[str] | Mapping[str, object], word: str | None) -> list[float]:
    return [float(each == word) for each in words]
