"""README and docs/: every command that they show exists as it is written, and so does every file and heading."""

import importlib
import inspect
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

from vrg.cli import make_app
from vrg.plugins import where_from

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "benchmarks" / "README.md",
    *sorted(ROOT.glob("docs/*.md")),
    *sorted(ROOT.glob("plugins/*/README.md")),
]
VRG = typer.main.get_command(make_app())
BEFORE_VRG = re.compile(r"^.*?\bvrg (?=[a-z-])")
"""What may stand before the arguments in a line of a shell: a prompt, a path, `scripts/with-vcan`."""


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def shell_lines(page: Path) -> Iterator[tuple[int, str]]:
    """The lines of code blocks in which `vrg` is called, one command each, by their numbers."""
    fenced = ""
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = "" if fenced else line.strip("` ") or "text"
        elif fenced in ("", "sh", "text", "console") and (fenced or line.startswith("    ")):
            for part in re.split(r"&&?|;", line.partition(" #")[0]):
                if re.match(
                    r"\s*(\$ |scripts/with-vcan |timeout \d+ )*(\.venv/bin/|bash -c ')?(\.venv/bin/)?vrg [a-z-]", part
                ):
                    yield number, BEFORE_VRG.sub("", part).strip().strip("'")


def spans(page: Path) -> Iterator[tuple[int, str]]:
    """What is in backticks within sentences, by the number of its line."""
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if not line.startswith("    "):
            yield from ((number, span) for span in re.findall(r"`([^`]+)`", line))


class NoCommandError(Exception):
    """What is written is no command line of `vrg`."""


def parse(arguments: list[str], *, whole: bool) -> None:
    """Let the command line take the arguments, without doing anything.

    Args:
        whole: False if arguments may be missing, because a sentence names a command only.

    Raises:
        NoCommandError: there is no such command or option, or an argument is wrong.
    """
    if any(where_from(arguments[:count]) for count in (1, 2)):
        return  # of a plug-in that is not installed here
    command, name, rest = VRG, "vrg", arguments
    context = typer.Context(VRG, info_name="vrg")
    while (group := isinstance(command, TyperGroup)) and rest and not rest[0].startswith("-"):
        name, *rest = rest
        command = command.get_command(context, name)
        if command is None:
            raise NoCommandError(f"no command {name}")
    if "--help" in rest:
        return
    if group:
        if whole:
            raise NoCommandError(f"{name}: no command is named")
        return
    try:
        command.make_context(name, rest)
    except Exception as error:  # typer has a copy of click of its own, whose errors have no public name
        if whole or type(error).__name__ != "MissingParameter":
            raise NoCommandError(str(error)) from error


CASES = [(f"{_name(page)}:{number}", line, True) for page in PAGES for number, line in shell_lines(page)] + [
    (f"{_name(page)}:{number}", span.removeprefix("vrg "), False)
    for page in PAGES
    for number, span in spans(page)
    if re.match(r"vrg [a-z-]", span)
]


def test_commands_are_found() -> None:
    assert len([case for case in CASES if case[2]]) > 40
    assert len(CASES) > 90


def test_a_command_is_one_as_it_is_written() -> None:
    wrong = []
    for place, line, whole in CASES:
        try:
            parse([word.strip("[]") for word in shlex.split(line) if word != "..."], whole=whole)
        except (NoCommandError, ValueError) as error:  # the latter from a quote without its second half
            wrong.append(f"{place}: {line}: {error}")
    assert not wrong, "\n".join(wrong)


def test_what_is_no_command_is_found_out() -> None:
    for line in ("plai match.toml", "play match.toml --sped 3", "official", "official place player2 --at 17"):
        with pytest.raises(NoCommandError):
            parse(shlex.split(line), whole=True)


def test_the_site_is_built_and_every_link_leads_somewhere() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "docs"], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"


INTERFACE = re.findall(r"^<!-- (\S+)\.(\w+) -->$", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
"""The classes of the interface of a strategy: their modules and names."""


@pytest.mark.parametrize(("module", "name"), INTERFACE, ids=[name for _, name in INTERFACE])
def test_everything_that_a_strategy_sees_is_documented(module: str, name: str) -> None:
    kind = getattr(importlib.import_module(module), name)
    texts = " ".join(inspect.getdoc(owner) or "" for owner in kind.__mro__)
    fields = getattr(kind, "__struct_fields__", None) or getattr(kind, "__dataclass_fields__", ())
    assert [field for field in fields if not re.search(rf"\b{field}\b[^.\n]*:", texts)] == []
    members = [member for member in vars(kind).values() if isinstance(member, property) or inspect.isfunction(member)]
    named = [getattr(member, "fget", None) or member for member in members]
    assert [one.__name__ for one in named if not one.__name__.startswith("_") and not inspect.getdoc(one)] == []


def test_every_file_of_the_repository_that_is_named_is_there() -> None:
    named = re.compile(r"(vrg|docs|deploy|tests|scripts|examples|benchmarks|plugins)/[\w./-]+")
    every = [(page, span) for page in PAGES for _, span in spans(page) if named.fullmatch(span)]
    wrong = [f"{_name(page)}: {span}" for page, span in every if not (ROOT / span).exists()]
    assert not wrong, "\n".join(wrong)
