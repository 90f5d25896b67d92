#!/usr/bin/env bash
# gymnasium 1.4.0, numpy 2.4.6, CPython 3.11, 2026-11-29
#
# NormalizeReward scales rewards so that the discounted return has a variance of about 1. The first rewards of a training
# are scaled by an estimate that has seen next to nothing: of an environment whose every reward is 1 the first step
# gives 70.7, the second one 2.0, and only after some hundred steps they settle. One would expect numbers of about 1 from
# the first one on, or no scaling until there is an estimate. What learns from the first batch (a value function, a
# replay buffer, which keeps it for ever) learns a target that is many times too large. To live with it: play some
# hundred steps before the training, so that the estimate is there, or clip after it by TransformReward.
. "$(dirname "$0")/setup.bash" gymnasium==1.4.0 numpy==2.4.6
"$python" - <<'PYTHON'
import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.wrappers import NormalizeReward


class Rolling(gymnasium.Env):
    """A robot that gets a reward of 1 at each step."""

    observation_space = Box(-1.0, 1.0, (1,))
    action_space = Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(1, np.float32), {}

    def step(self, action):
        return np.zeros(1, np.float32), 1.0, False, False, {}


env = NormalizeReward(Rolling(), gamma=0.99)
env.reset()
rewards = [float(env.step(np.zeros(1, np.float32))[1]) for _ in range(1000)]
print("each reward is 1; with NormalizeReward:", *(round(reward, 2) for reward in rewards[:4]), "...", end=" ")
print("and the last of 1000:", round(rewards[-1], 3))
assert rewards[0] > 50.0
assert max(rewards[100:]) < 1.0
PYTHON
# Seen:
# each reward is 1; with NormalizeReward: 70.71 2.02 1.24 0.91 ... and the last of 1000: 0.05
