"""Many matches at once: repeatable, independent of one another and of threads, and begun anew when they end."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from msgspec import structs

from batch import test_roboflag, test_sharks_and_minnows
from batch.refereeing import smaller
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.stepping import Variation
from vrg_learn.batch.vector import VectorMatches

TESTS = Path(__file__).parents[1]
SHARKS = test_sharks_and_minnows.SETUP
SHORT = structs.replace(
    test_roboflag.SETUP, rules={**test_roboflag.SETUP.rules, "round_time": 3.0, "sudden_death": 2.0}
)
VARIED = Variation(speed=0.1, acceleration=0.2, turning=0.1, position_noise=0.05, heading_noise=0.05, delay=2, loss=0.1)


def random(batch: Batch, seed: int) -> npt.NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (batch.matches, len(batch.players), 2)).astype(np.float32)


def played(batch: Batch, steps: int = 40) -> list[npt.NDArray[np.float32]]:
    """The observations of some steps of random actions."""
    return [batch.reset(seed=5).copy(), *(batch.step(random(batch, n)).observations.copy() for n in range(steps))]


@pytest.mark.parametrize("setup", [SHARKS, SHORT], ids=["sharks and minnows", "roboflag"])
def test_threads_and_other_matches_change_nothing(setup: MatchSetup, small: bool) -> None:
    one, two = (played(Batch(setup, 3, vary=VARIED, threads=t), 8 if small else 40) for t in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))
    assert np.abs(one[-1][0] - one[-1][1]).max() > 1e-3
    assert all(np.abs(seen).max() <= 1.0 for seen in one)


def test_a_match_that_ends_begins_anew_in_the_same_step(in_python: None) -> None:
    batch = Batch(SHORT, 1)
    first = batch.reset().copy()
    ended = 0
    for n in range(100):
        out = batch.step(random(batch, n) * 0.1)
        if out.terminated.any():
            ended += int(out.terminated.sum())
            at = int(np.flatnonzero(out.terminated)[0])
            assert batch.teams[out.winners[at]] == "draw"
            assert np.array_equal(out.observations[at], first[at])
            assert not np.array_equal(out.last[at], first[at])
    assert ended == 1  # two rounds of 3 s and sudden death of 2 s


def test_a_match_is_truncated_where_that_is_asked_for(in_python: None) -> None:
    batch = Batch(SHARKS, 2, most=4)
    batch.reset()
    cut = [batch.step(random(batch, n)).truncated.tolist() for n in range(8)]
    assert cut == [[n % 4 == 3] * 2 for n in range(8)]


@pytest.mark.parametrize("threads", [1, 2])
def test_actions_that_cannot_be_are_refused_and_change_nothing(threads: int, in_python: None) -> None:
    batch, other = Batch(SHARKS, 2, threads=threads), Batch(SHARKS, 2, threads=threads)
    with pytest.raises(ConfigError, match="call reset first"):
        batch.step(random(batch, 0))
    batch.reset()
    other.reset()
    bad = random(batch, 0)
    bad[1, 3, 0] = np.nan
    with pytest.raises(ValueError, match="finite"):
        batch.step(bad)
    with pytest.raises(ValueError, match="not real"):
        batch.step(random(batch, 0) * 1j)
    with pytest.raises(ValueError, match=r"shape \(2, 7, 2\), got shape \(14, 2\)"):
        batch.step(random(batch, 0).reshape(14, 2))
    assert np.array_equal(batch.step(random(batch, 1)).observations, other.step(random(batch, 1)).observations)
    batch.close()
    with pytest.raises(ConfigError, match="it was closed"):
        batch.step(random(batch, 2))


def test_physical_robots_are_refused() -> None:
    players = [structs.replace(player, backend="can", physical=True) for player in SHARKS.players]
    with pytest.raises(ConfigError, match="only virtual robots"):
        Batch(structs.replace(SHARKS, players=players), 2)


def test_players_of_all_matches_are_rows_of_a_vector_environment(in_python: None) -> None:
    """A match of 2 s has a second round and sudden death: it begins anew once, with its last observations."""
    setup = smaller(SHORT, ("red1", "blue1"), round_time=0.5, sudden_death=0.5)
    environment = VectorMatches(Batch(setup, 3))
    seen, infos = environment.reset(seed=1)
    assert infos["able"].all()
    assert seen.shape == environment.observation_space.shape == (6, environment.batch.length)
    ended = 0
    for n in range(30):
        seen, rewards, terminated, truncated, infos = environment.step(environment.action_space.sample() * 0.1)
        assert rewards.shape == terminated.shape == truncated.shape == infos["able"].shape == (6,)
        assert ("final_obs" in infos) == bool(terminated.any()), n
        ended += int(terminated.any())
    assert ended
    environment.close()
    with pytest.raises(ConfigError, match="one seed"):
        environment.reset(seed=[1, 2, 3])


@pytest.mark.thorough
def test_without_numba_the_same_code_plays_the_same() -> None:
    """Slowly, in Python alone."""
    program = (
        "import sys\n"
        "if sys.argv[1] == 'plain':\n"
        "    sys.modules['numba'] = None\n"
        "    import vrg_learn.compiled as c\n"
        "    c.HAS_NUMBA = False\n"
        "from batch.test_matches import *\n"
        "print(''.join(s.round(5).tobytes().hex() for s in played(Batch(SHARKS, 2, vary=VARIED), 6)))\n"
    )
    shown = [
        subprocess.run(
            [sys.executable, "-c", program, how], cwd=TESTS, capture_output=True, text=True, check=True
        ).stdout
        for how in ("plain", "compiled")
    ]
    plain, compiled = (np.frombuffer(bytes.fromhex(text), dtype=np.float32) for text in shown)
    assert plain == pytest.approx(compiled, abs=1e-4)
