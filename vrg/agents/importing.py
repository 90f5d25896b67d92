"""The import of the class that a match file names."""

import hashlib
import importlib
import importlib.util
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from vrg.blame import failure_of
from vrg.errors import ConfigError


def import_object(target: str, base: Path) -> object:
    """Import `module:Class`, or `file.py:Class` with the file relative to `base`.

    A module may also be a file in `base`. Installed modules are found first.

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
        if module_name.endswith(".py"):
            module = _import_file((base / module_name).resolve())
        else:
            _append_path(base.resolve())
            module = importlib.import_module(module_name)
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

    The file can import the modules beside it. At its top it gets its own also where those beside another strategy have
    the same names. Installed modules are found first.
    """
    name = f"vrg_strategy_{hashlib.sha256(str(path).encode()).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no Python file")
    others = [folder for folder in sys.path if folder in _folders and folder != str(path.parent)]
    # Modules of these folders, which this file would get in place of those beside it.
    aside = {
        known: module
        for known, module in sys.modules.items()
        if _is_in(path.parent, known.partition(".")[0]) and _is_from(others, module)
    }
    for known in aside:
        del sys.modules[known]
    _append_path(path.parent)
    whole = sys.path[:]
    sys.path[:] = [folder for folder in whole if folder not in others] + others
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.modules.update(aside)
        sys.path[:] = whole + [folder for folder in sys.path if folder not in whole]
    return module


def _is_in(folder: Path, module: str) -> bool:
    return (folder / f"{module}.py").is_file() or (folder / module).is_dir()


def _is_from(folders: Iterable[str], module: ModuleType) -> bool:
    file = getattr(module, "__file__", None)
    return file is not None and any(Path(file).is_relative_to(folder) for folder in folders)


_folders: set[str] = set()
"""The folders of strategies on the import path."""


def _append_path(folder: Path) -> None:
    """Append a folder to the import path. It comes last, so that a student's `random.py` hides no installed module."""
    if str(folder) not in sys.path:
        _folders.add(str(folder))
        sys.path.append(str(folder))
