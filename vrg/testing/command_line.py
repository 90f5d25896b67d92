"""The command line, run in the process of a test."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner, Result

from vrg.cli import main, make_app
from vrg.commands.added import Added, extended
from vrg.commands.groups import PlayOptions


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
    assert "pip install 'vrg[" in done.stderr
    assert "Traceback" not in done.stderr
