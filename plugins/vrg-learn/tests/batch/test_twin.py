"""A batch plays what the nodes of a match play: the same observations, masks and rewards for the same actions."""

from types import ModuleType

import numpy as np
import pytest
from msgspec import structs

from batch import test_roboflag, test_sharks_and_minnows
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg_learn.batch.matches import Batch
from vrg_learn.environment import MatchEnvironment

EXACT, TICKS = 0.0, 5e-3
"""The bounds of differences: of poses and what follows from them, and of velocities. Odometry counts ticks: one in
20 ms is 1 mm/s."""
CALM = 20
"""The decisions after the line-up in which players see the velocities of robots that were put somewhere else."""


def as_in_a_batch(setup: MatchSetup) -> MatchSetup:
    """The same match without noise and lasers, in the planar engine, whose players begin each round on their marks."""
    rules = {**setup.rules, "lineup": "place"}
    return structs.replace(setup, noise=False, lasers=False, engine="planar", rules=rules)


@pytest.mark.parametrize(
    ("game", "led"),
    [(test_sharks_and_minnows, False), pytest.param(test_roboflag, True, marks=pytest.mark.thorough)],
    ids=["sharks and minnows", "roboflag"],
)
def test_the_same_actions_are_the_same_match(game: ModuleType, led: bool, small: bool) -> None:
    """To the end, or where tagged players are led around others, to the first of them."""
    setup = as_in_a_batch(game.SMALL if small else game.SETUP)
    environment, batch = MatchEnvironment(setup), Batch(setup, 1)
    moving = np.array([name in ("v", "w") or "velocity" in name for name in environment.observation_names])
    rewarded, unable = 0.0, 0
    for seed in range(1 if small or not led else 3):
        seen, _ = environment.reset(seed=seed)
        batch.reset()
        assert batch.out.able.all()
        limits = rulebook_of(structs.replace(setup, seed=seed)).speed_limits()
        if limits:
            batch.records.standing.limits[0] = [limits[name] for name in batch.players]
        rng, began = np.random.default_rng(seed), 0
        for step in range(600):
            ours, theirs = batch.out.observations[0], np.array([seen[name] for name in batch.players])
            bound = np.where(moving, 2.0 if began and step < began + CALM else TICKS, EXACT)
            wrong = np.argwhere(np.abs(ours - theirs) > bound)
            assert len(wrong) == 0, (step, [(batch.players[n], environment.observation_names[k]) for n, k in wrong])
            published = {p.name: p.pose for p in environment.referee.players}
            poses = [structs.astuple(published[name])[:3] for name in batch.players]
            assert np.array_equal(batch.records.minds.poses[0], poses), step
            before = batch.records.standing.number[0]
            actions = game.drives(batch.out.observations, rng)
            seen, rewards, terminated, _, infos = environment.step(dict(zip(batch.players, actions[0], strict=True)))
            out = batch.step(actions)
            assert out.rewards[0] == pytest.approx([rewards[name] for name in batch.players])
            rewarded += float(np.abs(out.rewards).sum())
            assert out.terminated[0] == any(terminated.values())
            if out.terminated[0]:
                break
            assert out.able[0].tolist() == [infos[name]["able"] for name in batch.players], step
            unable += int(np.count_nonzero(~out.able))
            if led and "tag" in [batch.rules[k] for k in batch.records.calls.rules[0, :1]]:
                break
            if batch.records.standing.number[0] != before:
                began = step + 1
    assert rewarded > 0 or led
    assert unable, "a player was tagged, or has left the field"
