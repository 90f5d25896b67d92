"""The bench of the developers' view."""

from collections.abc import Iterator

import pytest

from tests.ui.developer.making import Bench


@pytest.fixture
def bench() -> Iterator[Bench]:
    """The developers' view of a match."""
    made = Bench()
    yield made
    made.node.stop()
