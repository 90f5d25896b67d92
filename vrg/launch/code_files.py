"""Which files the code of a strategy consists of, as its own text tells."""

import ast
from collections.abc import Iterator
from pathlib import Path

from vrg.modules import module_in

DECLARED = "FILES"
"""The name of the list at the top of a module in which it names the files beside it that it reads."""


def imported(source: Path) -> list[Path]:
    """What a Python file needs of its own folder: modules and packages that it imports, and files that it names.

    What these import and name in turn is part of it. Files are named in a list at the top of a module, such as
    `FILES = ["weights.npz"]`.
    """
    found: list[Path] = []
    waiting = [source] if source.suffix == ".py" else []
    while waiting:
        file = waiting.pop()
        for beside in _needed(file, source.parent):
            if beside != source and beside not in found:
                found.append(beside)
                if beside.suffix == ".py" or beside.is_dir():
                    waiting += [beside] if beside.is_file() else list(beside.rglob("*.py"))
    return found


def _needed(file: Path, folder: Path) -> Iterator[Path]:
    """The modules in a folder that a file imports, and the files there that it names."""
    try:
        tree = ast.parse(file.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return  # the import tells it better
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = [node.module]
        for name in names:
            if (module := module_in(folder, name.split(".")[0])) is not None:
                yield module
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == DECLARED for t in node.targets):
            items = node.value.elts if isinstance(node.value, ast.List | ast.Tuple) else []
            values = [item.value for item in items if isinstance(item, ast.Constant) and isinstance(item.value, str)]
            named = (folder / value for value in values)
            yield from (path for path in named if path.is_file() and path.resolve().is_relative_to(folder.resolve()))
