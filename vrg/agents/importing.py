"""The import of the class that a match file names."""

import hashlib
import importlib
import importlib.util
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib.machinery import PathFinder
from importlib.util import cache_from_source
from pathlib import Path
from types import ModuleType
from typing import Final

from vrg.blame import failure_of
from vrg.errors import ConfigError
from vrg.modules import DECLARED
from vrg.registry import plugin_packages

_OWN: Final = "vrg_strategy_"
"""How the name begins under which the file of a strategy is imported."""
_STARTED: Final = time.time()
"""When this module was imported, s of wall time: the program may have imported what is older before."""
_lock: Final = threading.RLock()
_folders: Final[set[str]] = set()
"""The folders of strategies on the import path."""
_shadowed: Final[dict[Path, dict[str, ModuleType]]] = {}
"""By folder: its modules in whose place `sys.modules` has those of another folder."""
_known: Final[dict[Path, dict[Path, object]]] = {}
"""By folder: how its files were when they were read; see `_state`."""


def import_object(target: str, base: Path) -> object:
    """Import `module:Class`, or `file.py:Class` with the file relative to `base`.

    A module may also be a file in `base`. Installed modules are found first. The files are read as they are now: if one
    in the folder of the target, or one that a module there names in `FILES`, has changed, all there are imported again.

    Raises:
        ConfigError: there is no such object, or its import fails; the message has the reason.
    """
    module_name, _, name = target.rpartition(":")
    if not module_name or not name:
        raise ConfigError(f"expected `module:Class` or `file.py:Class`, got {target!r}")
    if module_name.endswith(".py") and not (base / module_name).is_file():
        raise ConfigError(f"{target}: no such file: {(base / module_name).resolve()}")
    if not module_name.endswith(".py") and ("/" in module_name or module_name.lower().endswith((".py", ".ipynb"))):
        how = "save the notebook as a Python file" if module_name.endswith(".ipynb") else "rename it"
        raise ConfigError(f"{target}: expected a file whose name ends in .py, got {Path(module_name).name!r}: {how}")
    try:
        path = (base / module_name).resolve()
        folder = path.parent if module_name.endswith(".py") else base.resolve()
        with _lock, _apart(folder), _as_it_is(folder):
            module = _import_file(path) if module_name.endswith(".py") else importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{target}: cannot be imported: {failure_of(error)}") from error
    if not hasattr(module, name):
        own = [n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__]
        classes = ", ".join(sorted(own)) or "none"
        raise ConfigError(f"{target}: expected the name of a class in {module_name} ({classes}), got {name!r}")
    found: object = getattr(module, name)
    return found


def _import_file(path: Path) -> ModuleType:
    """Import a file under a name of its own, so that a student's `queue.py` does not replace the library's module.

    The file can import the modules beside it.
    """
    name = f"{_OWN}{hashlib.sha256(str(path).encode()).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


@contextmanager
def _apart(folder: Path) -> Iterator[None]:
    """Import modules of a folder also where those of another folder have the same names. Installed ones come first.

    A module that a strategy imports later, as in `act`, may come from another folder.
    """
    others = [other for other in sys.path if other in _folders and other != str(folder)]
    aside = {
        known: module
        for known, module in sys.modules.copy().items()
        if _is_from(others, module) and _is_in(folder, known.partition(".")[0])
    }
    for known in aside:
        del sys.modules[known]
    sys.modules.update(_shadowed.pop(folder, {}))
    if str(folder) not in sys.path:
        _folders.add(str(folder))
        sys.path.append(str(folder))
        # A folder `carrier` is a package of that name for Python, before the one that `pip install -e carrier` has made
        # known, as its finder comes last.
        sys.meta_path[:] = sorted(sys.meta_path, key=lambda finder: finder is PathFinder)  # it is never empty meanwhile
    whole = sys.path[:]
    sys.path[:] = [other for other in whole if other not in others] + others
    try:
        yield
    finally:
        _shadowed[folder] = {known: sys.modules[known] for known in aside if known in sys.modules}
        sys.modules.update(aside)
        sys.path[:] = whole + [other for other in sys.path if other not in whole]


def _is_in(folder: Path, module: str) -> bool:
    return (folder / f"{module}.py").is_file() or (folder / module).is_dir()


def _is_from(folders: Iterable[str], module: ModuleType) -> bool:
    file = _file_of(module)
    return any(file.startswith(f"{folder}{os.sep}") for folder in folders)


def _file_of(module: ModuleType) -> str:
    """The file of a module; empty if it has none. A plain `getattr` would import a module that is imported lazily."""
    file = getattr(module, "__dict__", {}).get("__file__")
    return file if isinstance(file, str) else ""


@contextmanager
def _as_it_is(folder: Path) -> Iterator[None]:
    """Import from a folder as its files are now, and not as they were at an earlier import."""
    # For modules that the program itself has imported, only older files show which file that was.
    if (_known.get(folder) or _state(folder, _STARTED)) != _state(folder, float("inf")):
        for name, file in _modules(folder).items():
            sys.modules.pop(name, None)
            with suppress(OSError, NotImplementedError):
                Path(cache_from_source(str(file))).unlink()
    importlib.invalidate_caches()
    # Python tells what it keeps of a file from an edit of the same second by the length alone: so it keeps nothing.
    kept, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    began = time.time()
    try:
        yield
    finally:
        sys.dont_write_bytecode = kept
        _known[folder] = _state(folder, began)


def _modules(folder: Path) -> dict[str, Path]:
    """The files of the modules that come from a folder, by the names under which they were imported.

    A folder of a project may hold an environment: what lies deeper than its own modules and packages is not meant.
    """
    within, found = f"{folder}{os.sep}", dict[str, Path]()
    for name, module in sys.modules.copy().items():  # a copy, for what is collected meanwhile may import
        file = _file_of(module)
        if not file.startswith(within):  # hardly one of a program's thousands lies there, and this is asked each time
            continue
        top = name.partition(".")[0]
        first = file.removeprefix(within).partition(os.sep)[0]
        own = name.startswith(_OWN)
        if own or (first in (top, f"{top}.py") and top not in ("__main__", "vrg", *plugin_packages())):
            found[name] = Path(file)
    return found


def _state(folder: Path, began: float) -> dict[Path, object]:
    """What changes when a file is edited that is imported from a folder, or that a module there names in `FILES`.

    Args:
        began: when the files began to be read, s of wall time; of one that is newer nobody knows which one was read.
    """
    found: dict[Path, object] = {folder: {file.name for file in folder.glob("*.py")}}
    for name, file in _modules(folder).items():
        with suppress(OSError):
            found[file] = file.read_bytes() if file.stat().st_mtime <= began else None
        names = getattr(sys.modules.get(name), DECLARED, ())
        for data in names if isinstance(names, list | tuple) else ():
            with suppress(OSError, TypeError):
                stat = (file.parent / data).stat()  # it may be too large to be read each time
                found[file.parent / data] = stat.st_mtime_ns, stat.st_size, stat.st_ino
    return found
