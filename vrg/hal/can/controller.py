"""The controller of a socketcan interface: after too many errors it leaves the bus, and must be restarted.

With `restart-ms` it comes back by itself. Without, somebody must say so, which takes rights that a player seldom has.
"""

import json
import subprocess
from typing import Any

from vrg.hal.can.link import Link

_TIMEOUT = 5.0
"""s for the program `ip`, which only asks the kernel."""


def restart(link: Link) -> str | None:
    """Bring the controller of a bus back if it is bus-off.

    Returns:
        why it still is, and what to do, in words; None where it is not, or where nobody can tell.
    """
    if link.interface != "socketcan":
        return None
    found = _details(link.channel)
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
    """What the kernel says of a CAN controller; empty where it has none, as a virtual one."""
    said = _run(["ip", "-details", "-json", "link", "show", "dev", channel])
    try:
        data: dict[str, Any] = json.loads(said or "[]")[0]["linkinfo"]["info_data"]
    except (ValueError, LookupError, TypeError):
        return {}
    return data


def _run(command: list[str]) -> str | None:
    """What a program has printed; None where it has failed."""
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
