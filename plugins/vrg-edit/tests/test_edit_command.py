"""`vrg edit`: the port of the page, and what is printed where there is nothing to change."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from vrg.testing.command_line import command_line
from vrg_edit import command
from vrg_edit.editor import NextStep
from vrg_edit.server import EditServer


@pytest.mark.parametrize(("match", "said"), [("none.toml", "none.toml: "), (".", ".: ")])
def test_what_is_printed_where_there_is_nothing_to_ask(
    match: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    done = command_line(monkeypatch, capsys)("edit", match)
    assert done.status == 1
    assert said in done.err


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
    with socket.socket() as other:
        command.begin(tmp_path / "runs")
    assert ports[1] > ports[0]


@pytest.mark.parametrize(
    ("display", "browser", "found"), [(":9", "cat %s &", True), (":9", "cat %s", False), ("", "cat %s &", False)]
)
def test_only_a_browser_that_runs_beside_the_terminal_is_opened(display: str, browser: str, found: bool) -> None:
    environment = {**os.environ, "DISPLAY": display, "WAYLAND_DISPLAY": "", "BROWSER": browser, "PATH": "/bin"}
    code = "from vrg_edit.command import has_browser; print(has_browser())"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(found)
