"""What all tests share."""

import pytest

from tests.vcan import require_vcan


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests marked `vcan` run only where there is one; asked before their fixtures open it."""
    if item.get_closest_marker("vcan") is not None:
        require_vcan()
