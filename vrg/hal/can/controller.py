"""The controller of an interface: its bit rate, and how it comes back after too many errors have taken it off the bus.

With `restart-ms` one of socketcan comes back by itself. Without, somebody must say so, which takes rights that a player
seldom has.
"""

import json
import subprocess
from typing import Any

from vrg.hal.can.link import Link
from vrg.hal.can.pacing import FRAME_BITS, SLOWEST

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
    return FRAME_BITS / (rate or SLOWEST)


def restart(link: Link) -> str | None:
    """Bring the controller of a bus back if it is bus-off.

    Returns:
        why it still is, and what to do, in words; None where it is not, or where nobody can tell.
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
    """What the kernel says of an interface: its kind, and of a controller its state and its bit timing."""
    said = _run(["ip", "-details", "-json", "link", "show", "dev", channel])
    try:
        data: dict[str, Any] = json.loads(said or "[]")[0]["linkinfo"]
    except (ValueError, LookupError, TypeError):
        return {}
    return data


def _run(command: list[str]) -> str | None:
    """What a program has printed; None where it has failed."""
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
