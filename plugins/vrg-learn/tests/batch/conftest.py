"""What the tests of batches share."""

from collections.abc import Iterator

import numpy as np
import pytest

from vrg_learn import compiled


@pytest.fixture
def in_python(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Batches play without numba, which takes longer to compile a game than Python to play a match of few players."""
    monkeypatch.setattr(compiled, "HAS_NUMBA", False)
    monkeypatch.setattr(compiled, "_done", {})
    with np.errstate(over="ignore"):  # the random numbers of a batch are products without their upper half
        yield


@pytest.fixture(params=["python", pytest.param("compiled", marks=pytest.mark.thorough)])
def small(request: pytest.FixtureRequest) -> bool:
    """True where a batch plays in Python, and should have few players and steps."""
    if request.param == "python":
        request.getfixturevalue("in_python")
    return bool(request.param == "python")
