"""Plain `vrg` and `vrg edit` with --terminal: questions, and what is printed where nobody answers."""

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from tests.command_line import command_line
from vrg.commands import prompt, welcome
from vrg.commands.drafts import choices_in
from vrg.config.loading import load_match
from vrg.hal.sim.engines import ENGINES, PLANAR, default_engine, installed
from vrg.ui.edit.choices import Choices
from vrg.ui.edit.draft import Draft
from vrg.ui.edit.editor import NextStep
from vrg.ui.edit.server import EditServer

Answer = Callable[..., tuple[int, str, list[list[str]]]]
OTHER = next((name for name in ENGINES.names() if installed(name) and name != default_engine()), PLANAR)
"""An engine that is not the default one."""


@pytest.fixture
def answer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Answer:
    """Answer the questions in an empty folder: returns the status, what was printed, and what would go on."""
    monkeypatch.chdir(tmp_path)
    went_on: list[list[str]] = []
    monkeypatch.setattr(welcome, "run", lambda words, runs: went_on.append(list(words)))

    def give(*answers: str, file: Path | None = None) -> tuple[int, str, list[list[str]]]:
        app = typer.Typer()

        @app.command()
        def begin() -> None:
            from vrg.commands.drafts import open_draft  # noqa: PLC0415 - as the command does

            welcome.begin(draft=None if file is None else open_draft(file), terminal=True)

        done = CliRunner().invoke(app, input="\n".join(answers) + "\n")
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.exit_code, done.output, went_on

    return give


def test_enter_alone_saves_and_plays_the_default_match(answer: Answer, tmp_path: Path) -> None:
    status, _, went_on = answer(*[""] * 8)
    assert (status, went_on) == (0, [["play", str(tmp_path / "courtyard.toml")]])
    assert len(load_match(tmp_path / "courtyard.toml").players) == 7


def test_questions_change_the_match_and_refuse_nonsense(answer: Answer, tmp_path: Path) -> None:
    status, told, went_on = answer(
        "chess", "roboflag", "mars", "?", "open", "warp", "planar", "-1", "5", "many", "2",
        "7", "1", "ann", "", "balanced", "", "", "near", "-2", "", "90", "", "a b", "final", "n",
    )  # fmt: skip
    assert (status, went_on) == (0, [])
    for words in (
        "expected one of hud, practice, pursuit-evasion, roboflag, sharks-and-minnows, got 'chess'",
        "map: expected one of courtyard, marhes_lab, open, got 'mars'",
        "engine: expected one of mujoco, planar, pybullet, got 'warp'",
        "seed: expected at least 0, got -1",
        "expected a whole number from 1 to 64, got 'many'",
        "expected a number from 1 to 2, got '7'",
        "ann x: expected a number, got 'near'",
        "got 'a b'",
    ):
        assert words in told
    setup = load_match(tmp_path / "final.toml")
    first = setup.players[0]
    assert (setup.engine, setup.seed, [p.name for p in setup.players]) == ("planar", 5, ["ann", "blue1"])
    assert (first.strategy, first.pose.x, round(first.pose.theta, 3)) == ("balanced", -2.0, 1.571)


def test_a_match_that_cannot_be_played_is_asked_for_again(answer: Answer, tmp_path: Path) -> None:
    status, told, _ = answer(
        "", "", "", "", "", "1", "", "minnow", "", "", "", "", "", "", "",
        "", "", "", "1", "", "shark", "", "", "", "99", "20.5", "", "", "", "final", "n",
    )  # fmt: skip
    assert status == 0
    assert "expected at least one shark, got none" in told
    assert "expected a pose inside map courtyard" in told
    assert load_match(tmp_path / "final.toml").players[0].pose.x == 20.5


def test_another_file_is_only_replaced_if_that_is_wanted(answer: Answer, tmp_path: Path) -> None:
    (tmp_path / "courtyard.toml").write_text("mine", encoding="utf-8")
    _, told, _ = answer(*[""] * 7, "n", "other", "n")
    assert "courtyard.toml is already there. Replace it?" in told
    assert (tmp_path / "courtyard.toml").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "other.toml").exists()


def test_a_match_file_is_changed_and_keeps_its_comments(answer: Answer, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    text = Draft.of_game("hud", tmp_path).text.replace("[rules]", "# about the rules\n[rules]")
    file.write_text(text, encoding="utf-8")
    answer("", OTHER, "", "", "", "", "n", file=file)
    changed = file.read_text(encoding="utf-8")
    assert changed == text.replace('map = "marhes_lab"\n', f'map = "marhes_lab"\nengine = "{OTHER}"\n')


def test_answers_are_not_lost_where_the_file_has_become_unreadable_meanwhile(
    answer: Answer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mine.toml"
    text = Draft.of_game("hud", tmp_path).text
    file.write_text(text, encoding="utf-8")

    def spoiling(folder: Path) -> Choices:
        file.write_bytes(b"\x80 is no UTF-8")
        return choices_in(folder)

    monkeypatch.setattr(prompt, "choices_in", spoiling)
    _, told, _ = answer("", OTHER, "", "", "", "", "y", "n", file=file)
    assert "mine.toml is already there. Replace it?" in told
    assert file.read_text(encoding="utf-8") == text.replace(
        'map = "marhes_lab"\n', f'map = "marhes_lab"\nengine = "{OTHER}"\n'
    )


def test_a_file_that_is_no_toml_is_told(answer: Answer, tmp_path: Path) -> None:
    file = tmp_path / "broken.toml"
    file.write_text("a =\n", encoding="utf-8")
    with pytest.raises(AssertionError, match=r"broken.toml:1: not TOML"):
        answer(file=file)


def test_the_end_of_the_input_ends_the_questions(answer: Answer, tmp_path: Path) -> None:
    status, _, went_on = answer("roboflag")
    assert (status, went_on) == (130, [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        ([], 2, "COMMAND ..."),  # help, where nobody sits at a terminal
        (["edit", "none.toml"], 1, "none.toml: "),
        (["edit", "."], 1, ".: "),
    ],
)
def test_what_is_printed_where_there_is_nothing_to_ask(
    arguments: list[str],
    status: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    done = command_line(monkeypatch, capsys)(*arguments)
    assert done.status == status
    assert said in (done.err if arguments else done.out)


def test_a_page_whose_port_another_one_was_faster_to_take_gets_the_next(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    start, ports = EditServer.start, []

    def late(server: EditServer) -> None:
        ports.append(server._port)
        if len(ports) == 1:  # another page was begun between the look and this
            other.bind((server._host, server._port))
            other.listen()
        start(server)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(EditServer, "start", late)
    monkeypatch.setattr(EditServer, "wait", lambda *_: NextStep())
    monkeypatch.setattr(welcome, "_pressed", lambda: False)
    with socket.socket() as other:
        welcome._page(tmp_path / "runs", None, web=False)
    assert ports[1] > ports[0]


@pytest.mark.parametrize(
    ("display", "browser", "found"), [(":9", "cat %s &", True), (":9", "cat %s", False), ("", "cat %s &", False)]
)
def test_only_a_browser_that_runs_beside_the_terminal_is_opened(display: str, browser: str, found: bool) -> None:
    environment = {**os.environ, "DISPLAY": display, "WAYLAND_DISPLAY": "", "BROWSER": browser, "PATH": "/bin"}
    code = "from vrg.commands.welcome import has_browser; print(has_browser())"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(found)
