"""A policy: its file, what is refused as one, and players that play by it wherever a strategy can be named."""

import io
import json
import os
import pickle
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from making import GAMES_LEARNED, Situation, short_match

from vrg.agents.strategy import Action
from vrg.bus.messages import DISQUALIFIED, Stage
from vrg.config.loading import check_strategies, load_match, match_path
from vrg.coordinator.journal import NoJournal
from vrg.errors import ConfigError
from vrg.games import file_of, has_name
from vrg.launch.sandbox.player_policy import policy_of
from vrg.launch.sandbox.policy import Access
from vrg.launch.strategy_class import strategy_class, strategy_of
from vrg.playing.in_process import play
from vrg.playing.trial import trial
from vrg.runs.keeping import files_of, files_of_strategy
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg_league.contenders import contenders, entered, seen_from
from vrg_learn import policy as policies
from vrg_learn.action import twist_of
from vrg_learn.learning import learning_of
from vrg_learn.network import Network, initial, layout_of
from vrg_learn.observation import observe
from vrg_learn.policy import Policy, PolicyPlayer, load, player_of, save

SHARKS = "sharks-and-minnows"


def random_policy(game: str = SHARKS, seed: int = 0) -> Policy:
    layout = layout_of(learning_of(game))
    parameters = initial(len(layout.own), len(layout.slot), 2, np.random.default_rng(seed), last=1.0)
    return Policy(game, Network(parameters), np.zeros(2, dtype=np.float32), "chance")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    found = tmp_path / "policy.npz"
    save(random_policy(), found)
    return found


@pytest.mark.parametrize("game", GAMES_LEARNED)
def test_a_policy_is_read_as_it_was_written(game: str, tmp_path: Path) -> None:
    written = random_policy(game)
    save(written, tmp_path / "a.npz")
    read = load(tmp_path / "a.npz")
    assert (read.game, read.trained) == (game, "chance")
    assert read.network.parameters.keys() == written.network.parameters.keys()
    for name, values in written.network.parameters.items():
        np.testing.assert_array_equal(read.network.parameters[name], values)


def test_it_plays_what_its_network_says() -> None:
    policy, situation = random_policy(), Situation(SHARKS)
    view = situation.view("player2")
    action = type("Player", (PolicyPlayer,), {"policy": policy})("player2", view.robot).act(view)
    assert isinstance(action, Action)
    seen = observe(view, situation.learning)
    assert action.twist == twist_of(np.tanh(policy.network(seen[None]))[0], (view.robot.v_max, view.robot.w_max))


def test_it_drives_to_its_mark_as_the_games_own_strategy_does(file: Path, tmp_path: Path) -> None:
    """A match whose referee puts nobody on a mark cannot begin otherwise."""
    match = match_with(Path(file.name), tmp_path)
    text = match.read_text(encoding="utf-8").replace("y = -30.0", "y = -28.5")
    match.write_text(text.replace("[rules]", 'lasers = false\n[rules]\nlineup = "drive"'), encoding="utf-8")
    setup = load_match(match, engine="planar")
    ending = play(setup, NoJournal(), limit=12.0)
    assert not ending.failures
    assert ending.state.stage is not Stage.INITIALIZE
    assert ending.state.clock > 0.0 or ending.state.round > 1


def arrays_of(file: Path) -> dict[str, np.ndarray]:
    with np.load(file) as found:
        return {name: found[name] for name in found.files}


def with_header(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    arrays = arrays_of(file)
    header = json.loads(str(arrays["header"]))
    change(header)
    np.savez(file, **{**arrays, "header": np.array(json.dumps(header))})


def with_array(file: Path, name: str, array: np.ndarray | None) -> None:
    arrays = {**arrays_of(file), name: array}
    np.savez(file, **{key: value for key, value in arrays.items() if value is not None})


def damaged(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)


def nan(file: Path) -> None:
    weights = arrays_of(file)["first.weight"]
    weights[3, 4] = np.nan
    with_array(file, "first.weight", weights)


def bomb(file: Path) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.npy", bytes(policies.MOST_BYTES + 1))


def lying(file: Path) -> None:
    """An array that says that it is larger than all memory."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f4", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr("more.npy", head.getvalue())


def header(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    return lambda file: with_header(file, change)


def array(name: str, values: np.ndarray | None) -> Callable[[Path], None]:
    return lambda file: with_array(file, name, values)


def content(data: bytes) -> Callable[[Path], object]:
    return lambda file: file.write_bytes(data)


AN_ARCHIVE = "expected a policy, an archive of numpy"
BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "no file": (os.unlink, "no such file"),
    "a pickle": (content(pickle.dumps({"first.weight": [1.0]})), "got a pickle"),
    "a pickle in an array": (array("first.weight", np.array([{}])), "cannot be read as a policy"),
    "text": (content(b"weights"), AN_ARCHIVE),
    "nothing": (content(b""), AN_ARCHIVE),
    "one array": (lambda file: np.save(file.open("wb"), np.zeros(3)), AN_ARCHIVE),
    "no header": (array("header", None), "an archive without a header"),
    "a header of numbers": (array("header", np.zeros(3)), "an archive without a header"),
    "no json": (array("header", np.array("{")), "the header is wrong"),
    "deep json": (array("header", np.array("[" * 100_000)), "the header is wrong"),
    "a field more": (header(lambda h: h.update(colour="red")), "the header is wrong"),
    "a later format": (header(lambda h: h.update(format=2)), "of format 1, got 2"),
    "an unknown game": (header(lambda h: h.update(game="chess")), "got 'chess'"),
    "another game": (header(lambda h: h.update(game="roboflag")), "train it again"),
    "other values": (
        header(lambda h: h["own"].__setitem__(3, "z")),
        "value 3 of 'own' is 'w', and it was trained with 'z'",
    ),
    "an array less": (array("last.bias", None), "found no last.bias"),
    "an array more": (array("critic last.bias", np.zeros(1)), "found critic last.bias too"),
    "another shape": (
        array("last.bias", np.zeros(3, dtype=np.float32)),
        r"last.bias: expected float32 of shape (2,), got float32 of (3,)",
    ),
    "another type": (array("last.bias", np.zeros(2)), "expected float32"),
    "nan": (nan, "first.weight: expected finite numbers"),
    "too large": (lambda file: file.write_bytes(bytes(policies.MOST_BYTES + 1)), "of at most 8 MB, got 8.0 MB"),
    "too large when unpacked": (bomb, "of at most 8 MB"),
    "a damaged one": (damaged, ""),
    "an array that lies": (lying, ""),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_policy_is_refused_with_the_reason(case: str, file: Path) -> None:
    spoil, reason = BAD[case]
    spoil(file)
    with pytest.raises(ConfigError) as error:
        load(file)
    assert reason in str(error.value)
    assert str(file) in str(error.value)


def test_only_a_policy_is_written(tmp_path: Path) -> None:
    policy = random_policy()
    policy.network.parameters["last.bias"][0] = np.inf
    with pytest.raises(ConfigError, match="finite"):
        save(policy, tmp_path / "policy.npz")
    assert not (tmp_path / "policy.npz").exists()


def test_a_file_is_told_from_a_name() -> None:
    assert file_of("policy.npz") == file_of("./policy.npz").removeprefix("./") == "policy.npz"  # type: ignore[union-attr]
    assert file_of("folder/mine.py:Mine") == "folder/mine.py"
    assert file_of("module:Class") is file_of("pursuer") is file_of("some.name") is None
    named = ("pursuer", "policy.npz", "mine.py:Mine", "module:Class")
    assert [has_name(text) for text in named] == [True, False, False, False]


def match_with(file: Path, folder: Path, game: str = SHARKS) -> Path:
    """The match file of a game in which all play by a policy."""
    return short_match(folder, game, players=f'strategy = "{file}"')


def test_a_match_is_played_by_a_policy(file: Path, tmp_path: Path) -> None:
    setup = load_match(match_with(Path(file.name), tmp_path), engine="planar")
    check_strategies(setup, strategy_of)
    ending = play(setup, NoJournal(), limit=5.0)
    assert not ending.failures
    assert ending.state.stage in (Stage.PLAY_ROUND, Stage.GAME_OVER)
    assert setup.strategy_file(setup.players[0].name) == file.resolve()
    kind = player_of(file)
    assert issubclass(kind, PolicyPlayer)
    assert (kind.games, kind.policy.trained) == ((SHARKS,), "chance")


def test_a_policy_of_pursuit_evasion_tells_what_the_games_own_strategy_tells(tmp_path: Path) -> None:
    save(random_policy("pursuit-evasion"), tmp_path / "policy.npz")
    setup = load_match(match_with(Path("policy.npz"), tmp_path, "pursuit-evasion"), engine="planar")
    assert not play(setup, NoJournal(), limit=3.0).failures


def test_emulated_drives_do_what_a_policy_wants(file: Path, tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "examples" / "mixed.toml").read_text(encoding="utf-8")
    assert text.count('backend = "can"') == 2
    match = tmp_path / "match.toml"
    match.write_text(text.replace('backend = "can"', f'backend = "can"\nstrategy = "{file.name}"'), encoding="utf-8")
    setup = load_match(match, engine="planar", lasers=False)
    ending = play(setup, NoJournal(), limit=12.0)
    assert not ending.failures
    assert ending.state.clock > 0.0
    assert not any(player.state == DISQUALIFIED for player in ending.state.players)


@pytest.mark.parametrize(
    ("game", "named", "said"),
    [
        ("roboflag", "policy", "expected a strategy for roboflag, got one that plays sharks"),
        (SHARKS, "gone", r"gone\.npz: no such file"),
        (SHARKS, "weights", AN_ARCHIVE),
    ],
    ids=["of another game", "missing", "no policy"],
)
def test_a_policy_that_cannot_play_is_a_fault_of_the_match_file_at_its_line(
    file: Path, tmp_path: Path, game: str, named: str, said: str
) -> None:
    (tmp_path / "weights.npz").write_text("weights")
    with pytest.raises(ConfigError, match=rf"match\.toml:\d+: .*{said}"):
        check_strategies(load_match(match_with(Path(f"{named}.npz"), tmp_path, game)), strategy_of)


def test_a_policy_is_tried_in_a_process_of_its_own(file: Path, tmp_path: Path) -> None:
    with trial() as tried:
        tried.find("policy.npz", tmp_path)
        setup = load_match(match_with(Path(file.name), tmp_path))
        tried.make(setup, setup.players[0].name)
        file.write_text("weights")
        with pytest.raises(ConfigError, match="expected a policy, an archive of numpy"):
            tried.find("policy.npz", tmp_path)


def test_a_sealed_player_may_read_its_own_policy_and_no_other(tmp_path: Path) -> None:
    for team in ("sharks", "minnows"):
        save(random_policy(), tmp_path / f"{team}.npz")
    text = match_path(SHARKS).read_text(encoding="utf-8")
    for role, team in (("shark", "sharks"), ("minnow", "minnows")):
        text = text.replace(f'role = "{role}"', f'role = "{role}"\nstrategy = "{team}.npz"')
    (tmp_path / "match.toml").write_text(text, encoding="utf-8")
    setup = load_match(tmp_path / "match.toml")
    run = RunFolder(tmp_path / "runs" / "run")
    files = policy_of(setup, "player1", run=run).files
    readable = {path for path, access in files if Access.READ in access}
    assert tmp_path / "sharks.npz" in readable
    assert not any((tmp_path / "minnows.npz").is_relative_to(path) for path in readable)


def test_a_run_folder_keeps_the_policies_of_its_match(file: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    setup = load_match(match_with(file, tmp_path / "elsewhere"))
    kept = files_of(setup)
    [(place, source)] = kept.copies.items()
    assert source == file.resolve()
    assert f'strategy = "{place.as_posix()}"' in kept.text
    copied = {Path("substitute/policy.npz"): file}
    assert files_of_strategy(str(file), Path("substitute")) == ("substitute/policy.npz", copied)


def test_policies_are_compared_by_the_names_of_their_files(file: Path, tmp_path: Path) -> None:
    assert [found.label for found in contenders([str(file), SHARKS])] == ["policy", SHARKS]
    assert seen_from(tmp_path, str(file)) == "policy.npz"


def test_a_new_match_for_a_policy_is_one_of_its_game(tmp_path: Path) -> None:
    learned = tmp_path / "learned.npz"
    for game, player in (("roboflag", 0), (SHARKS, 1)):
        save(random_policy(game), learned)
        here = tmp_path / game
        done = invoke("new", "match", "first", str(learned), "--output", str(here))
        assert done.exit_code == 0, done.output
        setup = load_match(here / "first.toml")
        assert setup.game == game
        assert strategy_class(setup.players[player].strategy, here).games == (game,)
    wrong = invoke("new", "match", "other", str(learned), "--game", "roboflag")
    assert "expected a strategy for roboflag, got one that plays sharks-and-minnows alone" in str(wrong.exception)


def test_a_policy_cannot_practise(file: Path) -> None:
    wrong = invoke("practice", str(file), "--in-process")
    assert "expected a strategy for practice, got one that plays sharks-and-minnows alone" in str(wrong.exception)


@pytest.mark.thorough
def test_a_policy_is_compared_with_the_shipped_strategy(file: Path, tmp_path: Path) -> None:
    match = short_match(tmp_path, SHARKS, rules="passes = 1\npass_limit = 1.0", top="lasers = false")
    where = ("--match", str(match), "--output", str(tmp_path / "compared"))
    done = invoke("compare", str(file), SHARKS, "--games", "2", "--jobs", "1", *where)
    assert done.exit_code == 0, done.output
    assert "2 games played" in done.output
    assert "policy" in done.output


def test_a_folder_of_policies_and_players_is_a_field_of_a_tournament(tmp_path: Path) -> None:
    save(random_policy(), tmp_path / "b.npz")
    (tmp_path / "a.py").write_text(
        "from vrg.agents import Strategy\nclass A(Strategy):\n    def act(self, view): ...\n"
    )
    (tmp_path / "notes.txt").write_text("")
    found, wrong = entered([str(tmp_path)], folders=True)
    assert [contender.label for contender in found] == ["a", "b"]
    assert found[1].target == str(tmp_path / "b.npz")
    assert not wrong


def test_a_player_of_a_policy_loads_no_library_for_learning(file: Path, tmp_path: Path) -> None:
    match = match_with(Path(file.name), tmp_path)
    code = (
        "import sys\nfrom pathlib import Path\nfrom vrg.config.loading import load_match\n"
        "from vrg.launch.nodes.player import player_node\n"
        f"setup = load_match(Path({str(match)!r}))\nplayer_node(setup, setup.players[0].name)\n"
        "print(*(m for m in ('numba', 'gymnasium', 'pettingzoo', 'pygame', 'scipy') if m in sys.modules))"
    )
    out = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=600, check=True)
    assert out.stdout.split() == []
