"""The files that the code of a strategy consists of, by its own text."""

import ast
import functools
from collections.abc import Collection, Iterator
from pathlib import Path

from vrg.files import TEXT_LIMIT, read_bytes
from vrg.modules import DECLARED, module_in
from vrg.system import POSIX

if POSIX:
    import pwd

_NEVER = (".toml", ".key", ".crt", ".pem")
"""The endings of files that hold what is not for a strategy: match files and keys."""


def imported(source: Path, without: Collection[Path] = ()) -> list[Path]:
    """The files of its own folder that a Python file needs: modules and packages that it imports, and files that it
    names.

    What these import and name in turn is part of it. A module names files that are directly beside it, in a list at its
    top such as `FILES = ["weights.npz"]`. It cannot name match files, keys, hidden files and links, nor anything in a
    user's home folder itself: its text may be a stranger's.

    Args:
        without: files that are not its own, such as the strategies of others, and the packages that hold one.
    """
    found: list[Path] = []
    waiting = [source] if source.suffix == ".py" else []
    while waiting:
        file = waiting.pop()
        for beside in _needed(file, source.parent):
            held = any(other.is_relative_to(beside) for other in without)
            if beside != source and beside not in found and not held:
                found.append(beside)
                if beside.suffix == ".py" or beside.is_dir():
                    waiting += [beside] if beside.is_file() else list(beside.rglob("*.py"))
    return found


def readable_parts(path: Path) -> Iterator[Path]:
    """The parts of a file or a package that a strategy reads: of a package the modules, and nothing else."""
    if path.is_dir():
        yield from (module.resolve() for module in path.rglob("*.py"))
    else:
        yield path


def _needed(file: Path, folder: Path) -> Iterator[Path]:
    """The modules in a folder that a file imports, and the files beside it that it names."""
    try:
        tree = ast.parse(read_bytes(file, TEXT_LIMIT))
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
            yield from (file.parent / value for value in values if _may_be_named(file.parent, value))


def _may_be_named(folder: Path, name: str) -> bool:
    path = folder / name
    plain = Path(name).name == name and not name.startswith(".") and path.suffix not in _NEVER
    return plain and not path.is_symlink() and path.is_file() and folder.resolve() not in _homes()


@functools.cache
def _homes() -> set[Path]:
    found = [user.pw_dir for user in pwd.getpwall()] if POSIX else [Path.home()]
    return {Path(home).resolve() for home in found}
