"""The examples that train: they get better at what they are rewarded for, and go on as if they had not been stopped."""

import importlib.util
import re
import shlex
import signal
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from making import short_match

from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg_learn.demonstration import Pairs, demonstrate
from vrg_learn.learning import learning_of
from vrg_learn.matches import match_of
from vrg_learn.network import Network, initial
from vrg_learn.observation import names
from vrg_learn.policy import Policy, load, save

EXAMPLES = Path(__file__).parents[3] / "examples" / "learning"
SHARKS = "sharks-and-minnows"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(EXAMPLES))  # as Python itself does for a program that is started
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(EXAMPLES))
    return module


train, imitate = example("train"), example("imitate")
OWN = len(names(learning_of(SHARKS), 1))


class Records(NamedTuple):
    """What changes in a TinyBatch."""

    chance: np.recarray[Any, Any]


class TinyBatch:
    """In place of a batch: two players, each of which is paid for turning as far as the third value that it sees.

    A match ends by chance in one of twenty decisions.
    """

    def __init__(self, setup: object, matches: int, *, seed: int = 0, **_: object) -> None:
        self.sides, self.matches, self.length = np.array([1, 0]), matches, OWN + 12
        self.teams, self.strategies, self.referees = ("minnows", "sharks"), ("turner",), None
        self.advice = np.zeros((matches, 2, 2), dtype=np.float32)
        self.records = Records(np.zeros(1, dtype=[("number", np.uint64)]).view(np.recarray))
        self.records.chance.number = seed
        self.out = SimpleNamespace(observations=np.zeros((matches, 2, self.length), dtype=np.float32))
        self.out.able = np.ones((matches, 2), dtype=bool)
        self.out.last = self.out.observations

    def reset(self) -> np.ndarray:
        self.records.chance.number += 1
        rng = np.random.default_rng(int(self.records.chance.number[0]))
        self.out.observations[:] = rng.uniform(-1.0, 1.0, self.out.observations.shape)
        self.out.observations[..., 8:11] = 0.0, 1.0, 0.0  # an active minnow
        self.ended = rng.uniform(size=self.matches) < 0.05
        found: np.ndarray = self.out.observations
        return found

    def step(self, actions: np.ndarray) -> SimpleNamespace:
        rewards = -np.square(actions[..., 1] - self.out.observations[..., 2]).astype(np.float32)
        self.out.last = self.out.observations.copy()
        self.advice[..., 1] = self.out.last[..., 2]
        self.reset()
        self.out.rewards, self.out.terminated = rewards, self.ended
        self.out.truncated, self.out.winners = np.zeros_like(self.ended), self.ended * 1
        return self.out

    def play_by(self, matches: slice, team: str, strategy: str | None, *, advice: bool = False) -> None:
        """All play by actions here."""

    def close(self) -> None:
        pass


def options(**change: object) -> dict[str, Any]:
    found = {"match": SHARKS, "seed": 3, "matches": 16, "horizon": 16, "hold": 1, "most": 50, "vary": False}
    return found | {"start": None, "teacher": "none", "against": None} | change


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(train, "Batch", TinyBatch)


def test_training_gets_better_at_what_it_is_rewarded_for(monkeypatch: pytest.MonkeyPatch, tiny: None) -> None:
    monkeypatch.setattr(sys.modules["ppo"], "ROWS", 256)
    training = train.Training(options())
    for _ in range(30):
        training.go_on()
    rewards = [point["reward"] for point in training.curve]
    # The mean square of what is asked for is a third, and trying out costs as much as its variance.
    assert np.mean(rewards[-3:]) > 0.6 * np.mean(rewards[:3])
    seen = training.batch.reset()
    means = training.learned().means(seen.reshape(-1, seen.shape[-1]))
    assert np.corrcoef(means[:, 1], seen[..., 2].ravel())[0, 1] > 0.8


@pytest.mark.parametrize(
    "real", [False, pytest.param(True, marks=pytest.mark.thorough)], ids=["tiny", "sharks and minnows"]
)
def test_a_training_that_goes_on_is_as_if_never_stopped(
    real: bool, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if not real:
        request.getfixturevalue("tiny")
    whole, stopped = (train.Training(options(horizon=6, hold=2)) for _ in range(2))
    whole.go_on()
    stopped.go_on()
    stopped.write_training(tmp_path / "policy.training")
    again = train.resumed(tmp_path / "policy.training")
    for training in (whole, again):
        training.go_on()
        training.go_on()
    assert again.curve == whole.curve
    assert again.decisions == whole.decisions == 3 * 6 * 2 * whole.learns.size
    for name, values in whole.arrays().items():
        np.testing.assert_array_equal(again.arrays()[name], values, err_msg=name)


def test_what_was_learned_is_a_policy(tmp_path: Path, tiny: None) -> None:
    training = train.Training(options())
    training.go_on()
    save(training.learned(), tmp_path / "policy.npz")
    further = train.Training(options(start=str(tmp_path / "policy.npz")))
    for name, values in load(tmp_path / "policy.npz").network.parameters.items():
        np.testing.assert_array_equal(further.learner.policy.parameters[name], values)
    train.draw(training.curve, tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 1000


@pytest.mark.thorough
def test_lessons_bring_a_policy_nearer_to_its_teacher(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tiny: None
) -> None:
    monkeypatch.setattr(sys.modules["lessons"], "BATCH", 256)
    training = train.Training(options(teacher="turner"))
    assert training.lessons is not None
    training.school = 1e9
    off = [training.go_on() for _ in range(15)]
    assert off[-1] < 0.5 * off[0]
    training.write_training(tmp_path / "policy.training")
    again = train.resumed(tmp_path / "policy.training")
    assert again.lessons is not None
    assert (again.school, again.schooled) == (training.school, training.schooled)
    assert again.go_on() < 0.6 * off[0]
    training.school = training.schooled
    training.go_on()
    assert training.lessons is None
    assert training.curve[-1]["decisions"] == training.decisions


def test_a_teacher_that_a_game_does_not_have_is_refused() -> None:
    with pytest.raises(ConfigError, match="--teacher: expected one of sharks-and-minnows, none"):
        train.Training(options(teacher="conservative"))


def run(monkeypatch: pytest.MonkeyPatch, words: str) -> None:
    monkeypatch.setattr(sys, "argv", ["train", *words.split()])
    train.main()


def test_a_training_is_typed_stopped_and_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tiny: None
) -> None:
    monkeypatch.chdir(tmp_path)
    few = "--matches 16 --horizon 8 --hold 1 --teacher none"
    run(monkeypatch, f"--match {SHARKS} --minutes 0.01 {few}")
    assert {file.name for file in tmp_path.iterdir()} == {"policy.npz", "policy.png", "policy.training"}
    first = load(tmp_path / "policy.npz")
    output = capsys.readouterr().out
    assert f"vrg compare policy.npz turner --match {SHARKS}" in output
    run(monkeypatch, "--resume policy.training --minutes 0.01")
    assert "of them now" in capsys.readouterr().out
    assert any(
        (load(tmp_path / "policy.npz").network.parameters[n] != v).any() for n, v in first.network.parameters.items()
    )
    steps = iter(range(10_000))

    def interrupted(self: TinyBatch, actions: np.ndarray) -> SimpleNamespace:
        if next(steps) == 40:
            signal.raise_signal(signal.SIGINT)
        return step(self, actions)

    step = TinyBatch.step
    monkeypatch.setattr(TinyBatch, "step", interrupted)
    run(monkeypatch, f"--match {SHARKS} --minutes 60 {few} --replace")
    assert "wrote policy.npz" in capsys.readouterr().out
    assert next(steps) < 100, "it has ended after the update that was under way"


def test_a_training_of_a_match_that_has_changed_does_not_go_on(tmp_path: Path, tiny: None) -> None:
    match = short_match(tmp_path, SHARKS)
    train.Training(options(match=str(match))).write_training(tmp_path / "policy.training")
    match.write_text(match.read_text() + "\n# changed\n")
    with pytest.raises(ConfigError, match="has changed since"):
        train.resumed(tmp_path / "policy.training")


WRONG = {
    "train --minutes 0": "--minutes: expected a number above 0",
    "train --hold 0": "--hold: expected 1 or more",
    "train --seed -1": "--seed: expected 0 or more",
    "imitate --pairs nowhere/pairs.npz --output new.npz": "no such folder",
    "imitate --pairs new.npz --output new.npz": "another file than that of --output",
    "imitate --seed -1": "--seed: expected 0 or more",
    "train --output nowhere/p.npz": "no such folder",
    "train --output p.txt": "expected a file NAME.npz",
    "train": "policy.npz: already there",
    "train --resume policy.npz": "expected NAME.training",
    "train --resume no.training": "no.training",
    "train --resume policy.training --seed 3": "leave out --seed",
    "train --match roboflag --teacher conservativ --replace": "did you mean 'conservative'",
    "imitate --minutes 0": "--minutes: expected a number above 0",
    "imitate --games 0": "--games: expected 1 or more",
    "imitate": "policy.npz: already there",
}


@pytest.mark.parametrize("words", WRONG)
def test_what_cannot_work_is_refused_before_the_work(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    learned = Policy(SHARKS, Network(initial(OWN, 12, 2, np.random.default_rng(0))), np.zeros(2, dtype=np.float32))
    save(learned, tmp_path / "policy.npz")
    before = (tmp_path / "policy.npz").read_bytes()
    name, *rest = words.split()
    monkeypatch.setattr(sys, "argv", [name, *rest])
    with pytest.raises(SystemExit) as end:
        {"train": train, "imitate": imitate}[name].main()
    assert WRONG[words] in f"{end.value}{capsys.readouterr().err}"
    assert {file.name for file in tmp_path.iterdir()} == {"policy.npz"}
    assert (tmp_path / "policy.npz").read_bytes() == before


def test_rivals_play_each_team_of_their_matches() -> None:
    rivals = train.rivals_of(128, ("one", "two"))
    rows = [number for rival in rivals for number in range(128)[rival.matches]]
    assert rows == list(range(len(rows)))
    assert sum(len(range(128)[rival.matches]) for rival in rivals if rival.strategy) == 64
    assert {(rival.strategy, rival.team) for rival in rivals} == {(s, t) for s in ("", "one", "two") for t in (0, 1)}


def test_what_strategies_do_is_kept_as_pairs(tmp_path: Path) -> None:
    match = short_match(tmp_path, SHARKS, rules="passes = 1\npass_limit = 5.0")
    pairs = demonstrate(match_of(match, engine="planar", lasers=False))
    setup = load_match(match)
    assert pairs.observations.shape[1] == OWN + 12 * (len(setup.players) - 1)
    assert 100 < len(pairs.observations) == len(pairs.actions) <= 51 * len(setup.players)
    assert (np.abs(pairs.actions) <= 1.0).all()
    assert pairs.observations[:, OWN - 16 + 1].all()  # all were active


def test_an_imitation_does_nearly_the_same() -> None:
    rng = np.random.default_rng(0)
    seen = rng.uniform(-1.0, 1.0, (4000, OWN + 24)).astype(np.float32)
    pairs = Pairs(seen, np.stack([0.8 * seen[:, 1], -0.5 * seen[:, 2]], axis=1))
    policy, errors = imitate.fitted(SHARKS, pairs, minutes=60.0, epochs=15)
    assert errors[-1] < 0.1 * float(np.square(pairs.actions).mean())
    assert policy.game == SHARKS


PAGE = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
BATCHED = [snippet for snippet in SNIPPETS if "Batch(" in snippet]


def test_the_page_shows_commands_that_work() -> None:
    commands = re.findall(r"^    python examples/learning/(\w+)\.py (.*)$", PAGE, re.MULTILINE)
    assert {name for name, _ in commands} == {"train", "imitate"}
    for name, words in commands:
        {"train": train, "imitate": imitate}[name].make_parser().parse_args(shlex.split(words))


@pytest.mark.parametrize(
    "snippets",
    [[s for s in SNIPPETS if s not in BATCHED], pytest.param(BATCHED, marks=pytest.mark.thorough)],
    ids=["environments", "batch"],
)
def test_the_page_shows_code_that_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snippets: list[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert snippets
    for snippet in snippets:
        exec(snippet, {})
