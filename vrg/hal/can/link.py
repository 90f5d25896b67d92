"""How to reach a CAN bus, in python-can's words."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Link:
    """How to reach a bus.

    Args:
        interface: python-can's name of it, such as `socketcan`, `udp_multicast`, `slcan` or `pcan`.
        channel: the bus, such as `can0`.
        bitrate: bit/s, where the interface sets it itself; None leaves it as it is.
    """

    interface: str = "socketcan"
    channel: str = "can0"
    bitrate: int | None = None

    def __str__(self) -> str:
        return self.channel if self.interface == "socketcan" else f"{self.interface}:{self.channel}"
