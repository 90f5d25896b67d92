"""An adapter on a serial port belongs to one process."""

import fcntl
import os
import termios
import tty
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import can
import pytest

from vrg.errors import RobotError
from vrg.hal.can import opening
from vrg.hal.can.link import Link
from vrg.hal.can.settings import CanSettings


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A serial port; python-can's driver of it, which needs a package that is not here, only opens and closes it."""
    master, slave = os.openpty()
    tty.setraw(slave)
    name = os.ttyname(slave)
    monkeypatch.setattr(can, "Bus", lambda **_: SimpleNamespace(shutdown=lambda: None))
    yield name
    os.close(master)
    os.close(slave)


def link(port: str) -> Link:
    return Link(interface="slcan", channel=f"{port}@115200")


def test_a_second_process_is_told_and_touches_nothing(port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    other = os.open(port, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(other, fcntl.LOCK_EX)
    opened: list[Any] = []
    monkeypatch.setattr(can, "Bus", lambda **told: opened.append(told))
    try:
        with pytest.raises(RobotError, match="another program uses this port, and slcan cannot be shared by two"):
            opening.open_bus(link(port))
    finally:
        os.close(other)
    assert not opened, "the adapter was set up anew under the other one"


def test_it_is_free_again_once_it_is_shut_down(port: str) -> None:
    for _ in range(2):
        bus = opening.open_bus(link(port))
        probe = os.open(port, os.O_RDWR | os.O_NOCTTY) if os.geteuid() == 0 else -1
        if probe >= 0:
            with pytest.raises(OSError, match="temporarily unavailable"):
                fcntl.flock(probe, fcntl.LOCK_EX | fcntl.LOCK_NB)
            fcntl.ioctl(probe, termios.TIOCNXCL)
            os.close(probe)
        bus.shutdown()


def test_it_is_free_again_if_it_cannot_be_opened(port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**_: Any) -> None:
        raise OSError("no such adapter")

    monkeypatch.setattr(can, "Bus", fail)
    for _ in range(2):
        with pytest.raises(RobotError, match="no such adapter"):
            opening.open_bus(link(port))


def test_a_match_whose_robots_would_share_a_port_is_refused(tmp_path: Any) -> None:
    robots = {"sue": {"left": [0], "right": [1]}, "bob": {"left": [2], "right": [3]}}
    settings = CanSettings.model_validate({"interface": "slcan", "channel": "/dev/ttyACM0", "robots": robots})
    (problem,) = settings.problems(["sue", "bob"], tmp_path)
    assert "sue and bob are processes of their own, and cannot share slcan:/dev/ttyACM0" in problem
    assert settings.problems(["sue"], tmp_path) == []
