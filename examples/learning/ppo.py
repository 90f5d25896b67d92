"""Proximal policy optimisation (PPO, Schulman et al. 2017) of a policy that all players share, in numpy alone."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from vrg_learn.network import Adam, Network, Parameters

GAMMA, LAMBDA = 0.99, 0.95  # the discount of a step, and of the estimates of advantages (Schulman et al. 2016)
CLIP, ENTROPY, EPOCHS, ROWS = 0.2, 0.002, 3, 4096  # ROWS: those of a minibatch
RATE, LEAST_RATE, MOST_RATE, KL = 5e-4, 5e-5, 2e-3, 0.012  # the rate follows how far an update moves the policy


class Experience(NamedTuple):
    """Decisions to learn from, a row each.

    Args:
        seen: what the player saw. wanted: the motion that it tried out, shape (rows, actions).
        chance: the logarithm of the chance of that. advantages: how much better it was than expected.
        returns: the discounted rewards that followed. able: 1 if the player could move, 0 if not.
        side: the number of its team, 0 or 1.
    """

    seen: np.ndarray
    wanted: np.ndarray
    chance: np.ndarray
    advantages: np.ndarray
    returns: np.ndarray
    able: np.ndarray
    side: np.ndarray


class Learner:
    """A policy and the value of what players see, both of which learn from experience.

    Args:
        actor: the parameters of the policy, and `log_std`, the logarithm of how far it tries motions out.
        critic: those of the value. rng: draws the order of the decisions.

    Attributes:
        policy, value: the networks. actor, critic: what changes each. rate: the rate at which the policy learns.
    """

    def __init__(self, actor: Parameters, critic: Parameters, rng: np.random.Generator) -> None:
        self.actor, self.critic = Adam(actor), Adam(critic)
        self.policy, self.value = Network(actor), Network(critic)
        self.rate, self.rng = RATE, rng
        self._threads = ThreadPoolExecutor(2)

    @property
    def log_std(self) -> np.ndarray:
        """The logarithm of the standard deviation of each number of an action."""
        return self.policy.parameters["log_std"]

    def outputs(self, network: Network, seen: np.ndarray) -> np.ndarray:
        """The outputs of a network for what players see, the last index of `seen`; half of them in each thread."""
        return np.concatenate(list(self._threads.map(network, np.array_split(seen.reshape(-1, seen.shape[-1]), 2))))

    def learn(self, experience: Experience, *, value_alone: bool) -> None:
        """Learn from some experience, of which `advantages` and `able` are changed.

        Args:
            value_alone: True leaves the policy as it is.
        """
        seen, advantages, able, side = experience.seen, experience.advantages, experience.able, experience.side
        for team in (0, 1):  # they learn alike, however few a team has
            moved = (side == team) & (able > 0.0)
            if moved.any():
                advantages[side == team] -= advantages[moved].mean()
                advantages[side == team] /= advantages[moved].std() + 1e-6
                able[moved] *= 0.5 * np.count_nonzero(able) / np.count_nonzero(moved)
        rows = len(seen)
        orders = [np.array_split(self.rng.permutation(rows), max(1, rows // ROWS)) for _ in range(EPOCHS)]
        learning = self._threads.submit(self._learn_value, seen, experience.returns, orders)
        for order in [] if value_alone else orders:
            far = np.mean([self._learn_policy(*(part[p] for part in experience[:4]), able[p]) for p in order])
            self.rate *= 1 / 1.5 if far > 1.5 * KL else 1.5 if far < KL / 1.5 else 1.0
            self.rate = min(MOST_RATE, max(LEAST_RATE, self.rate))
        learning.result()

    def _learn_value(self, seen: np.ndarray, returns: np.ndarray, orders: list[list[np.ndarray]]) -> None:
        for order in orders:
            for rows in order:
                self._fit_value(seen[rows], returns[rows, None])

    def _fit_value(self, seen: np.ndarray, returns: np.ndarray) -> None:
        """Change the value by one minibatch."""
        slopes = self.value.slopes(seen, lambda values, part: (values - returns[part]) / len(returns))
        self.critic.update(slopes, RATE)

    def _learn_policy(
        self, seen: np.ndarray, wanted: np.ndarray, chance: np.ndarray, advantages: np.ndarray, able: np.ndarray
    ) -> float:
        """Change the policy by one minibatch, and return how far it has moved (an estimate of the KL divergence)."""
        log_std, count = self.log_std, max(1.0, float(able.sum()))
        spread, pulls, moved = np.exp(log_std), np.zeros_like(log_std), [0.0]

        def slope(outputs: np.ndarray, rows: slice) -> np.ndarray:
            means = np.tanh(outputs)
            off, advantage = (wanted[rows] - means) / spread, advantages[rows]
            change = likelihood(off, log_std) - chance[rows]
            ratio = np.exp(np.minimum(change, 10.0))
            inside = np.where(advantage > 0.0, ratio < 1.0 + CLIP, ratio > 1.0 - CLIP)
            pull = (-advantage * ratio * inside * able[rows] / count)[:, None]
            pulls[:] += (pull * (off * off - 1.0)).sum(axis=0)
            moved[0] += float(((ratio - 1.0 - change) * able[rows]).sum()) / count
            found: np.ndarray = pull * off / spread * (1.0 - means * means)
            return found

        slopes = self.policy.slopes(seen, slope)
        self.actor.update({**slopes, "log_std": pulls - ENTROPY}, self.rate)
        np.clip(log_std, -2.0, 0.0, out=log_std)
        return moved[0]


def advantages_of(surprises: np.ndarray, going: np.ndarray) -> np.ndarray:
    """The generalised estimates of advantages.

    Args:
        surprises: how much better each step was than its value, shape (steps, matches, players).
        going: whether the match has gone on, shape (steps, matches).
    """
    found, carried = np.zeros_like(surprises), np.zeros_like(surprises[0])
    for step in reversed(range(len(surprises))):
        found[step] = carried = surprises[step] + GAMMA * LAMBDA * carried * going[step][:, None]
    return found


def likelihood(off: np.ndarray, log_std: np.ndarray) -> np.ndarray:
    """The logarithm of the chance of actions, up to a constant, by how many standard deviations they are off."""
    found: np.ndarray = -0.5 * (off * off).sum(axis=-1) - log_std.sum()
    return found
