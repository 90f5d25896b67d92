"""The package next to this file is installed while one of these tests runs."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.testing import installing
from vrg.testing.views.browser import browser
from vrg.testing.views.page import page_admission, port, server, visit

__all__ = ["browser", "page_admission", "port", "server", "visit"]


@pytest.fixture(autouse=True)
def installed() -> Iterator[None]:
    with installing.installed(Path(__file__).with_name("package")):
        yield
