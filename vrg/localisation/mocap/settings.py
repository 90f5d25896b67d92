"""The settings of a motion capture system."""

import ipaddress
from typing import Annotated, Any, Final, Literal

from pydantic import Field, field_validator, model_validator

from vrg.tables import PoseTable, Table

OPTIONS: Final[dict[str, dict[str, str]]] = {
    "optitrack": {"port": "port_command", "interface": "interface_ip"},
    "vicon": {},
    "qualisys": {"port": "port"},
    "vrpn": {},
}
"""The library's names of the settings that only some systems have. The others take a port as a part of the host."""


class BodyTable(PoseTable):
    """The rigid body of a robot: x ahead of the robot's centre and y to its left, m, and its heading there, degrees.

    Args:
        name: in the capture system; that of the robot if missing.
    """

    name: str | None = None


class MocapSettings(Table):
    """The table of a source of the kind `mocap`.

    Systems measure to a millimetre, but the default of `position` is what the time costs, which is known to about 7 ms:
    a robot drives 5 mm meanwhile at 0.7 m/s.

    Args:
        system: which one. host: the name or the address of the computer on which it runs.
        port: where it takes requests; the system's own if missing. interface: the address of this machine's network
            interface, on which OptiTrack's multicast packets arrive.
        up: its axis that points up.
        origin: the pose of its frame on the map: where its origin is and where its x axis points.
        bodies: the rigid bodies by the robots' names. A robot that is not named has the one of its own name.
        rate: the most frames in a second that are used.
        latency: the time from the exposure to the arrival of a frame, s.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
    """

    system: Literal["optitrack", "vicon", "qualisys", "vrpn"]
    host: Annotated[str, Field(min_length=1)]
    port: Annotated[int, Field(ge=1, le=65535)] | None = None
    interface: str | None = None
    up: Literal["y", "z"] = "z"
    origin: PoseTable = Field(default_factory=lambda: PoseTable.model_validate({}))
    bodies: dict[str, BodyTable] = Field(default_factory=dict)
    rate: Annotated[float, Field(gt=0.0, le=500.0)] = 50.0
    latency: Annotated[float, Field(ge=0.0, le=0.5)] = 0.01
    position: Annotated[float, Field(gt=0.0, le=10.0)] = 0.005
    heading: Annotated[float, Field(gt=0.0, le=90.0)] = 0.5

    @field_validator("interface")
    @classmethod
    def _address(cls, value: str | None) -> str | None:
        if value is not None:
            ipaddress.IPv4Address(value)
        return value

    @model_validator(mode="after")
    def _possible(self) -> "MocapSettings":
        for name in ("port", "interface"):
            if getattr(self, name) is not None and name not in OPTIONS[self.system]:
                raise ValueError(f"{self.system} has no {name}: see docs/localisation.md")
        owners: dict[str, str] = {}
        for robot in self.bodies:
            body = self.body_of(robot)
            if (other := owners.setdefault(body, robot)) != robot:
                raise ValueError(f"expected a rigid body for each robot, got {body} for {other} and for {robot}")
        return self

    def body_of(self, robot: str) -> str:
        """The name of a robot's rigid body."""
        table = self.bodies.get(robot)
        return table.name if table is not None and table.name is not None else robot

    def options(self) -> dict[str, str]:
        """The settings in the words of the library."""
        given: dict[str, Any] = {"port": self.port, "interface": self.interface}
        named = {word: str(given[name]) for name, word in OPTIONS[self.system].items() if given[name] is not None}
        return {"hostname": self.host, **named}
