"""Finding the class that a match file names."""

import hashlib
import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from vrg.errors import ConfigError


def import_object(target: str, base: Path) -> object:
    """`module:Class`, or `file.py:Class` with the file relative to `base`.

    What lies in `base` can be imported as a module, too, after everything that is installed.

    Raises:
        ConfigError: there is no such thing, or importing it fails; says how.
    """
    module_name, _, name = target.rpartition(":")
    if not module_name or not name:
        raise ConfigError([f"expected `module:Class` or `file.py:Class`, got {target!r}"])
    try:
        if module_name.endswith(".py"):
            module = _import_file((base / module_name).resolve())
        else:
            _append_path(base.resolve())
            module = importlib.import_module(module_name)
        found: object = getattr(module, name)
    except Exception as error:
        raise ConfigError([f"{target}: cannot be imported: {type(error).__name__}: {error}"]) from error
    return found


def _import_file(path: Path) -> ModuleType:
    """Import a file under a name of its own, so that `queue.py` of a student's is not taken for the library's.

    What lies beside it can be imported, after everything that is installed.
    """
    name = f"vrg_strategy_{hashlib.sha256(str(path).encode()).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no Python file")
    _append_path(path.parent)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _append_path(folder: Path) -> None:
    """Let what lies in a folder be imported. Last, so that a student's `random.py` is not taken for the library's."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
