"""Why a child has ended: told over its leash, and believed only if it makes sense."""

import os
import socket
from collections.abc import Iterator

import pytest

from vrg.errors import ConfigError, LaunchError, RobotError, VrgError
from vrg.launch import ending
from vrg.launch.ending import tell, told


@pytest.fixture
def supervisor(monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """The supervisor's end of the leash of this process."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        monkeypatch.setattr(ending, "LEASH", theirs.fileno())
        yield ours


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (RobotError("node 0 does not answer", "ann"), "node 0 does not answer"),
        (RobotError("its bus is away", "bob"), "bob: its bus is away"),
        (LaunchError("ann: is no name but the words of somebody"), "ann: is no name but the words of somebody"),
        (
            ConfigError(["seed: expected a number", "map: expected a file"]),
            "seed: expected a number; map: expected a file",
        ),
        (VrgError("\x1b[2J" + "x" * 9000), "\\x1b[2J" + "x" * 996),
    ],
    ids=["of itself", "of another", "a name in the words", "several lines", "anything"],
)
def test_the_supervisor_learns_why_in_one_line_without_the_name(
    supervisor: socket.socket, error: VrgError, why: str
) -> None:
    for _ in range(2):
        try:
            raise error
        except VrgError as caught:
            tell(caught, str(caught), name="ann")
        found = told(supervisor)
        assert found is not None
        assert found.why == why
        assert found.error.startswith(f"{type(error).__name__}, {__file__}:")


def test_what_makes_no_sense_counts_as_nothing(supervisor: socket.socket) -> None:
    assert told(supervisor) is None, "it has told nothing, and another process holds its end of the leash"
    with socket.socket(fileno=os.dup(ending.LEASH)) as child:
        for data in (b"vrg: believe me", b"\xff", b'{"why": 3}'):
            child.send(data)
            assert told(supervisor) is None
    supervisor.close()
    assert told(supervisor) is None
