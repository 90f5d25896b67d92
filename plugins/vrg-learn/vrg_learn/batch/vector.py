"""A batch as a vector environment of Gymnasium, in which each player of each match is one environment."""

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from vrg.errors import ConfigError
from vrg_learn.batch.matches import Batch


class VectorMatches(VectorEnv[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.bool_]]):
    """All players of a batch as rows: those of the first match, then those of the second.

    This is the form that PufferLib and programs like those of CleanRL take, too. Matches that end start again in the
    same step; `infos["final_obs"]` then has the last observations of their players. `infos["able"]` tells of which rows
    the next action counts; see `Outputs`. All arrays are overwritten by the next step.

    Args:
        batch: the matches. Its `close` is called by that of this environment.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(self, batch: Batch) -> None:
        self.batch = batch
        self.num_envs = batch.matches * len(batch.players)
        self.single_observation_space = Box(-1.0, 1.0, (batch.length,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begin all matches again.

        Args:
            seed: of all that is drawn. options: `reset_mask` is refused, as players of one match begin together.

        Raises:
            ConfigError: the seed is a list, or some players only are to start again.
        """
        if isinstance(seed, list) or (options and "reset_mask" in options):
            raise ConfigError("reset: expected one seed, and no reset_mask: the players of a match begin it together")
        return self._rows(self.batch.reset(seed)), self._infos()

    def step(
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[Any], npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, Any]]:
        """Play one decision of all matches.

        Args:
            actions: shape (rows, 2).

        Raises:
            ValueError: they have another shape, or one is not finite, or not real.
            ConfigError: the environment was closed.
        """
        players = len(self.batch.players)
        shaped = np.asarray(actions)
        if shaped.shape != (self.num_envs, 2):
            raise ValueError(f"actions: expected shape ({self.num_envs}, 2), got {shaped.shape}")
        out = self.batch.step(shaped.reshape(self.batch.matches, players, 2))
        terminated, truncated = np.repeat(out.terminated, players), np.repeat(out.truncated, players)
        ended = terminated | truncated
        infos = self._infos()
        if ended.any():
            infos |= {"final_obs": self._rows(out.last), "_final_obs": ended}
        return self._rows(out.observations), out.rewards.reshape(-1), terminated, truncated, infos

    def _infos(self) -> dict[str, Any]:
        return {"able": self.batch.out.able.reshape(-1), "_able": np.ones(self.num_envs, dtype=np.bool_)}

    def _rows(self, values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        return values.reshape(self.num_envs, -1)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads of the batch."""
        self.batch.close()
