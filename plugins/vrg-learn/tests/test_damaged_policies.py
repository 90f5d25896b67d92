"""A damaged policy is refused in words."""

import io
from pathlib import Path

import numpy as np
import pytest

from vrg.testing.damage import check_refused
from vrg_learn.policy import load

POLICY = io.BytesIO()
np.savez(POLICY, header=np.array('{"format":1}'), w0=np.zeros((3, 2)))


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.thorough)])
def test_a_damaged_policy_is_refused_in_words(tmp_path: Path, count: int) -> None:
    check_refused(load, tmp_path / "mine.npz", POLICY.getvalue(), count)
