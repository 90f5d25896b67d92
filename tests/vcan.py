"""The CAN interface that tests marked `vcan` use."""

import socket
import struct
import sys

from tests.requirements import missing

INTERFACE = "vcan0"

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
