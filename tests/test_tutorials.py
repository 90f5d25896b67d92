"""docs/first-player.md, and the class of vrg-league's README.md: every command in them runs, and does what it says.

A comparison and a tournament play two games of each pairing here, as what they find is in the pages.
"""

import ast
import os
import re
import shlex
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.test_docs import ROOT, shell_lines
from vrg.templates import filled

PATIENCE = 300.0
"""The real time in s that a command may take."""
FIRST, TOURNAMENTS = ROOT / "docs" / "first-player.md", ROOT / "plugins" / "vrg-league" / "README.md"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: Path) -> list[tuple[int, str]]:
    """The blocks of Python of a page, by the numbers of their lines."""
    text = page.read_text(encoding="utf-8")
    return [(text[: found.start()].count("\n") + 1, found[1]) for found in BLOCK.finditer(text)]


def edited(source: str, block: str) -> str:
    """A file after a person has put a block into it: an import at the top, all else in place of what has its name."""
    [node] = ast.parse(textwrap.dedent(block)).body
    lines = source.splitlines(keepends=True)
    for old in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and isinstance(old, ast.ImportFrom):
            return "".join([*lines[: old.end_lineno], block, *lines[old.end_lineno :]])
        if _name(node) is not None and _name(old) == _name(node):
            assert old.end_lineno is not None
            return "".join([*lines[: old.lineno - 1], block, *lines[old.end_lineno :]])
    raise AssertionError(f"nothing in the file has the name of this block:\n{block}")


def _name(node: ast.AST) -> str | None:
    if isinstance(node, ast.Assign):
        return ast.unparse(node.targets[0])
    return node.name if isinstance(node, ast.FunctionDef) else None


def run(line: str, folder: Path) -> str:
    """Run a command of a page in a folder; a match of several processes is ended as soon as its page can be opened."""
    words = shlex.split(re.sub(r"--games \d+", "--games 2", line))
    if words[0] in ("compare", "tournament") and "--games" not in words:
        words += ["--games", "2"]
    serves = words[0] == "play" and "--in-process" not in words
    process = subprocess.Popen(
        [sys.executable, "-m", "vrg", *words],
        cwd=folder,
        env={**os.environ, "SDL_VIDEODRIVER": "dummy", "COLUMNS": "160"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    if serves:
        before = next((line for line in process.stdout if line.startswith("official ")), "")
        process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == (130 if serves else 0), f"{line}\n{out}"
    return before + out if serves else out


@pytest.mark.thorough
def test_a_first_player_is_written_step_by_step(tmp_path: Path) -> None:
    file = tmp_path / "ann.py"
    for _, text in sorted([*shell_lines(FIRST), *((number, block) for number, block in blocks(FIRST))]):
        if text in dict(blocks(FIRST)).values():
            file.write_text(edited(file.read_text(), text))
        elif "bob.py" not in text:
            out = run(text, tmp_path)
            assert "of 2 games" in out or not text.startswith("compare")
    assert file.read_text() == (ROOT / "examples" / "first_player.py").read_text()
    assert len(list((tmp_path / "runs").glob("compare-*"))) == 3


@pytest.mark.system
@pytest.mark.thorough
def test_a_class_plays_its_tournament_and_its_final(tmp_path: Path) -> None:
    names = {"ann": "Ann", "bob": "Bob", "Anna Maria": "AnnaMaria"}
    (tmp_path / "class").mkdir()
    for name, class_name in names.items():
        (tmp_path / "class" / f"{name}.py").write_text(filled("player.py.template", class_name=class_name))
    (tmp_path / "class" / "otto.py").write_text("def act(self, view)\n")
    page = TOURNAMENTS.read_text(encoding="utf-8")
    begins, ends = (page[: page.index(heading)].count("\n") for heading in ("## A class", "## A league"))
    out = "".join(run(line, tmp_path) for number, line in shell_lines(TOURNAMENTS) if begins < number <= ends)
    assert "left out: otto: " in out
    assert "Anna Maria" in (tmp_path / "cup" / "leaderboard.html").read_text()
    [link] = re.findall(r"^official +http://[^/]*/(#\S+)", out, re.MULTILINE)
    assert link in (tmp_path / "keys" / "sheet.html").read_text()
