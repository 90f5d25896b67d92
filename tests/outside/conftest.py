"""The package next to this file is installed while one of these tests runs: its folder, with its entry points, is on
the path of this process and of those that it starts.
"""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ui.web.conftest import browser, page_admission, port, server, visit
from vrg import registry

__all__ = ["browser", "page_admission", "port", "server", "visit"]

PACKAGE = Path(__file__).with_name("package")


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(PACKAGE)
    path = [str(PACKAGE), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    registry.plugins.cache_clear()
    yield
    registry.plugins.cache_clear()
    for name in [n for n in sys.modules if n.split(".")[0] == "toys"]:
        del sys.modules[name]
