"""A match as a ParallelEnv: its contract, its rewards, and how it refuses what it cannot do."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from making import GAMES_LEARNED, short_match
from msgspec import structs
from pettingzoo.test import parallel_api_test, parallel_seed_test

from vrg.bus.messages import Stage
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError, StrategyError
from vrg.hal.models.drivetrain import Drivetrain
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sim.engines import default_engine
from vrg_learn.action import limits_of
from vrg_learn.environment import MatchEnvironment


def drive(env: MatchEnvironment, v: float = 0.0, w: float = 0.0) -> dict[str, list[float]]:
    return {agent: [v, w] for agent in env.agents}


def shark_ahead_of_a_minnow(folder: Path, rules: str = "") -> Path:
    """One shark behind one minnow: if both drive straight ahead, or the minnow stands, the shark tags it."""
    file = folder / "two.toml"
    file.write_text(
        'name = "two"\ngame = "sharks-and-minnows"\nmap = "open"\nlasers = false\n'
        f"[rules]\nx = [-5.0, 5.0]\ny = [-10.0, 10.0]\nzone_depth = 2.0\npasses = 1\n{rules}\n"
        '[[players]]\nname = "jaws"\nrole = "shark"\nx = 0.0\ny = -8.5\nheading = 90.0\n'
        '[[players]]\nname = "nemo"\nrole = "minnow"\nx = 0.0\ny = 8.5\nheading = -90.0\n',
        encoding="utf-8",
    )
    return file


@pytest.fixture
def env() -> MatchEnvironment:
    """A match of RoboFlag that has begun."""
    return begun("roboflag")


def begun(*arguments: Any, **options: Any) -> MatchEnvironment:
    found = MatchEnvironment(*arguments, **options)
    found.reset()
    return found


@pytest.mark.parametrize(
    "game", ["sharks-and-minnows", "roboflag", pytest.param("pursuit-evasion", marks=pytest.mark.thorough)]
)
def test_it_keeps_the_contract_of_pettingzoo(game: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(MatchEnvironment(game, max_time=6.0, raw=game == "roboflag"), num_cycles=80)
        parallel_seed_test(lambda: MatchEnvironment(game, max_time=1.0), num_cycles=10)


@pytest.mark.parametrize("game", GAMES_LEARNED)
@pytest.mark.parametrize("raw", [False, True])
def test_observations_and_the_state_are_in_their_spaces(game: str, raw: bool) -> None:
    env = MatchEnvironment(game, raw=raw, max_time=3.0, shaping=True)
    observations, _ = env.reset()
    while env.agents:
        for agent in env.agents:
            assert env.observation_space(agent).contains(observations[agent])
        assert env.state_space.contains(env.state())
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        observations, rewards, _, _, infos = env.step(actions)
        assert all(isinstance(reward, float) for reward in rewards.values())
        assert all(isinstance(info["shaping"], float) for info in infos.values())
    assert len(env.state_names) == env.state_space.shape[0]


def test_every_step_is_one_decision_of_play(tmp_path: Path) -> None:
    """Between the rounds nobody decides; the clock of the new round has just begun."""
    env = begun(short_match(tmp_path, "roboflag", "round_time = 1.0\nsudden_death = 1.0"))
    rounds, clocks = [], []
    while env.agents:
        env.step(drive(env, 1.0))
        state = env.referee
        assert state.stage in (Stage.PLAY_ROUND, Stage.GAME_OVER)
        rounds.append(state.round)
        clocks.append(state.clock)
    assert sorted(set(rounds)) == [1, 2, 3]
    assert rounds == sorted(rounds)
    assert len(rounds) == pytest.approx(30, abs=3)
    assert all(clocks[index] < 0.2 for index in range(1, len(rounds)) if rounds[index] != rounds[index - 1])


def test_at_the_start_and_in_each_round_everybody_is_on_its_mark(tmp_path: Path) -> None:
    env = MatchEnvironment(short_match(tmp_path, "roboflag", "round_time = 3.0"), raw=True)
    observations, _ = env.reset()
    starts = {name: observations[name][:2] for name in env.agents}
    for _ in range(28):
        observations, *_ = env.step(drive(env, 0.7))
    assert any(np.linalg.norm(observations[name][:2] - starts[name]) > 1.0 for name in env.agents)
    for _ in range(3):
        observations, *_ = env.step(drive(env))
    marks = np.array([*starts.values()])
    for name in env.agents:
        assert np.linalg.norm(marks - observations[name][:2], axis=1).min() < 0.6


def test_the_shark_is_paid_for_its_tag_and_the_sharks_win(tmp_path: Path) -> None:
    env = begun(shark_ahead_of_a_minnow(tmp_path))
    earned = {"jaws": 0.0, "nemo": 0.0}
    while env.agents:
        _, rewards, terminations, truncations, infos = env.step(drive(env, 1.0))
        earned = {name: earned[name] + reward for name, reward in rewards.items()}
    assert earned == {"jaws": 2.0, "nemo": -2.0}
    assert terminations == {"jaws": True, "nemo": True}
    assert truncations == {"jaws": False, "nemo": False}
    assert infos["jaws"]["winner"] == "sharks"
    assert env.over


def test_a_minnow_that_arrives_is_paid_and_wins(tmp_path: Path) -> None:
    env = begun(shark_ahead_of_a_minnow(tmp_path), shaping=True)
    earned, shaped, steps = {"jaws": 0.0, "nemo": 0.0}, {"jaws": 0.0, "nemo": 0.0}, 0
    while env.agents:
        # The shark turns aside and leaves the field, so that it is out of the pass; then the minnow crosses.
        steps += 1
        jaws, nemo = [0.0, -1.0] if steps <= 8 else [1.0, 0.0], [1.0, 0.0] if steps > 200 else [0.0, 0.0]
        _, rewards, _, _, infos = env.step({"jaws": jaws, "nemo": nemo})
        for name, reward in rewards.items():
            shaped[name] += infos[name]["shaping"]
            earned[name] += reward - infos[name]["shaping"]
    assert earned == pytest.approx({"jaws": -2.0, "nemo": 2.0})
    assert shaped["nemo"] > 0.2, "it has come nearer to the safe zone"


def test_a_player_that_is_out_of_play_stays_and_knows_it() -> None:
    env = begun("sharks-and-minnows", lasers=False, raw=True)
    place, out = env.observation_names.index("i am active"), set[str]()
    # Most drive out of the field. In the next pass they are sharks.
    while len(out) < 4:
        observations, rewards, terminations, _, infos = env.step(drive(env, 0.7))
        assert not any(terminations.values())
        assert env.agents == env.possible_agents
        for name, info in infos.items():
            assert observations[name][place] == float(info["able"])
            if not info["able"]:
                assert rewards[name] == (0.0 if name in out else -1.0)
                out.add(name)


def test_a_match_that_takes_too_long_is_cut_off_for_all() -> None:
    env = begun("roboflag", max_time=1.0)
    for _ in range(9):
        _, _, terminations, truncations, _ = env.step(drive(env))
        assert not any(truncations.values())
    _, _, terminations, truncations, _ = env.step(drive(env))
    assert all(truncations.values())
    assert not any(terminations.values())
    assert env.agents == []
    with pytest.raises(ConfigError, match=r"has ended: call reset"):
        env.step({})


def test_a_disqualified_player_is_done_and_the_others_go_on(env: MatchEnvironment) -> None:
    assert env._episode is not None
    match = env._episode._assembly.coordinator.match
    match.disqualify("red1", "it is a test", match.public(env._episode._assembly.coordinator._field), by_official=True)
    _, _, terminations, _, infos = env.step(drive(env))
    assert [name for name, done in terminations.items() if done] == ["red1"]
    assert not infos["red1"]["able"]
    assert env.agents == [name for name in env.possible_agents if name != "red1"]
    observations, *_ = env.step(drive(env))
    assert "red1" not in observations


def test_seeds_follow_from_one_another_and_attributes_may_be_written() -> None:
    def seed_of(env: MatchEnvironment, **options: Any) -> int:
        env.reset(**options)
        return env.match_seed

    env, seeds = MatchEnvironment("roboflag"), []
    for each in (env, MatchEnvironment("roboflag")):
        seeds.append([seed_of(each) for _ in range(3)])
    assert seeds[0] == seeds[1]
    assert seeds[0][0] == 0, "the first match has the seed of the match file"
    assert len(set(seeds[0])) == 3
    assert seed_of(env, seed=np.int64(7)) == 7
    env.max_cycles = 3
    assert env.unwrapped is env, "attributes may be written"


def test_players_that_do_not_learn_play_by_the_strategies_that_are_named() -> None:
    env = MatchEnvironment("roboflag", opponents={"blue": "aggressive", "blue2": "conservative"})
    assert env.possible_agents == ["red1", "red2", "red3", "red4"]
    strategies = {player.name: player.strategy for player in env._setup.players}
    assert strategies["blue1"] == "aggressive"
    assert strategies["blue2"] == "conservative"
    observations, _ = env.reset()
    assert sorted(observations) == env.possible_agents
    for _ in range(30):
        observations, *_ = env.step(drive(env))
    seen = observations["red1"]
    moving = [seen[env.observation_names.index(f"other {n}: velocity ahead")] for n in range(1, 8)]
    assert any(abs(v) > 0.1 for v in moving)


def test_pursuers_report_what_they_see_though_a_program_drives_them() -> None:
    """Their strategies go on telling: without, nobody would ever be dispatched."""
    env = begun("pursuit-evasion", learners=["pursuer1", "pursuer2", "pursuer3"])
    active = False
    while env.agents and not active:
        *_, infos = env.step(drive(env, 1.0))
        active = any(info["able"] for info in infos.values())
    assert active


def test_a_spectator_s_picture_needs_no_window() -> None:
    env = begun("sharks-and-minnows", render_mode="rgb_array", max_time=2.0)
    first = env.render()
    env.step(drive(env, 1.0))
    second = env.render()
    assert first is not None
    assert (first.shape, first.dtype) == ((640, 960, 3), np.uint8)
    assert first.std() > 10.0
    assert (first != second).any()
    assert MatchEnvironment("roboflag").render() is None


def test_a_recorded_match_leaves_a_run_folder(tmp_path: Path) -> None:
    env = MatchEnvironment(shark_ahead_of_a_minnow(tmp_path), record=tmp_path / "runs")
    for _ in range(2):
        env.reset()
        while env.agents:
            env.step(drive(env, 1.0))
    folders = sorted((tmp_path / "runs").iterdir())
    assert len(folders) == 2
    for folder in folders:
        assert {"match.toml", "journal.jsonl", "recording.mcap", "result.json"} <= {p.name for p in folder.iterdir()}
    again = load_match(folders[0] / "match.toml")
    assert again.rules["lineup"] == "place"
    assert again.engine == "planar"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.pop("red1"), "expected an action of each of red1.*got none of red1"),
        (lambda a: a.update(red1=[0.0]), r"red1: expected the shape \(2,\), got \(1,\)"),
        (lambda a: a.update(red1=0.0), r"red1: expected the shape \(2,\), got \(\)"),
        (lambda a: a.update(red1=[0.0, float("nan")]), "red1: expected finite numbers"),
        (lambda a: a.update(red1=[float("inf"), 0.0]), "red1: expected finite numbers"),
        (lambda a: a.update(red1=np.array([0.5, 0.5j])), "red1: expected 2 real numbers"),
        (lambda a: a.update(red1="left"), "red1: expected 2 numbers, got 'left'"),
        (lambda a: a.update(green1=[0.0, 0.0]), "expected a player that learns"),
    ],
    ids=["missing", "shape", "scalar", "nan", "inf", "complex", "text", "stranger"],
)
def test_a_wrong_action_is_refused_and_nothing_has_happened(
    env: MatchEnvironment, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    actions: dict[str, Any] = drive(env)
    change(actions)
    before = env.state()
    with pytest.raises(ConfigError, match=message):
        env.step(actions)
    assert (env.state() == before).all()
    env.step(drive(env))


def test_what_is_beyond_the_bounds_is_cut_off() -> None:
    ends = []
    for value in (1.0, 1e9):
        env = begun("roboflag")
        for _ in range(5):
            env.step(drive(env, value, -value))
        ends.append(env.state())
    assert (ends[0] == ends[1]).all()


def test_nothing_can_be_asked_of_a_match_that_has_not_begun() -> None:
    env = MatchEnvironment("roboflag", render_mode="rgb_array")
    for act in (lambda: env.step({}), env.state, env.render):
        with pytest.raises(ConfigError, match=r"call reset\(\) first"):
            act()
    for begin in (env.reset, env.close):
        begin()
        env.close()
        env.close()
    with pytest.raises(ConfigError, match=r"call reset\(\) first"):
        env.step({})
    env.reset()
    env.step(drive(env))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"learners": ["red9"]}, "learners: expected one of"),
        ({"learners": "red1"}, r"expected a list of players"),
        ({"opponents": {"green": "balanced"}}, "opponents: expected players or teams"),
        ({"opponents": {"blue": "balance"}}, "balanced"),
        ({"opponents": {"blue": "nowhere.py:Mine"}}, "no such file"),
        ({"opponents": {"blue": "no_such_module:Mine"}}, "cannot be imported"),
        ({"learners": ["red1"], "opponents": {"red1": "balanced"}}, "in one place"),
        ({"engine": "bullet"}, "engine"),
        ({"render_mode": "human"}, "expected 'rgb_array' or None"),
        ({"gamma": 2.0}, "gamma"),
        ({"max_time": 0.0}, "max_time"),
        ({"max_time": float("nan")}, "max_time"),
    ],
)
def test_a_wrong_argument_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        MatchEnvironment("roboflag", **arguments)


@pytest.mark.parametrize("seed", [-1, 2**63, 1.5, "one"])
def test_a_wrong_seed_is_refused(env: MatchEnvironment, seed: Any) -> None:
    with pytest.raises(ConfigError, match="seed: expected a whole number"):
        env.reset(seed=seed)
    env.reset(seed=1)


def test_a_match_that_cannot_be_learned_or_has_physical_robots_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected a match file"):
        MatchEnvironment("chess")
    setup = load_match(match_path("roboflag"))
    players = [structs.replace(setup.players[0], physical=True), *setup.players[1:]]
    with pytest.raises(ConfigError, match=r"expected virtual robots, but those of red1 are physical ones"):
        MatchEnvironment(structs.replace(setup, players=players))


FAILING = """
from vrg.agents import Strategy, Twist

class Failing(Strategy):
    def act(self, view):
        if view.referee.clock > 0.5:
            raise RuntimeError("out of luck")
        return Twist(0.0, 0.0)
"""


def opposed(folder: Path, old: str = "", new: str = "") -> MatchEnvironment:
    """A match with an opponent that fails at the next decision, in one way or another."""
    file = folder / "failing.py"
    file.write_text(FAILING.replace(old, new) if old else FAILING, encoding="utf-8")
    env = begun("roboflag", opponents={"blue3": f"{file}:Failing"})
    for _ in range(6):
        env.step(drive(env))
    assert env.referee.clock == pytest.approx(0.6)
    return env


def test_an_opponent_that_fails_is_named_with_the_reason(tmp_path: Path) -> None:
    env = opposed(tmp_path)
    with pytest.raises(StrategyError, match=r"out of luck.*player blue3"):
        env.step(drive(env))
    assert env.agents == []
    with pytest.raises(ConfigError, match=r"call reset\(\) first"):
        env.step({})
    env.reset()
    env.step(drive(env))


def test_an_opponent_whose_file_was_edited_plays_by_it_from_the_next_match_on(tmp_path: Path) -> None:
    env = opposed(tmp_path)
    (tmp_path / "failing.py").write_text(FAILING.replace("luck", "duck"), encoding="utf-8")
    env.reset()
    for _ in range(6):
        env.step(drive(env))
    with pytest.raises(StrategyError, match="out of duck"):
        env.step(drive(env))


def test_who_interrupts_while_an_opponent_decides_has_interrupted_the_program(tmp_path: Path) -> None:
    env = opposed(tmp_path, 'RuntimeError("out of luck")', "KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        env.step(drive(env))
    env.reset()


def test_an_opponent_that_cannot_be_made_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="division by zero"):
        opposed(tmp_path, "class Failing(Strategy):", "class Failing(Strategy):\n    x = 1 / 0")


def test_a_robot_that_can_drive_sideways_has_an_action_of_three_numbers() -> None:
    rates = ((1.0, 0.2, 0.0), (-0.5, 0.2, 0.8), (-0.5, 0.2, -0.8))
    omni = Drivetrain(axes=("a", "b", "c"), wheels=(), wheel_radius=0.1, wheel_width=0.05, rates=rates)
    assert limits_of(P2AT) == (0.7, 2.4)
    assert limits_of(replace(P2AT, drivetrain=omni)) == (0.7, 2.4, 0.7)


def test_the_other_engine_can_be_chosen() -> None:
    env = MatchEnvironment("sharks-and-minnows", engine=None, lasers=False, max_time=1.0)
    for _ in range(2):
        env.reset()
        while env.agents:
            env.step(drive(env, 1.0))
        assert env._setup.engine == default_engine()
    env.close()


def test_a_match_in_which_nobody_learns_plays_by_itself() -> None:
    env = MatchEnvironment("sharks-and-minnows", learners=[], lasers=False)
    assert env.reset() == ({}, {})
    for _ in range(50):
        assert env.step({}) == ({}, {}, {}, {}, {})
    assert not env.over
