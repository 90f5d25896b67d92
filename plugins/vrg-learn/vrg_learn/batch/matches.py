"""Many matches of one match file at once, in arrays, on all cores."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.hal.sim.map import load_map
from vrg.launch.fork_server import cores
from vrg_learn.batch import chance, motion, observing, roboflag, sharks_and_minnows, stepping
from vrg_learn.batch.game import BatchedGame
from vrg_learn.batch.refereed import Refereed
from vrg_learn.batch.stepping import Matches, Outputs, Variation
from vrg_learn.compiled import compiled, direct
from vrg_learn.learning import learning_of

GAMES: Final[dict[str, Callable[..., BatchedGame]]] = {
    "roboflag": roboflag.batched,
    "sharks-and-minnows": sharks_and_minnows.batched,
}
"""What makes the arrays and functions of each game whose rules are compiled. Referees judge all others."""


class Batch:
    """This many matches at once. Matches that end start again in the same step (Gymnasium's SAME_STEP).

    Any game can be played whose players need no scan and tell the referee nothing. Those of GAMES are some two hundred
    times as fast as others, of which only motion is compiled, and which work in one thread.

    Args:
        setup: the match; its robots are virtual. matches: how many. seed: of all that is drawn.
        vary: how matches differ from the match file.
        shaping: whether calls that only lead to what counts are rewarded, too.
        most: the decisions after which a match is truncated; 0 for no bound.
        threads: how many work at a time; None takes one for each core.

    Attributes:
        players: the names of the players, in the order of the arrays. roles: the role of each at the start.
        rules, teams: the names of the rules of calls, and of the teams that win, by their numbers.
        sides: the number of each player's team at the start, shape (players,).
        strategies: the names of the shipped strategies by which a team can play; see `play_by`.
        length: the number of values of an observation. records: those of all matches.
        referees: those of a game that is not among GAMES, with the `calls` of the last step; None for the others.
        out: what the last step has returned, or the reset: arrays that the next step overwrites.

    Raises:
        ConfigError: the game or the robots cannot be played in a batch, or no round begins.
    """

    def __init__(
        self,
        setup: MatchSetup,
        matches: int,
        *,
        seed: int = 0,
        vary: Variation = Variation(),  # noqa: B008 - it cannot change
        shaping: bool = False,
        most: int = 0,
        threads: int | None = None,
    ) -> None:
        if setup.physical:
            raise ConfigError(f"{setup.origin}: {', '.join(setup.physical)}: only virtual robots can play in a batch")
        if setup.bodies:
            raise ConfigError(f"{setup.origin}: expected a match without [[bodies]]: a batch moves robots alone")
        if setup.sight is not None:
            raise ConfigError(f"{setup.origin}: expected a match without `sight`: in a batch players see everybody")
        self.players = [player.name for player in setup.players]
        self.roles = [player.role for player in setup.players]
        self.matches, self.vary, self.most = matches, vary, most
        models = [player.robot for player in setup.players]
        try:
            model, robots = motion.robots(models, matches), motion.robots(models, matches)
        except ValueError as error:
            raise ConfigError(f"{setup.origin}: {error}") from None
        self.referees: Refereed | None = None
        if setup.game in GAMES:
            game = GAMES[setup.game](rulebook_of(setup), matches, shaping=shaping)
        else:
            learning = learning_of(setup.game, setup.origin)
            self.referees = Refereed(setup, learning, matches, shaping=shaping)
            game = self.referees.game
        players = len(self.players)
        self.sides: npt.NDArray[np.int64] = game.setting.sides
        self.rules, self.teams, self.length, self.strategies = game.rules, game.teams, game.length, game.strategies
        self.records = Matches(
            setting=game.setting.reshape(1).view(np.recarray),
            standing=game.standing,
            calls=game.calls,
            motions=motion.motions(matches, players, robots.rates.shape[2]),
            robots=robots,
            model=model,
            minds=stepping.minds(matches, players, vary.delay),
            plans=stepping.plans(matches, players, len(game.teams)),
            chance=chance.streams(matches),
            sights=observing.sights(matches, players, game.places),
        )
        chance.seed(self.records.chance, seed)
        self.walls = motion.walls_of(load_map(setup.map))
        self.out = Outputs(
            observations=np.zeros((matches, players, self.length), dtype=np.float32),
            last=np.zeros((matches, players, self.length), dtype=np.float32),
            able=np.zeros((matches, players), dtype=np.bool_),
            rewards=np.zeros((matches, players), dtype=np.float32),
            terminated=np.zeros(matches, dtype=np.bool_),
            truncated=np.zeros(matches, dtype=np.bool_),
            winners=np.full(matches, -1, dtype=np.int64),
        )
        if self.referees is not None:
            self._step, self._begin, threads = self.referees.step_all, self.referees.begin_all, 1
        elif game.functions is not None:
            functions = game.functions._asdict()
            self._step = direct(compiled(stepping.step_all, **functions))
            self._begin = compiled(stepping.begin_all, **functions)
        edges = np.linspace(0, matches, min(threads or cores(), matches) + 1).astype(int).tolist()
        self._parts = list(pairwise(edges))
        self._closed = self._begun = False
        self._pool = ThreadPoolExecutor(len(self._parts)) if len(self._parts) > 1 else None

    def play_by(self, matches: slice, team: str, strategy: str | None, *, advice: bool = False) -> None:
        """Let a team of some matches play by a shipped strategy in place of actions from now on.

        It decides as a sparring partner does: see vrg_learn.batch.roboflag_players. This holds until it is called
        again, also after `reset`, before which it should be called: a change within a match goes on with an old plan.

        Args:
            strategy: one of `strategies`; None lets it play by actions again.
            advice: True lets it play by actions, and the strategy only advise: see `advice`.

        Raises:
            ValueError: there is no such team or strategy.
        """
        if team not in self.teams[:2] or strategy not in (None, *self.strategies):
            known = f"one of {', '.join(self.teams[:2])} by one of {', '.join(self.strategies) or 'no strategies'}"
            raise ValueError(f"play_by: expected {known}, got {team} by {strategy}")
        self._begun = self._begun and self.referees is None  # which make the players of a match when it begins
        number = -1 if strategy is None else self.strategies.index(strategy)
        self.records.plans.strategy[matches, self.teams.index(team)] = number
        self.records.plans.driving[matches, self.teams.index(team)] = strategy is not None and not advice

    @property
    def advice(self) -> npt.NDArray[np.float32]:
        """The actions that the strategies of `play_by` wanted in the last step, shape (matches, players, 2).

        They have seen what the players saw before it. Those of teams without a strategy mean nothing. The next step
        overwrites them.
        """
        found: npt.NDArray[np.float32] = self.records.plans.advice
        return found

    def reset(self, seed: int | None = None) -> npt.NDArray[np.float32]:
        """Begin all matches again, and return the observations: shape (matches, players, length)."""
        if seed is not None:
            chance.seed(self.records.chance, seed)
        self._begun = True
        self._begin(0, self.matches, self.records, self.walls, self.vary, self.out)
        return self.out.observations

    def step(self, actions: npt.NDArray[np.float32]) -> Outputs:
        """Play one decision of all matches.

        Args:
            actions: shape (matches, players, 2): shares of each model's top speed and turn rate, -1 to 1.

        Raises:
            ValueError: they have another shape, or one is not finite, or not real.
            ConfigError: the batch was closed, or its matches have not begun.
        """
        if self._closed:
            raise ConfigError("step: expected a batch that is open, but it was closed: make another one")
        if not self._begun:
            raise ConfigError("step: expected matches that have begun: call reset first, and again after play_by")
        expected = (self.matches, len(self.players), 2)
        if (
            actions.shape != expected
            or np.iscomplexobj(actions)
            or np.count_nonzero(np.isfinite(actions)) < actions.size
        ):
            got = f"shape {actions.shape}" if actions.shape != expected else "some that are not finite, or not real"
            raise ValueError(f"actions: expected finite numbers of shape {expected}, got {got}")
        wanted = np.ascontiguousarray(actions, dtype=np.float32)
        if self._pool is None:
            self._part(0, self.matches, wanted)
        else:
            for done in [self._pool.submit(self._part, low, high, wanted) for low, high in self._parts]:
                done.result()
        return self.out

    def _part(self, low: int, high: int, actions: npt.NDArray[np.float32]) -> None:
        self._step(low, high, self.records, self.walls, self.vary, actions, self.most, self.out)

    def close(self) -> None:
        """End the threads. Idempotent; the batch can then be played no more."""
        self._closed = True
        if self._pool is not None:
            self._pool.shutdown()
