"""How a bus is reached: what people type, what python-can is told, and that a serial port belongs to one process."""

import errno
import fcntl
import os
import termios
import tty
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import RobotError
from vrg.hal.can import opening
from vrg.hal.can.frame import fd_size
from vrg.hal.can.link import Link, read_adapter
from vrg.hal.can.opening import _arguments, _explain, open_bus
from vrg.hal.can.settings import CanSettings
from vrg.hal.models.pioneer import P2AT
from vrg.testing.can.vcan import UDP, require_loopback

names = st.from_regex(r"[a-z_]{1,8}", fullmatch=True)
values = st.one_of(st.booleans(), st.integers(-(2**40), 2**40), st.from_regex(r"[a-zA-Z/:]{1,10}", fullmatch=True))


@given(st.dictionaries(names, st.one_of(values, st.dictionaries(names, st.integers(0, 2**31), min_size=1))))
def test_a_companion_is_told_the_same_bus(adapter: dict[str, Any]) -> None:
    words = Link(adapter=adapter).arguments[4:]
    assert words[::2] == ["--adapter"] * (len(words) // 2)
    again = read_adapter(words[1::2])
    # The texts `true` and `false` are what a truth is written as.
    assert {k: v for k, v in again.items() if v not in (True, False)} == {
        k: v for k, v in adapter.items() if v not in (True, False, "true", "false")
    }


def test_what_is_typed_has_the_kind_that_it_looks_like() -> None:
    typed = ["fd=true", "port=29536", "host=10.0.0.5", "timing.brp=6", "timing.f_clock=8000000", "name=inf,x", "a=b=c"]
    assert read_adapter(typed) == {
        "fd": True, "port": 29536, "host": "10.0.0.5", "timing": {"brp": 6, "f_clock": 8000000}, "name": "inf,x",
        "a": "b=c",
    }  # fmt: skip


@pytest.mark.parametrize("text", ["fd", "=1", ""])
def test_what_is_no_option_is_said(text: str) -> None:
    with pytest.raises(ValueError, match="expected NAME=VALUE"):
        read_adapter([text])


def test_two_servers_of_one_channel_are_two_buses() -> None:
    one, other = (Link(interface="socketcand", adapter={"host": f"10.0.0.{n}", "port": 29536}) for n in (1, 2))
    assert str(one) == "socketcand:can0 (host 10.0.0.1, port 29536)"
    assert str(one) != str(other)


@pytest.mark.parametrize(
    ("timing", "kind"),
    [
        ({"f_clock": 8_000_000, "brp": 1, "tseg1": 13, "tseg2": 2, "sjw": 1}, can.BitTiming),
        ({"f_clock": 8_000_000, "bitrate": 250_000, "sample_point": 87.5}, can.BitTiming),
        (
            {
                "f_clock": 80_000_000, "nom_bitrate": 1_000_000, "nom_sample_point": 80.0, "data_bitrate": 5_000_000,
                "data_sample_point": 75.0,
            },
            can.BitTimingFd,
        ),
    ],
)  # fmt: skip
def test_a_bit_timing_is_a_table(timing: dict[str, float], kind: type) -> None:
    told = _arguments(Link(interface="pcan", adapter={"timing": timing}))["timing"]
    assert isinstance(told, kind)


def test_a_socket_always_hears_can_fd() -> None:
    assert _arguments(Link()) == {"fd": True}
    assert _arguments(Link(adapter={"fd": False}, bitrate=250_000)) == {"fd": False, "bitrate": 250_000}
    assert _arguments(Link(interface="slcan")) == {}


@pytest.mark.parametrize(
    ("link", "words"),
    [
        (Link(interface="kvaser", channel="0"), "kvaser"),
        (Link(interface="socketcand"), "it needs host and port: write them in [backends.can.adapter]"),
        (Link(interface="gs_usb", channel="0"), "pip install gs-usb"),
        (Link(interface="pcan", adapter={"nonsense": 3}), "pcan"),
        (Link(interface="nonsense"), "nonsense"),
        (Link(interface="slcan", channel="/dev/nonsense"), "slcan:/dev/nonsense"),
    ],
)
def test_an_adapter_that_cannot_be_opened_is_said_in_words(link: Link, words: str) -> None:
    with pytest.raises(RobotError) as error:
        open_bus(link)
    assert words in str(error.value)


def test_a_kernel_without_can_is_said_with_what_to_do() -> None:
    said = _explain(Link(), OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol"))
    assert "this computer's kernel has no CAN: scripts/with-vcan makes a virtual bus" in said


def test_an_interface_that_lacks_its_package_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.interfaces.udp_multicast.utils.msgpack", None)
    with pytest.raises(RobotError, match="it needs the package msgpack: `pip install msgpack`"):
        open_bus(UDP)


@pytest.mark.system
def test_a_multicast_group_is_a_bus_of_its_own() -> None:
    require_loopback()
    ours, others = UDP, replace(UDP, channel="239.74.163.8")
    with open_bus(ours) as sender, open_bus(ours) as listener, open_bus(others) as stranger:
        sender.send(can.Message(arbitration_id=0x123))
        heard = listener.recv(20.0)
        assert heard is not None
        assert heard.arbitration_id == 0x123
        assert stranger.recv(0.2) is None


def test_a_frame_has_room_for_64_bytes() -> None:
    assert [fd_size(size) for size in (0, 8, 9, 13, 21, 33, 64)] == [0, 8, 12, 16, 24, 48, 64]
    with pytest.raises(ValueError, match="at most 64"):
        fd_size(65)


def test_an_option_that_an_adapter_does_not_have_is_told(caplog: pytest.LogCaptureFixture) -> None:
    adapter = {"rx_queue_sise": 10, "fd": True}
    open_bus(Link(interface="virtual", channel="options", adapter=adapter)).shutdown()
    assert "got 'rx_queue_sise', did you mean 'rx_queue_size'?" in caplog.text
    assert "'fd'" not in caplog.text


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
    (problem,) = settings.problems({"sue": P2AT, "bob": P2AT}, tmp_path)
    assert "sue and bob are processes of their own, and cannot share slcan:/dev/ttyACM0" in problem
    assert settings.problems({"sue": P2AT}, tmp_path) == []


def test_real_drives_on_a_bus_within_one_process_are_refused(tmp_path: Any) -> None:
    table = {"interface": "virtual", "robots": {"sue": {"left": [0], "right": [1]}}}
    (problem,) = CanSettings.model_validate(table).problems({"sue": P2AT}, tmp_path)
    assert "the interface virtual is within one process" in problem
    assert CanSettings.model_validate({**table, "emulate": True}).problems({"sue": P2AT}, tmp_path) == []
