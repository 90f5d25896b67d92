"""The command line, run in the process of a test."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner, Result

from vrg.cli import main, make_app
from vrg.commands import show
from vrg.commands.added import Added, extended
from vrg.commands.groups import PlayOptions
from vrg.commands.matches import Attached
from vrg.config.loading import load_match, match_path
from vrg.errors import DuplicateNodeError
from vrg.kinds import Kind

RUN = Path("runs/here")
"""The run folder of the match that `showing` shows."""
Opened = list[tuple[Kind, str, Path | None]]
"""Windows: the kind and the name of each, and the run folder that it shows."""


class Done(NamedTuple):
    """A command that has ended: its exit status, and what it has printed."""

    status: int
    out: str
    err: str


Vrg = Callable[..., Done]


def command_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrg:
    """What runs `vrg` with arguments."""
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> Done:
        monkeypatch.setattr(sys, "argv", ["vrg", *arguments])
        code: object = 0
        try:
            main()
        except SystemExit as end:
            code = end.code
        return Done(code if isinstance(code, int) else int(code is not None), *capsys.readouterr())

    return run


def showing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrg:
    """What runs `vrg` with arguments, as if a match of roboflag ran and a display were there."""
    setup = load_match(match_path("roboflag"))
    monkeypatch.setattr(show, "need_display", lambda: None)
    monkeypatch.setattr(show, "attached", lambda on: Attached(setup.name, "tcp/127.0.0.1:1", on.keys, setup, RUN))
    return command_line(monkeypatch, capsys)


def windows(monkeypatch: pytest.MonkeyPatch, *, refused: bool = False) -> Opened:
    """The windows that commands open from now on, of which none is really opened.

    Args:
        refused: whether each is refused, as the match has one of its kind and name already.
    """
    found: Opened = []

    def serve(_self: Attached, kind: Kind, name: str = "", *, run: Path | None) -> None:
        if refused:
            raise DuplicateNodeError("match 'roboflag' already has such a node")
        found.append((kind, name, run))

    monkeypatch.setattr(Attached, "serve", serve)
    return found


def play_options(*typed: str) -> PlayOptions:
    """The options of `vrg play` where these were typed of the ones that packages add."""
    made = extended(PlayOptions, set())
    added = {one.name: each for one in fields(made) for each in one.metadata.values() if isinstance(each, Added)}
    chosen: dict[str, Any] = {name: each.option.name in typed for name, each in added.items()}
    return made(**chosen)


def invoke(*arguments: str) -> Result:
    """What a command has come to, its exception included."""
    return CliRunner().invoke(make_app(), arguments, env={"COLUMNS": "250"})


def tells_of_missing(package: str, arguments: list[str]) -> None:
    """A command without a package that it needs tells what installs it."""
    code = f"import sys; sys.modules[{package!r}] = None; sys.argv = {['vrg', *arguments]!r}\n"
    code += "from vrg.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert f"the package {package} is not installed" in done.stderr
    assert "pip install 'virtual-robotic-games[" in done.stderr
    assert "Traceback" not in done.stderr
