"""Any game in a batch, also of a package outside: what its referee's match plays, to the last bit."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from msgspec import structs

from batch import test_roboflag, test_sharks_and_minnows
from batch.refereeing import Singles
from vrg.config.files import BodyEntry
from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.testing import installing
from vrg_learn.batch import matches
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.refereed import OWN_STRATEGY
from vrg_learn.batch.vector import VectorMatches
from vrg_learn.environment import MatchEnvironment
from vrg_learn.matches import match_of

ROOT = Path(__file__).parents[4]
EXACT, TICKS, CALM = 0.0, 5e-3, 20
"""As in test_twin."""
ENTRY_POINTS = "[vrg.games]\nlion-and-man = lion_and_man:GAME\n[vrg.strategies]\nlion = lion_and_man.players:Lion\n"
Drives = Callable[[list[str], Singles, np.random.Generator], Singles]
"""Returns actions for the names of what is observed, and observations: both of shape (1, players, values)."""


@pytest.fixture
def outside(tmp_path: Path) -> Iterator[None]:
    """Two packages with games are installed: the example of docs/your-own-game.md, and that of tests/outside."""
    with packages(tmp_path):
        yield


@contextmanager
def packages(folder: Path) -> Iterator[None]:
    """Install both packages of `outside` in a folder."""
    shutil.copytree(ROOT / "examples" / "lion-and-man" / "lion_and_man", folder / "lion_and_man")
    about = folder / "lion_and_man-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lion-and-man\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRY_POINTS)
    with installing.installed(folder), installing.installed(ROOT / "tests" / "outside" / "package"):
        yield


def setup_of(game: str, **rules: object) -> CheckedMatch:
    """The match that a game ships, as it is in a batch, and with other values of some rules."""
    setup = load_match(GAMES.get(game).default_match())
    return as_in_a_batch(structs.replace(setup, rules={**setup.rules, **rules}))


def as_in_a_batch(setup: CheckedMatch) -> CheckedMatch:
    """The same match without noise and lasers, in the planar engine, whose players begin each round on their marks."""
    return match_of(structs.replace(setup, noise=False), engine="planar", lasers=False)


def towards(place: str, names: list[str], seen: Singles, rng: np.random.Generator) -> Singles:
    """The first player drives about to where something is, but for some decisions, and the second one anywhere."""
    at = names.index(f"{place}: cos bearing")
    bearing = np.arctan2(seen[..., at + 1], seen[..., at]) + rng.normal(0.0, 0.5, seen.shape[:2])
    actions = np.stack((np.clip(1.2 - np.abs(bearing), -0.2, 1.0), np.clip(bearing, -1.0, 1.0)), axis=-1)
    wild = rng.random(seen.shape[:2]) < 0.2
    wild[:, 1] = True
    actions[wild] = rng.uniform((-0.1, -1.0), (0.9, 1.0), actions[wild].shape)
    return actions.astype(np.float32)


def assert_the_same(setup: CheckedMatch, drives: Drives, count: int, *, seed: int = 0) -> dict[str, int]:
    """Play matches in a batch and as nodes, by the same actions, compare all that is returned, and count the calls."""
    environment, batch = MatchEnvironment(setup), Batch(setup, 1)
    names = environment.observation_names
    moving = np.array([name in ("v", "w") or "velocity" in name for name in names])
    rng, calls = np.random.default_rng(seed), dict[str, int]()
    batch.reset(seed)
    assert batch.referees is not None
    for _ in range(count):
        seen, _ = environment.reset(seed=int(batch.records.standing.seed[0]))
        began, over = 0, False
        while not over:
            ours, theirs = batch.out.observations[0], np.array([seen[name] for name in batch.players])
            bound = np.where(moving, 2.0 if began else TICKS, EXACT)
            began -= began > 0
            wrong = np.argwhere(np.abs(ours - theirs) > bound)
            assert len(wrong) == 0, [(batch.players[n], names[k]) for n, k in wrong]
            actions, number = drives(names, batch.out.observations, rng), environment.referee.round
            seen, rewards, terminated, _, infos = environment.step(dict(zip(batch.players, actions[0], strict=True)))
            out = batch.step(actions)
            for call in batch.referees.calls[0]:
                calls[call.rule] = calls.get(call.rule, 0) + 1
            assert np.array_equal(out.rewards[0], np.float32([rewards[name] for name in batch.players]))
            over = any(terminated.values())
            assert out.terminated[0] == over
            began = CALM if environment.referee.round != number else began
            if not over:
                assert out.able[0].tolist() == [infos[name]["able"] for name in batch.players]
        assert batch.teams[out.winners[0]] == environment.referee.winner
        assert np.abs(out.last[0] - np.array([seen[name] for name in batch.players]))[:, ~moving].max() == EXACT
    return calls


@pytest.mark.parametrize(
    ("game", "place", "rules", "expected"),
    [
        ("lion-and-man", "other 1", {"radius": 4.0, "time": 5.0}, {"caught", "out", "time_up"}),
        ("race", "nearest point of the finish", {"x": -1.0}, {"finish"}),
    ],
)
def test_a_game_outside_is_the_same_match(
    game: str, place: str, rules: dict[str, object], expected: set[str], small: bool, outside: None
) -> None:
    calls = assert_the_same(setup_of(game, **rules), partial(towards, place), 1 if small else 100)
    assert calls.keys() & expected
    assert small or expected <= calls.keys()


@pytest.mark.thorough
@pytest.mark.parametrize("game", [test_sharks_and_minnows, test_roboflag], ids=["sharks and minnows", "roboflag"])
def test_the_shipped_games_are_the_same_matches_under_their_referees(
    game: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where robots are held, pushed, led, slowed down, and put on marks for a further round."""
    monkeypatch.setattr(matches, "GAMES", {})
    calls = dict[str, int]()
    for setup, count in ((game.SMALL, 3), (game.SETUP, 1)):
        calls |= assert_the_same(as_in_a_batch(setup), lambda _, seen, rng: game.drives(seen, rng), count)
    assert {"tag", "placed", "begin", "game_over"} <= calls.keys()


def test_matches_begin_anew_and_are_rows_of_a_vector_environment(in_python: None, outside: None) -> None:
    environment = VectorMatches(Batch(setup_of("lion-and-man", time=0.5), 2, most=4))
    seen, infos = environment.reset(seed=1)
    seeds = environment.batch.records.standing.seed.copy()
    assert infos["able"].all()
    assert seen.shape == (4, environment.batch.length)
    ended = [environment.step(environment.action_space.sample())[2:4] for _ in range(8)]
    assert [cut.tolist() for _, cut in ended] == [[n % 4 == 3] * 4 for n in range(8)]
    assert not np.array_equal(seeds, environment.batch.records.standing.seed)


def test_a_team_plays_by_the_strategies_of_the_package(in_python: None, outside: None) -> None:
    """Both by their own: the lion comes nearer, as in a match."""
    batch = Batch(setup_of("lion-and-man", radius=3.5), 1)
    assert batch.strategies == (OWN_STRATEGY, "lion")
    batch.play_by(slice(None), "lion", "lion")
    batch.play_by(slice(None), "man", OWN_STRATEGY, advice=True)
    batch.reset()
    for _ in range(12):
        batch.step(np.zeros((1, 2, 2), dtype=np.float32))
    lion, man = batch.records.motions.poses[0]
    assert lion[0] > 0.3
    assert man.tolist() == [3.0, 0.0, np.pi / 2], "its strategy only advises"
    assert np.abs(batch.advice[0, 1]).max() > 0.0


def test_a_match_that_needs_more_than_poses_is_refused() -> None:
    with pytest.raises(ConfigError, match="tell the referee nothing, got pursuit-evasion"):
        Batch(load_match(match_path("pursuit-evasion")), 1)
    with pytest.raises(ConfigError, match="expected a match without `sight`"):
        Batch(structs.replace(test_roboflag.SETUP, sight=3.0), 1)
    ball = BodyEntry(name="ball", kind="ball", x=0.0, y=0.0, radius=0.1)
    with pytest.raises(ConfigError, match=r"expected a match without \[\[bodies\]\]"):
        Batch(structs.replace(test_roboflag.SETUP, bodies=[ball]), 1)
