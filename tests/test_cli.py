"""The `vrg` command: what is wrong is said in words, with its place, and as an exit status."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from vrg import __version__
from vrg.cli import main
from vrg.commands.options import duration
from vrg.config.loading import match_path

GOOD = match_path("sharks-and-minnows").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Done:
    status: int
    out: str
    err: str


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Callable[..., Done]:
    """Run the command line in this process, in an empty folder, where no match runs and none can be started."""

    def start_nothing(*_: object, **__: object) -> None:
        raise AssertionError("a match was started")

    monkeypatch.setattr("vrg.commands.launching.LaunchedMatch", start_nothing)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> Done:
        monkeypatch.setattr(sys, "argv", ["vrg", *arguments])
        status: object = 0
        try:
            main()
        except SystemExit as end:
            status = end.code
        out, err = capsys.readouterr()
        return Done(status if isinstance(status, int) else 0, out, err)

    return run


def changed(*changes: tuple[str, str]) -> str:
    """The default match with other words in place of the first of these."""
    text = GOOD
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def line_of(text: str, words: str) -> int:
    return text[: text.index(words)].count("\n") + 1


def test_the_version_is_printed(vrg: Callable[..., Done]) -> None:
    assert vrg("--version") == Done(0, f"{__version__}\n", "")


def test_a_good_match_file_is_called_good(vrg: Callable[..., Done]) -> None:
    done = vrg("check", "sharks-and-minnows")
    assert done.status == 0
    assert "good: sharks-and-minnows, 7 players, 2 rounds" in done.out


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nosuch.toml", "nosuch.toml: no such file"),
        (
            "chess",
            "expected a match file (*.toml) or a game (hud, practice, pursuit-evasion, roboflag, sharks-and-minnows), "
            "got 'chess'",
        ),
    ],
)
@pytest.mark.parametrize("command", ["play", "check", "node world", "node coordinator", "node recorder"])
def test_a_match_that_is_not_there(vrg: Callable[..., Done], command: str, name: str, said: str) -> None:
    done = vrg(*command.split(), name)
    assert done.status == 1
    assert said in done.err
    assert not Path("runs").exists()


def first_player(line: str) -> list[tuple[str, str]]:
    return [('role = "shark"', f'role = "shark"\n{line}')]


BAD: dict[str, tuple[list[tuple[str, str]], str | None, str]] = {
    "an unknown field": ([("seed = 0", 'colour = "red"')], "colour", "colour: unknown field"),
    "an unknown rule": ([("zone_depth", "zone_width")], "zone_width", "rules.zone_width: unknown field"),
    "an unknown field of a player": (first_player("age = 3"), "age = 3", "players.1.age: unknown field"),
    "no game": ([('game = "sharks-and-minnows"', "")], None, "game: missing"),
    "an unknown game": ([('"sharks-and-minnows"', '"chess"')], "game =", "game: expected one of hud, practice,"),
    "an unknown map": ([('"courtyard"\nengine', '"moon"\nengine')], "map =", "map: "),
    "an unknown engine": ([('"pybullet"', '"magic"')], "engine =", "engine: expected one of "),
    "an unknown backend": (first_player('backend = "spirit"'), "backend", "players.1.backend: expected one of "),
    "an unknown model": (first_player('model = "K9"'), "model", "players.1.model: expected one of "),
    "an unknown role": ([('"shark"', '"whale"')], "role =", "players.1.role: expected one of shark, minnow"),
    "no pass": ([('role = "minnow"', 'role = "shark" #')] * 4, None, "got minnows: 2, sharks: 5"),
    "robots that overlap": ([("x = 21.5", "x = 21.2"), ("y = -15.4", "y = -15.9")], None, "player4 and player5"),
    "a start out of bounds": ([("x = 17.0", "x = 15.0")], None, "player2 starts at (15, -16), out of bounds"),
    "a start outside the map": ([("x = 17.0", "x = 99.0")], None, "expected a pose inside map courtyard"),
    "a word for a number": ([("x = 17.0", 'x = "left"')], 'x = "left"', "players.2.x: "),
    "a number that is none": ([("x = 17.0", "x = nan")], "x = nan", "players.2.x: "),
    "no TOML": ([("[rules]", "[rules")], "[rules", "not TOML"),
    "no such strategy": (
        first_player('strategy = "my.py:Me"'),
        "strategy",
        "players.1.strategy: my.py:Me: no such file",
    ),
}


@pytest.mark.parametrize("command", ["play", pytest.param("check", marks=pytest.mark.thorough)])
@pytest.mark.parametrize(("changes", "place", "said"), BAD.values(), ids=BAD)
def test_a_bad_match_file_is_refused_with_its_line(
    vrg: Callable[..., Done], command: str, changes: list[tuple[str, str]], place: str | None, said: str
) -> None:
    text = changed(*changes)
    Path("bad.toml").write_text(text, encoding="utf-8")
    done = vrg(command, "bad.toml")
    assert done.status == 1
    assert said in done.err
    assert "Traceback" not in done.err
    for problem in done.err.removeprefix("vrg: ").splitlines():
        assert re.match(r"bad\.toml:\d+: \S+", problem), problem
    if place is not None:
        assert f"bad.toml:{line_of(text, place)}: " in done.err
    assert not Path("runs").exists(), "nothing was started"


def test_every_problem_of_a_match_file_is_told_at_once(vrg: Callable[..., Done]) -> None:
    text = changed(
        ('map = "courtyard"', "colour = 3"), ("zone_depth = 4.0", "zone_depth = -1.0"), ("x = 17.0", "x = []")
    )
    Path("bad.toml").write_text(text, encoding="utf-8")
    done = vrg("check", "bad.toml")
    assert done.status == 1
    for field in ("map: missing", "colour: unknown field", "rules.zone_depth: ", "players.2.x: "):
        assert field in done.err


def test_a_match_file_that_is_no_text_is_refused(vrg: Callable[..., Done]) -> None:
    Path("bad.toml").write_bytes(b"\xff\xfe\x00")
    done = vrg("check", "bad.toml")
    assert done.status == 1
    assert "bad.toml: cannot be read: " in done.err


def test_a_run_folder_that_cannot_be_made_is_told(vrg: Callable[..., Done]) -> None:
    Path("file").touch()
    done = vrg("play", "sharks-and-minnows", "--runs", "file")
    assert done.status == 1
    assert "the run folder cannot be made: Not a directory" in done.err
    done = vrg("node", "world", "sharks-and-minnows", "--run", "file/run")
    assert done.status == 1
    assert "the run folder cannot be made: Not a directory" in done.err


def test_a_player_that_is_not_in_the_match_is_refused(vrg: Callable[..., Done]) -> None:
    done = vrg("node", "player", "nemo", "sharks-and-minnows")
    assert done.status == 1
    assert "expected the name of a player of this match (player1, " in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["win"], "No such command 'win'"),
        (["play"], "Missing argument"),
        (["play", "sharks-and-minnows", "--fast"], "No such option"),
        (["play", "sharks-and-minnows", "--rate", "0"], "expected 0.1 to 100 or max, got '0'"),
        (["play", "sharks-and-minnows", "--rate", "nan"], "expected 0.1 to 100 or max, got 'nan'"),
        (["play", "sharks-and-minnows", "--rate", "max"], "max needs --in-process"),
        (["play", "sharks-and-minnows", "--engine", "magic"], "magic"),
        (["play", "sharks-and-minnows", "--seed", "-1"], "greater than or equal to 0"),
        (["official", "set-score", "sharks", "many"], "valid integer"),
        (["topic", "echo", "clock", "--count", "0"], "greater than or equal to 1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_usage_is_status_2(vrg: Callable[..., Done], arguments: list[str], said: str) -> None:
    done = vrg(*arguments)
    assert done.status == 2
    assert said in done.err
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    "arguments", [["official", "halt"], ["official", "recover", "nemo"], ["estop"], ["topic", "list"]], ids=" ".join
)
def test_without_a_match_there_is_nothing_to_decide(vrg: Callable[..., Done], arguments: list[str]) -> None:
    done = vrg(*arguments)
    assert done.status == 1
    assert "no match runs on this machine; one elsewhere needs its name" in done.err


def test_an_endpoint_without_a_protocol_is_told(vrg: Callable[..., Done]) -> None:
    done = vrg("topic", "list", "m", "--router", "127.0.0.1:7447")
    assert done.status == 1
    assert "expected an endpoint such as tcp/127.0.0.1:7447, got '127.0.0.1:7447'" in done.err


@pytest.mark.parametrize("option", ["--sandbox", "--seats"])
def test_a_match_in_one_process_has_no_sandboxes_and_no_seats_and_says_so(
    vrg: Callable[..., Done], option: str
) -> None:
    done = vrg("play", "sharks-and-minnows", "--in-process", option)
    assert done.status == 2
    assert f"{option} needs" in done.err


def test_keys_that_are_typed_are_never_ignored(vrg: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "keys").mkdir()
    done = vrg("estop", "two", "--router", "tcp/127.0.0.1:7447", "--keys", "keys")
    assert done.status == 1
    assert "expected the keys of" in done.err


def test_a_folder_of_keys_that_is_not_there_is_told(vrg: Callable[..., Done]) -> None:
    done = vrg("estop", "two", "--router", "tls/127.0.0.1:7447", "--keys", "keyz")
    assert done.status == 1
    assert "keyz: expected the folder of the keys, found none" in done.err


def test_the_help_page_fits_on_a_screen(vrg: Callable[..., Done]) -> None:
    done = vrg("--help")
    assert done.status == 0
    assert len(done.out.splitlines()) <= 30
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
def test_a_name_that_is_misspelled_comes_with_the_one_that_is_meant(
    vrg: Callable[..., Done], typed: str, said: str
) -> None:
    done = vrg(*typed.split())
    assert done.status != 0
    assert said in " ".join(done.err.split())


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("OKQ.PY:P", "expected a file whose name ends in .py, got 'OKQ.PY': rename it"),
        ("a/b.ipynb:P", "expected a file whose name ends in .py, got 'b.ipynb': save the notebook as a Python file"),
    ],
)
def test_a_strategy_that_is_no_python_file_is_told_so(vrg: Callable[..., Done], target: str, said: str) -> None:
    done = vrg("practice", target)
    assert done.status == 1
    assert said in done.err


def test_only_match_files_are_meant_by_a_match_file_that_is_not_there(vrg: Callable[..., Done]) -> None:
    Path("matcj.toml").write_text("a = 1\n")
    assert "did you mean" not in vrg("play", "match.toml").err
    Path("matcj.toml").write_text(GOOD)
    assert "match.toml: no such file, did you mean 'matcj.toml'?" in vrg("play", "match.toml").err


def test_a_terminal_that_lacks_the_letters_of_a_name_gets_them_as_python_writes_them(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(changed(('name = "player1"', 'name = "小明"'), ('role = "shark"', 'role = "x"')))
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    command = [sys.executable, "-m", "vrg", "check", str(tmp_path / "m.toml")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (1, False)
    command = [sys.executable, "-m", "vrg", "check", str(tmp_path / "小明.toml")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert "\\u5c0f\\u660e.toml: no such file" in done.stderr


@pytest.mark.parametrize("text", ["", "x", "1:2:3:4", "-1", "nan", "1:-2", "61"])
def test_what_is_no_time_within_the_bounds_is_refused(vrg: Callable[..., Done], text: str) -> None:
    done = vrg("topic", "list", "--for", text)
    assert done.status == 2
    assert "expected a time from 0.1 to 60 s, such as 80 or 1:20" in " ".join(done.err.replace("│", "").split())


def test_a_time_may_be_typed_in_minutes() -> None:
    assert [duration()(text) for text in ("80", "1:20", "0:01:20.5", 3.0)] == [80.0, 80.0, 80.5, 3.0]
    for wrong in ("1:99", "1:60:00", "1:-5"):
        with pytest.raises(typer.BadParameter, match="such as 80 or 1:20"):
            duration()(wrong)
