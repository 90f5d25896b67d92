"""What all tests share."""

import pytest
from hypothesis import settings

from tests.vcan import require_vcan

# No test asserts a time: on a busy machine any example may take long.
settings.register_profile("untimed", settings.default, deadline=None)
settings.load_profile("untimed")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests marked `vcan` run only where there is one; asked before their fixtures open it."""
    if item.get_closest_marker("vcan") is not None:
        require_vcan()
