"""The settings of the vision of the Small Size League as a source of fixes."""

import ipaddress
import re
from typing import Literal

from pydantic import Field, field_validator

from vrg.tables import PoseTable, Table


class SslSettings(Table):
    """The table of a source of the kind `ssl`.

    Args:
        robots: the robot of the league by the player's name, such as `yellow 3`.
        address, port: where the packets are sent. interface: the address of this machine's network interface.
        packets: `vision` for those of SSL-Vision, `tracker` for those of a tracker.
        field: the middle of the league's field on the map, and the direction of its x axis.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
        confidence: robots of which the sender is less sure are ignored, 0 to 1.
        latency: the time from a picture to a packet of a tracker, which does not tell it, s.
    """

    robots: dict[str, str]
    address: str = "224.5.23.2"
    port: int = Field(10006, ge=1, le=65535)
    interface: str = ""
    packets: Literal["vision", "tracker"] = "vision"
    field: PoseTable = Field(default_factory=lambda: PoseTable.model_validate({}))
    position: float = Field(0.01, gt=0.0, le=10.0)
    heading: float = Field(1.0, gt=0.0, le=90.0)
    confidence: float = Field(0.5, ge=0.0, le=1.0)
    latency: float = Field(0.0, ge=0.0, le=0.5)

    @field_validator("robots")
    @classmethod
    def _named(cls, value: dict[str, str]) -> dict[str, str]:
        for name, robot in value.items():
            if not re.fullmatch(r"(yellow|blue) \d{1,2}", robot):
                raise ValueError(f"{name}: expected a robot of the league, such as `yellow 3`, got {robot!r}")
        if len(set(value.values())) < len(value):
            raise ValueError("expected another robot of the league for each player")
        return value

    @field_validator("address", "interface")
    @classmethod
    def _address(cls, value: str) -> str:
        if value:
            ipaddress.IPv4Address(value)
        return value
