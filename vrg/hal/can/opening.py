"""Opens a bus by python-can, whatever adapter it is, and describes in words what keeps it from being opened."""

import errno
import inspect
import json
import logging
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

import can

from vrg.errors import RobotError
from vrg.hal.can.link import SERIAL_INTERFACES, Link
from vrg.hal.can.sending import ASSUMED_BIT_RATE, FRAME_BITS
from vrg.hal.can.troubles import errno_of
from vrg.registry import expected_one_of
from vrg.system import POSIX, UNWAITED_FLAGS, lock

if POSIX:
    import fcntl
    import termios

log = logging.getLogger(__name__)

RECEIVE_BUFFER = 1 << 20
"""The size of the receive buffer in bytes: it holds some 4000 frames, where the default holds 278."""
_PACKAGES = {
    "slcan": "pyserial", "serial": "pyserial", "robotell": "pyserial", "gs_usb": "gs-usb", "cantact": "cantact",
    "canalystii": "canalystii", "seeedstudio": "pyserial", "neovi": "python-ics", "udp_multicast": "msgpack",
}  # fmt: skip
"""The Python package that an interface of python-can needs."""
_ALWAYS_FD = frozenset({"udp_multicast", "virtual"})
"""Interfaces that carry CAN FD frames without an option."""
_SIOCGIFMTU, _IFREQ, _FD_MTU = 0x8921, struct.Struct("16si20x"), 72
"""The kernel's request for the size of an interface's frames, its structure, and the size of a CAN FD frame
(linux/can.h)."""
_IP_MULTICAST_ALL, _IPV6_MULTICAST_ALL = 49, 29
"""Options of sockets that Python has no names for (linux/in.h, linux/in6.h)."""
_EVERYWHERE = frozenset({"fd", "receive_own_messages"})
"""Options that python-can or VRG understand for every interface."""
_NEEDS = {"socketcand": "host and port", "pcan": "timing, for CAN FD"}
"""The options of an adapter that an interface cannot do without."""


def open_bus(link: Link) -> can.BusABC:
    """Open a bus by python-can.

    Raises:
        RobotError: there is no such interface or channel, or another program has it, with what to do.
    """
    claim = _claim_port(link) if link.interface in SERIAL_INTERFACES else None
    try:
        bus = can.Bus(interface=link.interface, channel=link.channel, ignore_config=True, **_arguments(link))
    except Exception as error:
        # Drivers of adapters raise what they like, a NameError where the maker's library is missing.
        if claim is not None:
            os.close(claim)
        raise RobotError(f"{link}: {_explain(link, error)}") from None
    for words in _unknown_options(bus, link):
        log.warning("%s: the adapter's options: %s", link, words)
    if claim is not None:
        _keep(bus, claim)
    if link.interface == "udp_multicast":
        _keep_to_group(bus)
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        # Root may exceed net.core.rmem_max; who may not gets as much as there is.
        try:
            raw.setsockopt(socket.SOL_SOCKET, getattr(socket, "SO_RCVBUFFORCE", 33), RECEIVE_BUFFER)
        except OSError:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return bus


def _unknown_options(bus: can.BusABC, link: Link) -> list[str]:
    """The adapter's options that its interface does not name, in words: most interfaces ignore them silently."""
    parameters = inspect.signature(type(bus).__init__).parameters.values()
    named = {own.name for own in parameters if own.kind is not own.VAR_KEYWORD} - {"self", "channel", "bitrate"}
    known = sorted(named | _EVERYWHERE)
    return [expected_one_of(known, name) for name in link.adapter if name not in known]


def takes_fd(link: Link) -> bool:
    """True if CAN FD frames may be sent on a bus."""
    if link.interface != "socketcan":
        return bool(link.adapter.get("fd", link.interface in _ALWAYS_FD))
    if not POSIX:
        return False
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        try:
            answer = fcntl.ioctl(any_socket, _SIOCGIFMTU, _IFREQ.pack(link.channel.encode(), 0))
        except OSError:
            return False
    mtu: int = _IFREQ.unpack(answer)[1]
    return mtu >= _FD_MTU


def _arguments(link: Link) -> dict[str, Any]:
    """The arguments of python-can's interface besides its name and channel."""
    arguments: dict[str, Any] = dict(link.adapter)
    if link.bitrate is not None:
        arguments["bitrate"] = link.bitrate
    if link.interface == "socketcan":
        # It costs nothing where no node sends CAN FD frames, and a scan of a bus sees those that do.
        arguments.setdefault("fd", True)
    if isinstance(timing := arguments.get("timing"), Mapping):
        arguments["timing"] = _timing(timing)
    return arguments


def _timing(table: Mapping[str, Any]) -> can.BitTiming | can.BitTimingFd:
    """The bit timing that a table describes, by its registers or by sample points."""
    kind: Any = can.BitTimingFd if any(name.startswith("nom_") for name in table) else can.BitTiming
    by_sample_point = any(name.endswith("sample_point") for name in table)
    timing: can.BitTiming | can.BitTimingFd = (kind.from_sample_point if by_sample_point else kind)(**table)
    return timing


def _claim_port(link: Link) -> int | None:
    """Lock a serial port before anything is written to it; the descriptor that holds the lock.

    Windows itself opens a serial port for one program alone.

    Raises:
        RobotError: another process has it.
    """
    if not POSIX:
        return None
    path = link.channel.partition("@")[0]
    try:
        port = os.open(path, os.O_RDWR | UNWAITED_FLAGS)
    except OSError as error:
        if error.errno == errno.EBUSY:
            raise RobotError(f"{link}: {_in_use(link)}") from None
        return None  # python-can says better why it cannot be opened
    try:
        free = lock(port)
    except OSError:
        free = False
    if not free:
        os.close(port)
        raise RobotError(f"{link}: {_in_use(link)}")
    return port


def _in_use(link: Link) -> str:
    return (
        f"another program uses this port, and {link.interface} cannot be shared by two processes: end the other one, "
        "or make a socketcan interface of the adapter, which can be shared, with slcand (see docs/hardware.md)"
    )


def _keep(bus: can.BusABC, port: int) -> None:
    """Hold the lock of a serial port until the bus is shut down, and let no other program open the port meanwhile."""
    if os.isatty(port):
        fcntl.ioctl(port, termios.TIOCEXCL)
    shutdown = bus.shutdown

    def release() -> None:
        try:
            shutdown()
        finally:
            if os.isatty(port):
                fcntl.ioctl(port, termios.TIOCNXCL)
            os.close(port)
            bus.shutdown = shutdown  # type: ignore[method-assign]

    bus.shutdown = release  # type: ignore[method-assign]


def _keep_to_group(bus: can.BusABC) -> None:
    """Let a bus hear its own group only: Linux gives a socket the packets of every group that any socket has joined."""
    if sys.platform != "linux":
        return
    with socket.socket(fileno=os.dup(bus.fileno())) as own:
        if own.family == socket.AF_INET6:
            own.setsockopt(socket.IPPROTO_IPV6, _IPV6_MULTICAST_ALL, 0)
        else:
            own.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)


def _explain(link: Link, error: Exception) -> str:
    number = errno_of(error)
    if link.interface == "socketcan" and number == errno.ENODEV:
        make = f"`ip link add {link.channel} type vcan && ip link set {link.channel} up` as root, or scripts/with-vcan"
        hint = f"; a virtual one comes by {make}" if link.channel.startswith("vcan") else "; `ip link` lists them"
        return f"no such CAN interface on this machine{hint}"
    if link.interface == "socketcan" and number == errno.EAFNOSUPPORT:
        others = "scripts/with-vcan makes a virtual bus; --in-process and udp_multicast need none (docs/hardware.md)"
        return f"this computer's kernel has no CAN: {others}"
    if link.interface == "socketcan" and sys.platform != "linux":
        return "socketcan is only on Linux: name the interface of your adapter, such as slcan, pcan or gs_usb"
    if number in (errno.EACCES, errno.EPERM):
        return "this user may not open it: add yourself to the group dialout, or write a udev rule (docs/hardware.md)"
    what = f"cannot be opened by python-can's interface {link.interface!r}: {error or type(error).__name__}"
    hints = []
    missing = isinstance(error, (NameError, AttributeError, ImportError, can.CanInterfaceNotImplementedError))
    if missing and (package := _PACKAGES.get(link.interface)):
        hints.append(f"it needs the package {package}: `pip install {package}`")
    elif missing:
        hints.append("the driver library of the adapter's maker is missing")
    if isinstance(error, (TypeError, ValueError)) and link.interface in _NEEDS:
        hints.append(f"it needs {_NEEDS[link.interface]}: write them in [backends.can.adapter], or as --adapter")
    return "; ".join([what, *hints])


_WITHOUT_WIRES = frozenset({"udp_multicast", "virtual"})
"""Interfaces that have no bit rate."""
_TIMEOUT = 5.0
"""s for the program `ip`, which only asks the kernel."""


def frame_time(link: Link) -> float:
    """s that a frame takes on a bus: by its bit rate, as it is written or as the kernel knows it; 0 if it has none."""
    rate = link.bitrate
    if rate is None and link.interface == "socketcan":
        found = _details(link.channel)
        rate = found.get("info_data", {}).get("bittiming", {}).get("bitrate")
        if rate is None and found.get("info_kind") == "vcan":
            return 0.0
    elif rate is None and link.interface in _WITHOUT_WIRES:
        return 0.0
    return FRAME_BITS / (rate or ASSUMED_BIT_RATE)


def restart(link: Link) -> str | None:
    """Bring the controller of a bus back if it is bus-off.

    Returns:
        why it still is, and what to do, in words; None if it is not, or if that is not known.
    """
    if link.interface != "socketcan":
        return None
    found = _details(link.channel).get("info_data", {})
    if found.get("state") != "BUS-OFF" or found.get("restart_ms"):
        return None
    command = ["ip", "link", "set", link.channel, "type", "can", "restart"]
    if _run(command) is not None:
        return None
    return (
        f"{link}: the controller is bus-off, and this user may not restart it: run `sudo {' '.join(command)}`, and set "
        "restart-ms, so that it comes back by itself (docs/hardware.md)"
    )


def _details(channel: str) -> dict[str, Any]:
    """The kernel's details of an interface: its kind, and for a controller its state and its bit timing."""
    output = _run(["ip", "-details", "-json", "link", "show", "dev", channel])
    try:
        data: dict[str, Any] = json.loads(output or "[]")[0]["linkinfo"]
    except (ValueError, LookupError, TypeError):
        return {}
    return data


def _run(command: list[str]) -> str | None:
    """The output of a program; None if it has failed."""
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
