"""What all tests share."""

import gc
import os
import signal

import pytest
from hypothesis import settings

from tests.vcan import require_vcan

# No test asserts a time: on a busy machine any example may take long. Continuous integration judges a change by the
# same examples as the one before; on a desk new ones are tried.
settings.register_profile("untimed", settings.default, deadline=None, derandomize="CI" in os.environ)
settings.load_profile("untimed")


def pytest_configure() -> None:
    """Let processes that the tests start be interrupted: a shell starts what runs in the background otherwise."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Keep the garbage collector from what lives as long as the tests: it takes an eighth of their time otherwise."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests marked `vcan` run only where there is one; asked before their fixtures open it."""
    if item.get_closest_marker("vcan") is not None:
        require_vcan()
