"""Modules: the file of one beside a match file, the classes in its text, and the import of one that prints."""

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from vrg.registry import did_you_mean

if TYPE_CHECKING:
    import ast

MOST_SOURCE: Final = 1_000_000
"""The number of bytes that a Python file may have whose text is looked at."""
DECLARED: Final = "FILES"
"""The name of the list at the top of a module in which it names the files beside it that it reads."""
STANDARD_ERROR: Final = 2
"""The file descriptor of the standard error stream."""


def module_in(folder: Path, name: str) -> Path | None:
    """The file or the folder of a module in a folder; None for VRG itself, which is no part of a match."""
    if name == "vrg":
        return None
    if (folder / f"{name}.py").is_file():
        return folder / f"{name}.py"
    package = folder / name
    return package if package.is_dir() and any(package.glob("*.py")) else None


class SourceClass(NamedTuple):
    """A class as the text of its file shows it.

    Args:
        methods: the names of its own methods.
        acts: whether it has the method `act` of a strategy; None if that depends on a class of another file.
    """

    methods: list[str]
    acts: bool | None


def parsed(file: Path) -> "ast.Module":
    """The syntax tree of a Python file. Nothing is imported.

    Raises:
        OSError: there is no such file.
        ValueError: it is longer than MOST_SOURCE, or no text.
        SyntaxError, RecursionError, MemoryError: it is no Python, or nests too deeply for Python's own parser.
    """
    import ast  # noqa: PLC0415 - no process of a match needs it

    if not file.is_file():  # to open a named pipe waits for ever
        raise FileNotFoundError(f"expected a file, found none at {file}")
    with file.open("rb") as stream:
        source = stream.read(MOST_SOURCE + 1)
    if len(source) > MOST_SOURCE:
        raise ValueError(f"expected at most {MOST_SOURCE} bytes of Python")
    return ast.parse(source, file.name)


def classes_in(file: Path) -> dict[str, SourceClass]:
    """The classes in a Python file, by name. A file that cannot be read or parsed has none."""
    try:
        return classes_of(parsed(file))
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return {}


def classes_of(module: "ast.Module") -> dict[str, SourceClass]:
    """The classes in a syntax tree, by name."""
    import ast  # noqa: PLC0415 - see `parsed`

    found: dict[str, SourceClass] = {}
    for node in module.body:
        if isinstance(node, ast.ClassDef):
            methods = [item.name for item in node.body if isinstance(item, ast.FunctionDef)]
            named = [ast.unparse(t) for item in node.body if isinstance(item, ast.Assign) for t in item.targets]
            own = "act" in (*methods, *named)
            bases = [ast.unparse(base).rpartition(".")[2] for base in node.bases]
            known = {False if base == "Strategy" else found[base].acts if base in found else None for base in bases}
            acts = True if own or True in known else None if None in known or not bases else False
            found[node.name] = SourceClass(methods, acts)
    return found


def no_method(target: str, method: str, methods: Iterable[str]) -> str:
    """The message about a class that lacks a method that it needs."""
    return f"{target}: expected a method `{method}` in this class, found none{did_you_mean(method, methods)}"


@contextlib.contextmanager
def silent_errors() -> Iterator[None]:
    """Drop what is written to the standard error stream meanwhile, also by libraries in C: PyBullet does at its import.

    It works on the file descriptor of the whole process, so use it around an import only. An exception is not lost.
    """
    try:
        kept = os.dup(STANDARD_ERROR)
    except OSError:  # it is closed, so nothing is printed
        yield
        return
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), STANDARD_ERROR)
        yield
    finally:
        os.dup2(kept, STANDARD_ERROR)
        os.close(kept)
