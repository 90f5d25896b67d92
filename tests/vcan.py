"""The CAN interface that tests marked `vcan` use: vcan0, or one of its own for each worker of several."""

import contextlib
import os
import socket
import struct
import subprocess
import sys

from tests.requirements import missing

FIRST = "vcan0"
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
INTERFACE = f"vcan_{WORKER}" if WORKER else FIRST

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
    if not is_up(FIRST):
        missing(f"no CAN interface {FIRST}: run the tests by scripts/with-vcan")
    if not is_up():
        # There is one, so this kernel can make another, if this process may.
        with contextlib.suppress(OSError):
            for command in (["add", INTERFACE, "type", "vcan"], ["set", INTERFACE, "up"]):
                subprocess.run(["ip", "link", *command], check=False, capture_output=True, timeout=20)
    if not is_up():
        missing(f"{INTERFACE} cannot be made: run the tests by scripts/with-vcan, or without workers")
