"""Finding the class that a match file names."""

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from vrg.errors import ConfigError


def import_object(target: str, base: Path) -> object:
    """`module:Class`, or `file.py:Class` with the file relative to `base`.

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
            module = importlib.import_module(module_name)
        found: object = getattr(module, name)
    except Exception as error:
        raise ConfigError([f"{target}: cannot be imported: {type(error).__name__}: {error}"]) from error
    return found


def _import_file(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module
