"""A port for each test's server."""

import socket

import pytest


@pytest.fixture
def port() -> int:
    """A port that the system has chosen: tests that run at the same time get different ones."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        found: int = probe.getsockname()[1]
        return found
