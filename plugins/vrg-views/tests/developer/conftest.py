"""The bench of the details."""

import pytest
from heard import Bench


@pytest.fixture
def bench() -> Bench:
    """A match that somebody looks into."""
    return Bench()
