"""One player of a match as an Env of Gymnasium: all others play by their strategies.

`gymnasium.make("vrg_learn.single:vrg/RoboFlag-v0")` imports this module, which registers the games of VRG. It cuts a
match off after the steps of `MAX_TIME`, and with `max_time` sooner; `max_episode_steps` of `make` is another number.
"""

from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
import numpy.typing as npt

from vrg.agents.player import PERIOD
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError
from vrg_learn.environment import MAX_TIME, METADATA, MatchEnvironment
from vrg_learn.matches import match_of
from vrg_learn.observation import Vector

IDS = {
    "vrg/SharksAndMinnows-v0": "sharks-and-minnows",
    "vrg/RoboFlag-v0": "roboflag",
    "vrg/PursuitEvasion-v0": "pursuit-evasion",
}
"""The games by their ids in Gymnasium."""


class PlayerEnvironment(gymnasium.Env[npt.NDArray[Any], npt.NDArray[Any]]):
    """One player of a match. While the player may not drive, `info["able"]` is False; the match goes on until it is
    over.

    Args:
        match: as for `MatchEnvironment`.
        player: the name of the player that learns; None for the first one of the match file.
        options: the others of `MatchEnvironment`, such as `opponents` and `shaping`; `learners` is not among them.

    Attributes:
        player: as given. environment: the match.

    Raises:
        ConfigError: there is no such player, or as `MatchEnvironment`.
    """

    metadata = METADATA

    def __init__(self, match: str | Path | CheckedMatch, player: str | None = None, **options: Any) -> None:
        if "learners" in options:
            raise ConfigError("learners: expected `player`, as one player learns here; several do in MatchEnvironment")
        setup = match_of(match, engine=options.get("engine", "planar"), lasers=options.get("lasers"))
        self.player = setup.players[0].name if player is None else setup.player(player).name
        self.environment = MatchEnvironment(setup, learners=[self.player], **options)
        self.render_mode = self.environment.render_mode
        self.observation_space = self.environment.observation_space(self.player)
        self.action_space = self.environment.action_space(self.player)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Vector, dict[str, Any]]:
        """Begin a match; see `MatchEnvironment.reset`."""
        super().reset(seed=seed)
        observations, infos = self.environment.reset(seed, options)
        return observations[self.player], infos[self.player]

    def step(self, action: npt.ArrayLike) -> tuple[Vector, SupportsFloat, bool, bool, dict[str, Any]]:
        """Let all players decide, and go on to their next decision; see `MatchEnvironment.step`."""
        observations, rewards, terminations, truncations, infos = self.environment.step({self.player: action})
        name = self.player
        return observations[name], rewards[name], terminations[name], truncations[name], infos[name]

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture of the match; see `MatchEnvironment.render`."""
        return self.environment.render()

    def close(self) -> None:
        """End the match. Idempotent."""
        self.environment.close()


for _id, _game in IDS.items():
    gymnasium.register(
        _id, entry_point="vrg_learn.single:PlayerEnvironment", kwargs={"match": _game},
        max_episode_steps=round(MAX_TIME / PERIOD),
    )  # fmt: skip
