"""What all tests share."""

import gc
import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

from vrg.hal.sim.engines import BULLET, installed
from vrg.testing.can.vcan import require_vcan
from vrg.testing.processes.warm import WarmServers

# No test asserts a time: on a busy machine any example may take long. Continuous integration judges a change by the
# same examples as the one before; on a desk new ones are tried. `make test-all` takes the second profile.
UNTIMED = settings(deadline=None, derandomize="CI" in os.environ)
settings.register_profile("brief", UNTIMED, max_examples=25)
settings.register_profile("thorough", UNTIMED, max_examples=500)
settings.load_profile("brief")


def pytest_configure() -> None:
    """Let processes that the tests start be interrupted: a shell starts what runs in the background otherwise."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Keep the garbage collector from what lives as long as the tests: it takes an eighth of their time otherwise."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what is parametrised with an engine whose package this Python has no wheels of."""
    for item in items:
        found = getattr(item, "callspec", None)
        values = [] if found is None else [value for value in found.params.values() if isinstance(value, str)]
        if BULLET in values and not installed(BULLET):
            item.add_marker(pytest.mark.skip(reason="PyBullet is not installed"))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests marked `vcan` run only where there is one; asked before their fixtures open it."""
    if item.get_closest_marker("vcan") is not None:
        require_vcan()


@pytest.fixture(scope="session", autouse=True)
def warm_servers() -> Iterator[WarmServers]:
    """Strategies are tried by forks of one server that all tests share."""
    servers = WarmServers()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vrg.playing.trial.fork_server", servers.fork_server)
        yield servers
    servers.end()
