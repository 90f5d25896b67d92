"""What the tests of faults leave as it was."""

import logging
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def _logging_again() -> Iterator[None]:
    """`vrg fuzz` logs nothing, as its process plays matches alone; tests of other packages may follow in this one."""
    yield
    logging.disable(logging.NOTSET)
