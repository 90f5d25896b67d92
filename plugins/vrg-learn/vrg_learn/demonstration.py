"""What strategies do in matches, as pairs of an observation and an action, from which a network can learn it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrg.agents.strategy import Action, Strategy, View, decided
from vrg.bus.messages import Stage
from vrg.config.setup import MatchSetup
from vrg_learn.action import fractions_of, limits_of
from vrg_learn.episode import Episode
from vrg_learn.learning import Learning, learning_of
from vrg_learn.observation import names, observe


class Pairs(NamedTuple):
    """Observations and the actions of strategies for them; a row is one decision of one player.

    Args:
        observations: shape (rows, length). actions: shape (rows, 2 or 3), within -1 to 1.
    """

    observations: npt.NDArray[np.float32]
    actions: npt.NDArray[np.float32]


class Witness(Strategy):
    """Plays by another strategy, and keeps what that sees and does in play while it may move.

    Args:
        strategy: the other one. learning: of the game.

    Attributes:
        observations, actions: what was kept, a row for each decision.
    """

    def __init__(self, strategy: Strategy, learning: Learning) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.seed = strategy.seed
        self._strategy, self._learning, self._limits = strategy, learning, limits_of(strategy.robot)
        self.observations: list[npt.NDArray[np.float32]] = []
        self.actions: list[npt.NDArray[np.float32]] = []

    @property
    def mode(self) -> str:
        """That of the other strategy."""
        return self._strategy.mode

    def act(self, view: View) -> Action:
        """What the other strategy does."""
        action = decided(self._strategy, view)[0]
        if view.me.may_move and view.referee.stage is Stage.PLAY_ROUND and action.twist.is_finite:
            self.observations.append(observe(view, self._learning))
            self.actions.append(fractions_of(action.twist, self._limits))
        return action


def demonstrate(setup: MatchSetup, *, limit: float = 600.0) -> Pairs:
    """Play a match in this process by the strategies of its file, and return what they did.

    Args:
        setup: of a game that can be learned; as `vrg_learn.matches.match_of` makes it.
        limit: the time of play in s after which it is cut off.

    Raises:
        ConfigError: no program can learn the game, or a strategy cannot be made.
        StrategyError: a strategy has failed. LaunchError: no round begins.
    """
    learning = learning_of(setup.game)
    found: list[Witness] = []

    def witnessed(strategy: Strategy) -> Strategy:
        found.append(Witness(strategy, learning))
        return found[-1]

    episode = Episode(setup, (), wrap=witnessed)
    try:
        episode.start()
        while not episode.over and episode.state.total < limit:
            episode.decide({})
    finally:
        episode.close()
    length = len(names(learning, len(setup.players)))
    return Pairs(
        np.array([row for witness in found for row in witness.observations], dtype=np.float32).reshape(-1, length),
        np.array([row for witness in found for row in witness.actions], dtype=np.float32),
    )
