"""The CAN interface that tests marked `vcan` use, and the bus of those that need no CAN in the kernel."""

import socket
import struct
import sys

from vrg.hal.can.link import Link
from vrg.testing.requirements import missing

INTERFACE = "vcan0"
VCAN = Link(channel=INTERFACE)
UDP = Link(interface="udp_multicast", channel="239.74.163.7")
"""A bus on which each frame is a datagram to a multicast group."""

_SIOCGIFFLAGS = 0x8913
_IFF_UP = 0x1
_IFREQ = struct.Struct("16sH22x")


def is_up(interface: str = INTERFACE) -> bool:
    """True if this process can use the interface now.

    The kernel is asked and not /sys/class/net, which may show the interfaces of another network namespace.
    """
    if sys.platform != "linux":
        return False
    import fcntl  # noqa: PLC0415 - other systems do not have it

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        try:
            answer = fcntl.ioctl(any_socket, _SIOCGIFFLAGS, _IFREQ.pack(interface.encode(), 0))
        except OSError:
            return False
    flags: int = _IFREQ.unpack(answer)[1]
    return bool(flags & _IFF_UP)


def require_vcan() -> None:
    """Skip the test if there is no CAN interface; in CI fail it."""
    if not is_up():
        missing(f"no CAN interface {INTERFACE}: run the tests by scripts/with-vcan")


def require_loopback() -> None:
    """Skip the test where multicast would leave this machine; in CI fail it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((UDP.channel, 9))
            here = probe.getsockname()[0]
        except OSError:
            here = "nowhere"
    if here != "127.0.0.1":
        missing("multicast would leave this machine: run the tests by scripts/with-loopback")
