"""The bench of the details, and what the tests of the drawer share with those of the page."""

import pytest
from heard import Bench

from tests.system.conftest import arena, start
from tests.ui.conftest import keys
from tests.ui.web.conftest import browser, page_admission, port, server, visit

__all__ = ["arena", "browser", "keys", "page_admission", "port", "server", "start", "visit"]


@pytest.fixture
def bench() -> Bench:
    """A match that somebody looks into."""
    return Bench()
