"""The `vrg` command: what is wrong is said in words, with its place, and as an exit status."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest
import typer

from vrg import __version__
from vrg.commands.options import duration
from vrg.config.loading import match_path
from vrg.games import GAMES
from vrg.plugins import COMMANDS
from vrg.plugins import broken as unusable
from vrg.testing.command_line import Done, Vrg, command_line, tells_of_missing
from vrg.testing.tiny import TINY

GOOD = match_path("sharks-and-minnows").read_text(encoding="utf-8")
NO_TIME = "expected a time from 0.1 to 60 s, such as 80 or 1:20"


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Vrg:
    """Run the command line in this process, in an empty folder, where no match runs and none can be started."""

    def start_nothing(*_: object, **__: object) -> None:
        raise AssertionError("a match was started")

    monkeypatch.setattr("vrg.playing.over_processes.LaunchedMatch", start_nothing)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return command_line(monkeypatch, capsys)


def test_a_good_match_file_is_called_good(vrg: Vrg) -> None:
    assert vrg("--version") == Done(0, f"{__version__}\n", "")
    done = vrg("check", "sharks-and-minnows")
    assert done.status == 0
    assert "can be played: sharks-and-minnows, 7 players, 2 rounds" in done.out


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nosuch.toml", "nosuch.toml: no such file"),
        (
            "chess",
            f"expected a match file (*.toml) or a game ({', '.join(GAMES.names())}), got 'chess'",
        ),
    ],
)
@pytest.mark.parametrize("command", ["play", "check", "node world", "node coordinator", "node recorder"])
def test_a_match_that_is_not_there(vrg: Vrg, command: str, name: str, said: str) -> None:
    done = vrg(*command.split(), name)
    assert done.status == 1
    assert said in done.err
    assert not Path("runs").exists()


@pytest.mark.parametrize("command", ["play", "check"])
def test_every_problem_of_a_match_file_is_told_with_its_line_and_nothing_is_started(vrg: Vrg, command: str) -> None:
    """Which problems there are: test_config.py."""
    text = GOOD.replace('map = "courtyard"', "colour = 3").replace("x = 17.0", "x = []")
    Path("bad.toml").write_text(text, encoding="utf-8")
    done = vrg(command, "bad.toml")
    assert done.status == 1
    told = done.err.removeprefix("vrg: ").splitlines()
    assert [line.partition(" ")[0] for line in told] == ["bad.toml:1:", "bad.toml:7:", "bad.toml:29:"]
    for field in ("map: missing", "colour: unknown field", "players.2.x: "):
        assert field in done.err
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("check bad.toml", "bad.toml: cannot be read: "),
        ("play GAME --runs bad.toml", "the run folder cannot be made: Not a directory"),
        ("node world GAME --run bad.toml/run", "the run folder cannot be made: Not a directory"),
        ("node player nemo GAME", "expected the name of a player of this match (player1, "),
        ("official halt", "no match runs on this machine; for one elsewhere, give its name"),
        ("official recover nemo", "no match runs on this machine; for one elsewhere, give its name"),
        ("estop", "no match runs on this machine; for one elsewhere, give its name"),
        ("topic list", "no match runs on this machine; for one elsewhere, give its name"),
        ("topic list m --router 127.0.0.1:7", "expected an endpoint such as tcp/127.0.0.1:7447, got '127.0.0.1:7'"),
        ("official halt two --router tls/127.0.0.1:7447 --keys keys", "expected the keys of"),
        ("official halt two --router tls/127.0.0.1:7447 --keys keyz", "keyz: expected the folder of the keys, found"),
        ("practice OKQ.PY:P", "expected a file whose name ends in .py, got 'OKQ.PY': rename it"),
        ("practice a/b.ipynb:P", "ends in .py, got 'b.ipynb': save the notebook as a Python file"),
    ],
)
def test_what_cannot_be_done_is_said_with_status_1(vrg: Vrg, arguments: str, said: str) -> None:
    Path("bad.toml").write_bytes(b"\xff\xfe\x00")
    Path("keys").mkdir()
    done = vrg(*arguments.replace("GAME", "sharks-and-minnows").split())
    assert done.status == 1
    assert said in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["win"], "No such command 'win'"),
        (["commander"], " show commander'?"),
        (["play"], "Missing argument"),
        (["play", "sharks-and-minnows", "--fast"], "No such option"),
        (["play", "sharks-and-minnows", "--rate", "0"], "expected 0.1 to 100 or max, got '0'"),
        (["play", "sharks-and-minnows", "--rate", "nan"], "expected 0.1 to 100 or max, got 'nan'"),
        (["play", "sharks-and-minnows", "--rate", "max"], "max needs --in-process"),
        (["play", "sharks-and-minnows", "--engine", "magic"], "magic"),
        (["play", "sharks-and-minnows", "--seed", "-1"], "greater than or equal to 0"),
        (["official", "set-score", "sharks", "many"], "valid integer"),
        (["topic", "echo", "clock", "--count", "0"], "greater than or equal to 1"),
        (["play", "sharks-and-minnows", "--in-process", "--seats"], "--seats needs"),
        (["play", "sharks-and-minnows", "--in-process", "--web"], "--web needs the bus"),
        *((["topic", "list", "--for", wrong], NO_TIME) for wrong in ("", "x", "1:2:3:4", "-1", "nan", "1:-2", "61")),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_usage_is_status_2(vrg: Vrg, arguments: list[str], said: str) -> None:
    done = vrg(*arguments)
    assert done.status == 2
    assert said in " ".join(done.err.replace("│", "").split())
    assert not Path("runs").exists()


def test_a_folder_in_the_place_of_a_match_file_is_told(vrg: Vrg) -> None:
    Path("mine.toml").mkdir()
    done = vrg("check", "mine.toml")
    assert done.status == 1
    assert "mine.toml: expected a regular file of a match, found none" in done.err


@pytest.mark.parametrize(
    ("package", "arguments"),
    [("segno", ["keys", "sheet", "roboflag"]), ("aiohttp", ["show", "web"])],
)
def test_a_package_that_is_missing_is_told_with_what_installs_it(package: str, arguments: list[str]) -> None:
    tells_of_missing(package, arguments)


@pytest.mark.parametrize(
    ("hidden", "said"),
    [
        (
            "pygame",
            "no window: the package pygame is not installed, and this needs it: pip install 'pygame'; or watch in",
        ),
        ("vrg.ui.window.window", "no window: pygame, which draws windows, cannot be imported: "),
        ("", "no window: no screen answers at :99: watch in a browser, with --web or `vrg show web`"),
    ],
)
def test_a_window_that_cannot_be_opened_says_why(
    vrg: Vrg, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, hidden: str, said: str
) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    if hidden:
        monkeypatch.setitem(sys.modules, hidden, None)
    command = ("play", "tiny.toml", "--in-process", "--rate", "100", "--no-record")
    shown, quiet = vrg(*command), vrg(*command, "--headless")
    assert (shown.status, quiet.status) == (0, 0)
    assert said in shown.out
    assert "no window" not in quiet.out


def test_the_help_page_fits_on_a_screen(vrg: Vrg) -> None:
    done = vrg("--help")
    assert done.status == 0
    assert len(done.out.splitlines()) <= 32
    assert max(map(len, done.out.splitlines())) <= 80
    for page in ("show", "run", "node"):
        assert vrg(page).out == vrg(page, "--help").out != ""


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("plya", "vrg play'?"),
        ("replay", "vrg run replay'?"),
        ("show widnow", "vrg show window'?"),
        ("official hlat", "'halt'?"),
        ("play shark-and-minnows", "did you mean 'sharks-and-minnows'?"),
        ("practice --map courtyrd", "did you mean 'courtyard'?"),
        ("practice sharks-and-minnow", "did you mean 'sharks-and-minnows'?"),
        ("node player playr1 sharks-and-minnows", "did you mean 'player1'?"),
    ],
)
def test_a_name_that_is_misspelled_comes_with_the_one_that_is_meant(vrg: Vrg, typed: str, said: str) -> None:
    done = vrg(*typed.split())
    assert done.status != 0
    assert said in " ".join(done.err.split())


def test_only_match_files_are_meant_by_a_match_file_that_is_not_there(vrg: Vrg) -> None:
    Path("matcj.toml").write_text("a = 1\n")
    assert "did you mean" not in vrg("play", "match.toml").err
    Path("matcj.toml").write_text(GOOD)
    assert "match.toml: no such file, did you mean 'matcj.toml'?" in vrg("play", "match.toml").err


def test_a_terminal_that_lacks_the_letters_of_a_name_gets_them_as_python_writes_them(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(GOOD.replace('name = "player1"', 'name = "小明"').replace('"shark"', '"x"'))
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    for file, said in (("m.toml", "players.1.role: "), ("小明.toml", "\\u5c0f\\u660e.toml: no such file")):
        command = [sys.executable, "-m", "vrg", "check", str(tmp_path / file)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert (done.returncode, "Traceback" in done.stderr) == (1, False)
        assert said in done.stderr


def test_a_time_may_be_typed_in_minutes() -> None:
    assert [duration()(text) for text in ("80", "1:20", "0:01:20.5", 3.0)] == [80.0, 80.0, 80.5, 3.0]
    for wrong in ("1:99", "1:60:00", "1:-5"):
        with pytest.raises(typer.BadParameter, match="such as 80 or 1:20"):
            duration()(wrong)


ROS_MATCH = GOOD.replace('name = "player1"', 'name = "player1"\nbackend = "ros"')
VESC_MATCH = (
    GOOD.replace('name = "player1"', 'name = "player1"\nbackend = "can"')
    + '\n[backends.can]\nprotocol = "vesc"\n[backends.can.robots.player1]\nleft = [0]\nright = [1]\n'
)
HUD_GAME = GOOD.replace('game = "sharks-and-minnows"', 'game = "hud"')
ROS_DRIVES = GOOD.replace('name = "player1"', 'name = "player1"\nstrategy = "ros"')


@pytest.mark.parametrize(
    ("typed", "package"),
    [
        ("can scan", "drives"),
        ("check vesc.toml", "drives"),
        ("edit match.toml", "edit"),
        ("fuzz roboflag", "faults"),
        ("compare one.py two.py --match roboflag", "league"),
        ("league play class", "league"),
        ("tournament class --match roboflag", "league"),
        ("show foxglove", "views"),
        ("node foxglove match.toml", "views"),
        ("play sharks-and-minnows --foxglove", "views"),
        ("show developer", "views"),
        ("play sharks-and-minnows --developer", "views"),
        ("show hud red1", "views"),
        ("node hud red1", "views"),
        ("play hud", "views"),
        ("check hud.toml", "views"),
        ("show ros", "ros"),
        ("node ros match.toml", "ros"),
        ("play sharks-and-minnows --ros", "ros"),
        ("play sharks-and-minnows --show ros=tcp/0.0.0.0:7448", "ros"),
        ("check robot.toml", "ros"),
        ("check driven.toml", "ros"),
        ("show 3d", "views"),
        ("node three match.toml", "views"),
        ("play sharks-and-minnows --3d", "views"),
        ("run replay --3d", "views"),
        ("run replay --show 3d", "views"),
    ],
)
def test_each_door_to_a_plugin_that_is_not_installed_names_its_package(
    vrg: Vrg, monkeypatch: pytest.MonkeyPatch, typed: str, package: str
) -> None:
    monkeypatch.setattr("vrg.registry.added", dict)
    monkeypatch.setattr("vrg.ui.web.drawers.DRAWERS._found", {})
    for name, text in (("robot", ROS_MATCH), ("driven", ROS_DRIVES), ("hud", HUD_GAME), ("vesc", VESC_MATCH)):
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
    done = vrg(*typed.split())
    assert done.status in (1, 2)
    said = " ".join(done.err.replace("│", "").split())
    assert f"the package virtual-robotic-games-{package} adds: run `make setup` in a clone, or" in said
    assert not Path("runs").exists()


@pytest.mark.parametrize("terminal", [True, False])
def test_alone_it_prints_its_help_where_no_package_adds_what_a_person_starts_with(
    vrg: Vrg, monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    monkeypatch.setattr("vrg.registry.added", dict)
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: terminal)
    done = vrg()
    assert done.status == 2
    assert "COMMAND ..." in done.out
    assert "Without a command" not in done.out


def entry_of(tmp_path: Path, text: str) -> Any:
    """A look-up of entry points that finds one command, `chorus`, in a module of this text."""
    (tmp_path / f"{tmp_path.name}_chorus.py").write_text(text, encoding="utf-8")
    entry = EntryPoint("chorus", f"{tmp_path.name}_chorus:CHORUS", "vrg.commands")
    return lambda: {"vrg.commands": {"chorus": entry}}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("raise RuntimeError('out of tune')", "cannot import"),
        ("raise SystemExit(3)", "cannot import"),
        ("CHORUS = 7", "expected a vrg.plugins.Command"),
        ("from vrg.plugins import Command\nCHORUS = Command('chorus', 'Play', 'Sing', 'no:where')", "expected a vrg.p"),
        ("from vrg.plugins import Command\nCHORUS = Command(('sing',), 'Play', 'Sing', 'no:where')", "this path"),
        (
            "from vrg.plugins import Command\nCHORUS = Command(('chorus',), 'Play', 'Sing', 'no:where')",
            "import no:where",
        ),
    ],
)
def test_a_command_of_another_package_that_cannot_be_used_is_refused_and_takes_no_other_with_it(
    vrg: Vrg, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, why: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    for module in ("vrg.registry", "vrg.plugins"):
        monkeypatch.setattr(f"{module}.added", entry_of(tmp_path, text))
    monkeypatch.setattr(COMMANDS, "_found", {})
    monkeypatch.setattr(COMMANDS, "_unusable", set())
    broken, help_page, other = vrg("chorus"), vrg("--help"), vrg("check", "sharks-and-minnows")
    assert [name for name, _ in unusable()] == ([] if why == "import no:where" else ["chorus"]), "`vrg doctor` names it"
    assert broken.status in (1, 2)
    assert why in " ".join(broken.err.replace("│", "").split())
    assert (help_page.status, other.status) == (0, 0)
