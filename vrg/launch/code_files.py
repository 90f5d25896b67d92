"""Which files the code of a strategy consists of, as its own text tells."""

import ast
from collections.abc import Iterator
from pathlib import Path

from vrg.modules import module_in


def imported(source: Path) -> list[Path]:
    """The modules and packages in a Python file's own folder that it imports, and those that these import."""
    found: list[Path] = []
    waiting = [source] if source.suffix == ".py" else []
    while waiting:
        for name in _names(waiting.pop()):
            beside = module_in(source.parent, name)
            if beside is not None and beside != source and beside not in found:
                found.append(beside)
                waiting += [beside] if beside.is_file() else list(beside.rglob("*.py"))
    return found


def _names(file: Path) -> Iterator[str]:
    """The first parts of the names of all modules that a file imports."""
    try:
        tree = ast.parse(file.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return  # who runs it is told better
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]
