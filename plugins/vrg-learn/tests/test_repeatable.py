"""The same seed and the same actions give the same match: in every process, and as a match without an environment."""

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from making import GAMES_LEARNED, digest, short_match

from vrg.agents.strategy import Strategy, decided
from vrg.config.loading import load_match
from vrg.coordinator.journal import read_journal
from vrg.launch.strategy_class import strategy_of
from vrg.runs.run_folder import RunFolder
from vrg.testing.matches import calls_of, played
from vrg_learn.environment import MatchEnvironment
from vrg_learn.single import PlayerEnvironment

HASH = "from making import digest; print(*(digest(game, 4, {play}) for game in {games}))"


@pytest.mark.parametrize(
    ("games", "play"),
    [(("sharks-and-minnows", "roboflag"), 4.0), pytest.param(GAMES_LEARNED, 40.0, marks=pytest.mark.thorough)],
)
def test_one_seed_gives_one_match_in_every_process(games: tuple[str, ...], play: float) -> None:
    """Also in one that hashes texts otherwise."""
    out = subprocess.run(
        [sys.executable, "-c", HASH.format(games=games, play=play)],
        cwd=Path(__file__).parent,  # where `making` is
        env={**os.environ, "PYTHONHASHSEED": "2718"},
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
    )
    found = [digest(game, 4, play) for game in games]
    assert out.stdout.split() == found
    assert {digest(game, 5, play) for game in games}.isdisjoint(found)


@pytest.mark.parametrize(
    ("game", "rules"),
    [
        ("sharks-and-minnows", "passes = 1\npass_limit = 4.0"),
        ("roboflag", "round_time = 4.0\nsudden_death = 1.0"),
        pytest.param("sharks-and-minnows", "passes = 1", marks=pytest.mark.thorough),
        pytest.param("roboflag", "round_time = 20.0\nsudden_death = 5.0", marks=pytest.mark.thorough),
        pytest.param("pursuit-evasion", "", marks=pytest.mark.thorough),
    ],
)
def test_a_match_of_strategies_is_the_same_as_without_an_environment(tmp_path: Path, game: str, rules: str) -> None:
    file = short_match(tmp_path, game, f'lineup = "place"\n{rules}')
    setup = load_match(file, engine="planar", seed=3).at_rate(0.0)
    _, run = played(setup, tmp_path / "run", limit=900.0)
    env = MatchEnvironment(file, learners=[], record=tmp_path / "runs")
    env.reset(seed=3)
    while not env.over:
        env.step({})
    (recorded,) = (tmp_path / "runs").iterdir()
    assert read_journal(run.journal)[1][-1].standing.winner is not None
    assert RunFolder(recorded).journal.read_bytes() == run.journal.read_bytes()
    assert RunFolder(recorded).evidence.read_bytes() == run.evidence.read_bytes()


def test_programs_that_decide_as_the_strategies_do_play_the_same_match(tmp_path: Path) -> None:
    """In the first pass: before the second one strategies drive to their marks, and programs are put there."""
    file = short_match(tmp_path, "sharks-and-minnows", 'lineup = "place"\npasses = 1')
    setup = load_match(file, engine="planar", lasers=False, seed=2).at_rate(0.0)  # in which two are tagged
    _, run = played(setup, tmp_path / "run", limit=900.0)
    env = MatchEnvironment(file, lasers=False, raw=True, record=tmp_path / "runs")
    strategies: dict[str, Strategy] = {agent: strategy_of(setup, agent) for agent in env.possible_agents}
    env.reset(seed=2)
    while env.agents:
        actions = {}
        for agent in env.agents:
            view = env._episode.puppets[agent].view
            assert view is not None
            # The robot itself would slow it down in the same way.
            twist = view.robot.limited(decided(strategies[agent], view)[0].twist)
            actions[agent] = [twist.v, twist.w]
        env.step(actions)
    (recorded,) = (tmp_path / "runs").iterdir()
    calls = [[(c.clock, c.rule, c.players) for c in calls_of(each)] for each in (run, RunFolder(recorded))]
    assert len(calls[0]) > 3
    assert calls[0] == calls[1]


def test_a_match_without_a_journal_and_in_strict_mode_is_the_same(tmp_path: Path) -> None:
    ends = []
    for options in ({}, {"strict": True}, {"record": tmp_path / "runs"}, {"render_mode": "rgb_array"}):
        env = MatchEnvironment("roboflag", max_time=5.0, **options)
        env.reset()
        while env.agents:
            env.step({agent: [0.7, 0.1 * len(agent)] for agent in env.agents})
        ends.append(env.state().tobytes())
    assert len(set(ends)) == 1


def test_two_environments_in_turn_do_not_disturb_each_other() -> None:
    def ends(*seeds: int) -> list[bytes]:
        found = [MatchEnvironment("sharks-and-minnows", max_time=4.0, lasers=False) for _ in seeds]
        for env, seed in zip(found, seeds, strict=True):
            env.reset(seed=seed)
        while found[0].agents:
            for env in found:
                env.step({agent: [0.7, 0.1 * len(agent)] for agent in env.agents})
        return [env.state().tobytes() for env in found]

    assert ends(1, 2) == [*ends(1), *ends(2)]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
@pytest.mark.parametrize("begun", [True, False])
def test_a_copy_goes_on_from_the_same_instant(
    copied: Callable[[PlayerEnvironment], PlayerEnvironment], begun: bool
) -> None:
    """The first takes other ways meanwhile, and ends, which changes nothing for the copy."""
    env = PlayerEnvironment("roboflag", "red2", opponents={"blue": "aggressive"}, lasers=False, shaping=True)
    env.action_space.seed(7)
    if begun:
        env.reset(seed=5)
        for _ in range(20):
            env.step(env.action_space.sample())
    other, third = copied(env), copied(env)
    assert other.action_space.sample().tolist() == third.action_space.sample().tolist(), "also what is drawn goes on"
    if not begun:
        assert other.reset()[0].tolist() == env.reset()[0].tolist() == third.reset()[0].tolist()
    for _ in range(5):
        env.step([1.0, -1.0])
    env.close()
    for n in range(20):
        action = [0.8, 0.1 * n - 1.0]
        (seen, *rest), (again, *same) = other.step(action), third.step(action)
        assert seen.tolist() == again.tolist()
        assert rest == same
    uncopied = PlayerEnvironment("roboflag", "red2", opponents={"blue": "aggressive"}, lasers=False, shaping=True)
    uncopied.action_space.seed(7)
    uncopied.reset(seed=5 if begun else None)
    for _ in range(20 if begun else 0):
        uncopied.step(uncopied.action_space.sample())
    for n in range(20):
        (seen, *rest) = uncopied.step([0.8, 0.1 * n - 1.0])
    assert seen.tolist() == again.tolist()
    assert rest == same
