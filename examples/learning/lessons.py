"""Lessons by a shipped strategy: the policy drives, and is corrected by what its teacher would have done.

This is DAgger (Ross et al. 2011): the policy learns what to do in the situations into which it brings itself.
"""

import math
from collections.abc import Sequence

import numpy as np
from ppo import Learner
from regression import SPREAD, fit_step

from vrg_learn.batch.matches import Batch

CORRECTIONS, STEPS, BATCH = 400_000, 12, 2048  # the corrections kept, the steps of a lesson, the rows of a minibatch
FASTEST, STRAYING = 2e-3, 0.2  # the rate of learning at first, and how far the policy strays from what it would do


class Lessons:
    """Lessons in all matches of a batch.

    The teacher advises half of the teams, and drives a quarter of them; others drive the rest.

    Args:
        batch: which is begun anew. learner: its policy learns. teacher: the name of a strategy of the batch.
        others: the names of those that play besides. hold: the decisions for which a motion is kept.

    Attributes:
        decisions: how many all players make in one lesson.
    """

    def __init__(self, batch: Batch, learner: Learner, teacher: str, others: Sequence[str], hold: int) -> None:
        self._batch, self._learner, self._hold = batch, learner, hold
        self._kept = np.zeros((CORRECTIONS, batch.length + 2), dtype=np.float32)
        self._given, self.decisions = 0, hold * STEPS * batch.matches * len(batch.sides)
        self._advised = np.zeros((batch.matches, len(batch.sides)), dtype=bool)
        others = (*others, teacher)
        for match in range(batch.matches):
            for team, name in enumerate(batch.teams[:2]):
                turn = (match + team) % 4
                strategy = teacher if turn < 3 else others[match // 4 % len(others)]
                batch.play_by(slice(match, match + 1), name, strategy, advice=turn < 2)
                self._advised[match, batch.sides == team] = turn < 3
        learner.log_std[:] = math.log(SPREAD)
        batch.reset()

    def lesson(self, left: float) -> float:
        """Play a little, be corrected, and return by how much, as the root of the mean square.

        Args:
            left: the share of the lessons that is still to come: the later, the smaller the corrections.
        """
        self._play()
        rate, off = FASTEST * (0.05 + 0.95 * left), 0.0
        for _ in range(STEPS):
            rows = self._kept[self._learner.rng.integers(min(self._given, CORRECTIONS), size=BATCH)]
            off += fit_step(self._learner.policy, self._learner.actor, rows[:, :-2], rows[:, -2:], rate) / STEPS
        return math.sqrt(off)

    def _play(self) -> None:
        learner, out = self._learner, self._batch.out
        for _ in range(STEPS):
            means = np.tanh(learner.outputs(learner.policy, out.observations))
            means += STRAYING * learner.rng.standard_normal(means.shape, dtype=np.float32)
            action = np.clip(means, -1.0, 1.0).reshape(*self._advised.shape, 2)
            seen, able = out.observations.copy(), self._advised & out.able
            for number in range(self._hold):
                out = self._batch.step(action)
                if number == 0:
                    new = np.concatenate((seen[able], self._batch.advice[able]), axis=1)
                    self._kept[(self._given + np.arange(len(new))) % CORRECTIONS] = new
                    self._given += len(new)
