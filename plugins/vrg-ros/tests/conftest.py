"""What the tests of ROS 2 share."""

from collections.abc import Iterator

import pytest

from vrg.bus.session import Session, open_router, open_session
from vrg.launch.endpoints import free_endpoint
from vrg.testing.processes.arena import arena, start

__all__ = ["arena", "endpoint", "session", "start"]


@pytest.fixture
def endpoint() -> Iterator[str]:
    """That of a router."""
    at = free_endpoint()
    with open_router(at):
        yield at


@pytest.fixture
def session(endpoint: str) -> Iterator[Session]:
    """A session at that router."""
    with open_session(endpoint) as made:
        yield made
