"""What `vrg new` writes works as it is, and it overwrites nothing."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from vrg.config.loading import load_match
from vrg.coordinator.journal import read_journal
from vrg.hal.backends import BACKENDS
from vrg.hal.sim.map import load_map
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import Ending, play
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import Vrg, command_line
from vrg.testing.strategy import StrategyContract

ROOT = Path(__file__).parents[1]
GAME = ROOT / "vrg" / "games" / "sharks_and_minnows" / "match.toml"


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Vrg:
    """Run the command line in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)


def good(vrg: Vrg, *arguments: str) -> str:
    """What a command has printed, which must have succeeded."""
    status, out, err = vrg(*arguments)
    assert (status, err) == (0, ""), err
    return out


def played(match_file: Path, folder: Path) -> Ending:
    """Play a match in one process to its end."""
    folder.mkdir()
    setup, run = load_match(match_file, engine="planar"), RunFolder(folder)
    with open_journal(setup, run) as journal:
        return play(setup, journal, limit=400.0, logs=folder)


def calls(folder: Path) -> list[str]:
    """The short name of every call of a match that was played, in order."""
    return [call.rule for record in read_journal(RunFolder(folder).journal)[1] for call in record.calls]


def with_line(text: str, after: str, line: str) -> str:
    """A match file with a line after one that is there, wherever this stands."""
    assert f"\n{after}\n" in text
    return text.replace(f"\n{after}\n", f"\n{after}\n{line}\n")


@pytest.mark.thorough
class TestPlayer(StrategyContract):
    @pytest.fixture
    def match_file(self, vrg: Vrg, tmp_path: Path) -> Path:
        good(vrg, "new", "player", "ann")
        good(vrg, "new", "match", "final", "ann.py:Ann")
        return tmp_path / "final.toml"


def test_the_player_plays_both_roles_and_every_round(vrg: Vrg, tmp_path: Path) -> None:
    """Seven of them play the game's own match: they tag, and get home."""
    good(vrg, "new", "player", "ann")
    text = with_line(GAME.read_text(encoding="utf-8"), "[[players]]", 'strategy = "ann.py:Ann"')
    match_file = tmp_path / "all.toml"
    match_file.write_text(with_line(text, 'map = "courtyard"', 'engine = "planar"'), encoding="utf-8")
    ending = played(match_file, tmp_path / "run")
    assert ending.state.winner is not None
    said = calls(tmp_path / "run")
    assert said.count("begin") == 2
    assert "tag" in said
    assert min(ending.state.score.values()) > 0, "minnows came home, and sharks tagged"
    logs = [log.read_text(encoding="utf-8") for log in (tmp_path / "run").glob("player*.log")]
    assert logs == [""] * 7, "the players do not fail"
    assert not {"out_of_bounds", "disqualified", "late", "pass_limit", "halt"} & set(said)


def test_the_commands_that_are_printed_work(vrg: Vrg) -> None:
    out = good(vrg, "new", "player", "old_ann")
    assert 'strategy = "old_ann.py:OldAnn"' in out
    command = out.strip().splitlines()[-1].split()
    assert command[:3] == ["vrg", "new", "match"]
    next_out = good(vrg, *command[1:])
    check = next(line.split() for line in next_out.splitlines() if "vrg check" in line)
    assert "can be played: sharks-and-minnows" in good(vrg, *check[1:])


def test_every_optional_line_of_the_match_is_valid(vrg: Vrg, tmp_path: Path) -> None:
    good(vrg, "new", "player", "ann")
    good(vrg, "new", "match", "final")
    text = (tmp_path / "final.toml").read_text(encoding="utf-8")
    text, count = re.subn(r"(?m)^# (?=\w+ = )", "", text)
    assert count >= 10
    (tmp_path / "final.toml").write_text(text, encoding="utf-8")
    assert tomllib.loads(text)["players"][1]["strategy"] == "ann.py:Ann"
    assert "can be played" in good(vrg, "check", "final.toml")


def test_a_match_names_a_player_of_another_folder(vrg: Vrg, tmp_path: Path) -> None:
    good(vrg, "new", "player", "ann", "--output", "mine")
    good(vrg, "new", "match", "final", "mine/ann.py", "--output", "matches/may")
    match_file = tmp_path / "matches" / "may" / "final.toml"
    players = tomllib.loads(match_file.read_text(encoding="utf-8"))["players"]
    assert [p.get("strategy") for p in players] == [None, *["../../mine/ann.py:Ann"] * 3]
    assert "can be played" in good(vrg, "check", str(match_file))


def test_a_match_is_not_written_for_a_player_that_cannot_play(vrg: Vrg, tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("import nosuchmodule\n", encoding="utf-8")
    wrong = {"bob.py:Bob": "no such file: bob.py", "broken.py:Bob": "nosuchmodule", "bob": "expected one of "}
    for player, said in wrong.items():
        status, _, err = vrg("new", "match", "final", player)
        assert (status, "Traceback" in err) == (1, False)
        assert said in err
    assert not (tmp_path / "final.toml").exists()


@pytest.mark.parametrize(
    ("game", "spread"),
    [("sharks-and-minnows", "baca"), ("roboflag", "acacbbbb"), ("pursuit-evasion", "bbbacacacaca"), ("practice", "a")],
)
def test_own_players_are_spread_over_the_teams_of_every_game(vrg: Vrg, tmp_path: Path, game: str, spread: str) -> None:
    names = sorted(set(spread))
    for name in names:
        good(vrg, "new", "player", name)
    good(vrg, "new", "match", "final", *(f"{name}.py" for name in names), "--game", game)
    players = tomllib.loads((tmp_path / "final.toml").read_text(encoding="utf-8"))["players"]
    assert "".join(player["strategy"][0] for player in players) == spread
    assert [player["name"].rstrip("0123456789") for player in players] == list(spread), "and so are they called"
    once = [name for name in spread if spread.count(name) == 1]
    assert {player["name"] for player in players} >= set(once)
    assert f"can be played: {game}" in good(vrg, "check", "final.toml")


def test_a_player_whose_file_has_no_name_for_a_player_keeps_its_own(vrg: Vrg, tmp_path: Path) -> None:
    good(vrg, "new", "player", "ann")
    for name in ("Anna Maria", "shark", "__", "été"):
        shutil.copy(tmp_path / "ann.py", tmp_path / f"{name}.py")
    good(vrg, "new", "match", "mixed", "sharks-and-minnows", "__.py:Ann", "shark.py:Ann")
    assert "can be played" in good(vrg, "check", "mixed.toml")
    good(vrg, "new", "match", "final", "shark.py:Ann", "Anna Maria.py:Ann", "été.py:Ann", "__.py:Ann")
    players = tomllib.loads((tmp_path / "final.toml").read_text(encoding="utf-8"))["players"]
    assert [player["name"] for player in players] == ["Anna_Maria", "shark", "été", "minnow3"]
    assert "can be played" in good(vrg, "check", "final.toml")


def test_more_players_than_a_game_has_places_for_are_refused(vrg: Vrg) -> None:
    good(vrg, "new", "player", "ann")
    status, _, err = vrg("new", "match", "final", *["ann.py"] * 5)
    assert (status, "expected up to 4 players for sharks-and-minnows, got 5" in err) == (1, True)


def test_the_match_can_be_checked_and_played_also_on_the_map(vrg: Vrg, tmp_path: Path) -> None:
    line = good(vrg, "new", "map", "yard").strip().splitlines()[-1].strip()
    assert line == 'map = "yard.toml"'
    yard = load_map(tmp_path / "yard.toml")
    assert (yard.name, len(yard.circles)) == ("yard", 1)
    assert len(yard.boxes) == 6, "four sides of the wall, a bench and a planter"
    assert "vrg play final.toml" in good(vrg, "new", "match", "final")
    assert "can be played: sharks-and-minnows, 4 players, 2 rounds, map open" in good(vrg, "check", "final.toml")
    text = (tmp_path / "final.toml").read_text(encoding="utf-8")
    (tmp_path / "final.toml").write_text(re.sub(r'(?m)^map = "open"', line, text), encoding="utf-8")
    assert good(vrg, "check", "final.toml").endswith("/yard.toml\n")
    ending = played(tmp_path / "final.toml", tmp_path / "run")
    assert ending.state.winner is not None
    assert ending.state.clock < 60.0, "it is short"


def python(folder: Path, *arguments: str, path: tuple[Path, ...] = ()) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder, where VRG and the folders of `path` can be imported."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*path, ROOT)))}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )


def test_the_driver_passes_the_contract_suite(vrg: Vrg, tmp_path: Path) -> None:
    out = good(vrg, "new", "driver", "rover")
    assert "python -m pytest rover" in out
    done = python(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", "rover")
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(re.findall(r"(\d+) passed", done.stdout)[0]) >= 15
    assert "skipped" not in done.stdout


def test_the_suite_finds_a_driver_that_breaks_a_promise(vrg: Vrg, tmp_path: Path) -> None:
    """The tests that are written with a driver really test it."""
    good(vrg, "new", "driver", "rover")
    robot = tmp_path / "rover" / "rover" / "robot.py"
    text = robot.read_text(encoding="utf-8")
    deaf = text.replace("fresh = self._time <= self._heard_at + COMMAND_TIMEOUT", "fresh = True")
    assert deaf != text
    robot.write_text(deaf, encoding="utf-8")
    done = python(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", "rover")
    assert "test_the_watchdog_stops_it_when_commands_cease" in done.stdout
    assert done.returncode == 1


def test_the_installed_driver_is_a_backend(vrg: Vrg, tmp_path: Path) -> None:
    """Its pyproject.toml builds, and a match file may then name it."""
    good(vrg, "new", "driver", "rover")
    good(vrg, "new", "match", "final")
    text = (tmp_path / "final.toml").read_text(encoding="utf-8")
    text = with_line(text, 'name = "minnow2"', 'backend = "rover"')
    (tmp_path / "final.toml").write_text(text, encoding="utf-8")
    before = python(tmp_path, "-m", "vrg", "check", "final.toml")
    assert before.returncode == 1
    assert f"expected one of {', '.join(BACKENDS.names())}, got 'rover'" in before.stderr
    build = "import setuptools.build_meta as b; print(b.build_wheel('..'))"
    built = python(tmp_path / "rover", "-c", build)
    assert built.returncode == 0, built.stderr
    # Python imports from a wheel, which is a zip file, as if it were installed.
    wheel = tmp_path / built.stdout.strip().splitlines()[-1]
    after = python(tmp_path, "-m", "vrg", "check", "final.toml", path=(wheel,))
    assert (after.returncode, after.stderr) == (0, "")
    assert "can be played" in after.stdout
    setup = "from vrg.hal.backends import BACKENDS; print(BACKENDS.get('rover').__name__)"
    assert python(tmp_path, "-c", setup, path=(wheel,)).stdout == "RoverDriver\n"


@pytest.mark.parametrize(
    ("kind", "name", "file"),
    [("player", "ann", "ann.py"), ("match", "final", "final.toml"), ("map", "yard", "yard.toml"), ("driver", "r", "r")],
)
def test_nothing_is_overwritten(vrg: Vrg, tmp_path: Path, kind: str, name: str, file: str) -> None:
    (tmp_path / file).write_text("mine", encoding="utf-8")
    status, out, err = vrg("new", kind, name)
    assert (status, out) == (1, "")
    assert f"{file}: it exists already and is never overwritten" in err
    assert "--output" in err
    assert (tmp_path / file).read_text(encoding="utf-8") == "mine"
    assert [p.name for p in tmp_path.iterdir()] == [file]
    good(vrg, "new", kind, name, "--output", "other")
    assert (tmp_path / "other" / file).exists()


def test_a_link_that_leads_nowhere_is_not_overwritten_and_a_folder_that_cannot_be_made_is_told(
    vrg: Vrg, tmp_path: Path
) -> None:
    (tmp_path / "ann.py").symlink_to(tmp_path / "nowhere.py")
    status, _, err = vrg("new", "player", "ann")
    assert (status, "exists already" in err) == (1, True)
    assert not (tmp_path / "nowhere.py").exists()
    (tmp_path / "file").touch()
    status, _, err = vrg("new", "map", "yard", "--output", "file/maps")
    assert status == 1
    assert "file/maps: the folder cannot be made: Not a directory" in err


@pytest.mark.parametrize(
    ("kind", "name", "said"),
    [
        ("player", "2fast", "1 to 64 characters, A-Z a-z 0-9 _, beginning with a letter, got '2fast'"),
        ("player", "../ann", "beginning with a letter, got '../ann'"),
        ("player", "änn", "beginning with a letter, got 'änn'"),
        ("player", "class", "class: choose another name: it is a keyword of Python"),
        ("player", "strategy", "the player itself uses something called Strategy"),
        ("player", "BORDER", "the player itself uses something called BORDER"),
        ("player", "random", "random.py could hide the module random"),
        ("match", "my match", "beginning with a letter or digit and not with x--, got 'my match'"),
        ("match", "a/b", "got 'a/b'"),
        ("map", "", "with x--, got ''"),
        ("driver", "my-rover", "beginning with a letter, got 'my-rover'"),
        ("driver", "numpy", "numpy: choose another name: another Python package has this name"),
        ("driver", "tests", "tests: choose another name: another Python package has this name"),
    ],
)
def test_a_bad_name_is_told(vrg: Vrg, tmp_path: Path, kind: str, name: str, said: str) -> None:
    status, out, err = vrg("new", kind, name)
    assert (status, out) == (1, "")
    assert said in err
    assert not list(tmp_path.iterdir())


def test_a_name_that_is_only_a_folder_nearby_can_be_a_drivers(
    vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of that name is no package, though Python could import it."""
    (tmp_path / "here" / "rover").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path / "here")
    good(vrg, "new", "driver", "rover")
    assert (tmp_path / "rover" / "rover" / "driver.py").exists()


def test_every_template_is_a_part_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    folder = ROOT / "vrg" / "templates"
    patterns = project["tool"]["setuptools"]["package-data"]["vrg.templates"]
    packed = {file for pattern in patterns for file in folder.glob(pattern)}
    assert len(packed) == 8
    assert packed == {p for p in folder.rglob("*") if p.is_file() and p.suffix not in (".py", ".pyc")}
