"""A package that is installed while a test runs, and what else would be installed beside it."""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg import registry


@contextlib.contextmanager
def installed(folder: Path) -> Iterator[None]:
    """A folder is on the path of this process and of those that it starts, with the entry points in it.

    Args:
        folder: has packages, and a `NAME-VERSION.dist-info` with `METADATA` and `entry_points.txt`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.setenv("PYTHONPATH", os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]))
        registry.added.cache_clear()
        yield
    registry.added.cache_clear()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file is not None and Path(file).is_relative_to(folder):
            del sys.modules[name]
