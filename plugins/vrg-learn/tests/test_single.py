"""One player of a match as an Env of Gymnasium."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from vrg.errors import ConfigError
from vrg_learn.single import IDS, PlayerEnvironment


@pytest.mark.parametrize(
    "name", [name if "RoboFlag" in name else pytest.param(name, marks=pytest.mark.thorough) for name in IDS]
)
def test_it_keeps_the_contract_of_gymnasium(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(f"vrg_learn.single:{name}", max_time=3.0, render_mode="rgb_array")
        check_env(env.unwrapped)
        env.close()


@pytest.mark.parametrize("name", IDS)
def test_programs_learn_from_its_spec_after_how_many_steps_a_match_is_cut_off(name: str) -> None:
    env = gymnasium.make(f"vrg_learn.single:{name}", lasers=False)
    assert env.spec is not None
    assert env.spec.max_episode_steps == 36_000, "an hour of play, a tenth of a second each"
    env.close()
    env = gymnasium.make(f"vrg_learn.single:{name}", lasers=False, max_episode_steps=3)
    env.reset(seed=1)
    assert [env.step(np.zeros(2))[3] for _ in range(3)] == [False, False, True]
    env.close()


def played(env: PlayerEnvironment, seed: int) -> list[tuple[object, ...]]:
    """All that an environment returns in one match of random actions."""
    seen, info = env.reset(seed=seed)
    env.action_space.seed(0)
    found: list[tuple[object, ...]] = [(seen.tolist(), info)]
    while not any(found[-1][2:4]):
        seen, reward, terminated, truncated, info = env.step(env.action_space.sample())
        found.append((seen.tolist(), reward, terminated, truncated, info))
    return found


@pytest.mark.parametrize("game", IDS.values())
def test_one_seed_gives_one_match_also_after_another_one(game: str) -> None:
    """From its beginning to its end, where the check of Gymnasium compares one step."""
    one, other = (PlayerEnvironment(game, max_time=3.0, lasers=False, shaping=True) for _ in range(2))
    first = played(one, 4)
    assert len(first) > 20
    assert first != played(other, 5)
    assert first == played(other, 4)


def test_the_others_play_by_their_strategies_until_the_match_is_over() -> None:
    env = PlayerEnvironment("sharks-and-minnows", "player2", lasers=False, shaping=True)
    observation, info = env.reset(seed=1)
    assert info["able"]
    steps, ended, tagged = 0, False, False
    while not ended and steps < 3000:
        observation, reward, ended, truncated, info = env.step(np.zeros(2))
        assert not truncated
        assert env.observation_space.contains(observation)
        tagged |= reward == pytest.approx(-1.0 + info["shaping"])
        steps += 1
    assert ended
    assert tagged, "a minnow that stands is tagged or late"


def test_the_first_player_learns_if_none_is_named_and_an_unknown_one_is_refused() -> None:
    assert PlayerEnvironment("roboflag").player == "red1"
    env = PlayerEnvironment("roboflag", "blue3", opponents={"red": "aggressive"})
    assert env.environment.possible_agents == ["blue3"]
    with pytest.raises(ConfigError, match=r"expected the name of a player of this match .*got 'blu3'"):
        PlayerEnvironment("roboflag", "blu3")
    with pytest.raises(ConfigError, match="expected `player`"):
        PlayerEnvironment("roboflag", learners=["red1"])
