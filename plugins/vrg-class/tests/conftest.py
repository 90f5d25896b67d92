"""What several tests of a class need."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from served_class import Class, serve

from vrg.testing.views.browser import browser
from vrg_class.command import opened

__all__ = ["browser"]


@pytest.fixture
def of_class(tmp_path: Path) -> Iterator[Class]:
    """A class of Sharks and Minnows."""
    found = serve(opened(tmp_path / "class", "sharks-and-minnows", None, None, None))
    yield found
    found.site.stop()
