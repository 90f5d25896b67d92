"""What tests need of the machine that they run on."""

import os
from typing import NoReturn

import pytest

CI = bool(os.environ.get("CI"))


def missing(what: str) -> NoReturn:
    """Skip for want of something on this machine; where `CI` is set, which has everything, fail."""
    if CI:
        pytest.fail(f"CI must have it: {what}")
    pytest.skip(what)
