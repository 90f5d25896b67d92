"""A damaged policy is refused in words."""

import io
from pathlib import Path

import numpy as np
import pytest

from vrg.errors import VrgError
from vrg.testing.damage import mutants
from vrg_learn.policy import load

POLICY = io.BytesIO()
np.savez(POLICY, header=np.array('{"format":1}'), w0=np.zeros((3, 2)))


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.thorough)])
def test_a_damaged_policy_is_refused_in_words(tmp_path: Path, count: int) -> None:
    file = tmp_path / "mine.npz"
    for what, content in mutants(POLICY.getvalue(), count):
        file.write_bytes(content)
        try:
            load(file)
        except (VrgError, OSError):
            continue
        except Exception as error:
            raise AssertionError(f"{what}: {content[:300]!r}") from error
