"""The assignment of rows to columns, compared with that of SciPy, also where sums are equal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.navigation.assignment import assign

optimize = pytest.importorskip("scipy.optimize", reason="SciPy comes with vrg-locate")
SIZES = st.integers(1, 9)


@st.composite
def tables(draw: st.DrawFn) -> list[list[float]]:
    """Costs of which many are equal, or none."""
    rows, columns = draw(SIZES), draw(SIZES)
    cost = draw(st.sampled_from([st.integers(0, 3), st.integers(-50, 50), st.floats(0.0, 1e6)]))
    return [[float(draw(cost)) for _ in range(columns)] for _ in range(rows)]


@given(tables())
def test_it_is_that_of_scipy_in_ties_too(costs: list[list[float]]) -> None:
    rows, columns = optimize.linear_sum_assignment(np.array(costs))
    assert assign(costs) == [(int(row), int(column)) for row, column in zip(rows, columns, strict=True)]


def test_nothing_is_assigned_where_there_is_nothing() -> None:
    assert assign([]) == []
    assert assign([[], []]) == []
    assert assign([[3.0]]) == [(0, 0)]
    assert assign([[1.0] * 4] * 4) == [(0, 0), (1, 1), (2, 2), (3, 3)]
