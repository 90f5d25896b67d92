"""The settings of CAN robots in a match file: the table [backends.can]."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field, ValidationError, model_validator

from vrg.errors import ConfigError
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.calibration import load_calibration
from vrg.hal.can.link import SERIAL_INTERFACES, AdapterValue, Link, missing_interface
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.hal.can.wiring import InterfaceName, ProtocolName, RobotWiring
from vrg.hal.models import RobotModel
from vrg.hal.settings import BackendSettings
from vrg.tables import problems_of

if TYPE_CHECKING:
    from vrg.hal.can.workshop.emulation import Emulation


class CanSettings(BackendSettings):
    """The table [backends.can].

    Args:
        interface, channel, bitrate, adapter: the bus, in python-can's words; see `Link`.
        protocol: the protocol that the drives speak, by its name in PROTOCOLS.
        emulate: start emulated drives for these robots; without it the drives are expected on the bus.
        robots: the wiring by the robot's name. Robots whose backend is another one are left alone.
    """

    interface: InterfaceName = "socketcan"
    channel: str = "can0"
    bitrate: int | None = Field(None, ge=10_000, le=1_000_000)
    adapter: dict[str, AdapterValue] = Field(default_factory=dict)
    protocol: ProtocolName = "odrive"
    emulate: bool = False
    robots: dict[str, RobotWiring] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _nodes(self) -> "CanSettings":
        owner: dict[tuple[str, int], str] = {}
        spoken: dict[str, str] = {}
        for name in self.robots:
            bus, protocol = str(self.link(name)), self.protocol_name(name)
            self.options_of(name)
            if spoken.setdefault(bus, protocol) != protocol:
                # Their identifiers overlap: a setpoint of one is a controlword of the other.
                raise ValueError(f"robots.{name}: {protocol} on {bus}, where others speak {spoken[bus]}: one bus each")
            for node in self.robots[name].nodes:
                problem = self.protocol_of(name).axis_type.check_node(node)
                if problem:
                    raise ValueError(f"robots.{name}: node id of {protocol}: {problem}")
                other = owner.setdefault((bus, node), name)
                if other != name:
                    raise ValueError(f"robots.{name}: node {node} on {bus} already belongs to {other}")
            self._check_outputs(name)
        return self

    def _check_outputs(self, name: str) -> None:
        """Raise ValueError if actuators are wired to no drive of their robot, or to outputs that there are not."""
        wired: dict[tuple[int, int], str] = {}
        found = []
        for actuator, output in self.robots[name].outputs.items():
            where = f"robots.{name}.outputs.{actuator}"
            if output.drive not in self.robots[name].nodes:
                found.append(f"{where}: drive: expected one of {self.robots[name].nodes}, got {output.drive}")
            if problem := self.protocol_of(name).axis_type.check_output(output.bit):
                found.append(f"{where}: digital output of {self.protocol_name(name)}: {problem}")
            if (other := wired.setdefault((output.drive, output.bit), actuator)) != actuator:
                found.append(f"{where}: expected an output of its own, got that of {other}")
        if found:
            raise ValueError("; ".join(found))

    @property
    def emulation(self) -> "Emulation | None":
        """The emulated drives; None if they are real."""
        if not self.emulate:
            return None
        from vrg.hal.can.workshop.emulation import Emulation  # noqa: PLC0415 - real drives need no workshop

        return Emulation(self)

    def link(self, robot: str) -> Link:
        """The bus of a robot."""
        own = self.robots[robot]
        return Link(
            interface=own.interface or self.interface,
            channel=own.channel or self.channel,
            bitrate=own.bitrate or self.bitrate,
            adapter=self.adapter if own.adapter is None else own.adapter,
        )

    def protocol_name(self, robot: str) -> str:
        """The name of the protocol that a robot's drives speak."""
        return self.robots[robot].protocol or self.protocol

    def protocol_of(self, robot: str) -> Protocol:
        """The protocol that a robot's drives speak.

        Raises:
            ConfigError: it cannot be imported.
        """
        return PROTOCOLS.get(self.protocol_name(robot))

    def options_of(self, robot: str) -> ProtocolOptions:
        """The options of the protocol of a robot's drives.

        Raises:
            ConfigError: the protocol cannot be imported. ValueError: the options have problems; names each.
        """
        kind = self.protocol_of(robot).axis_type.options_type
        try:
            return kind.model_validate(self.robots[robot].options)
        except ValidationError as error:
            found = "; ".join(map(str, problems_of(error, ("robots", robot, "options"))))
            raise ValueError(found) from None

    def problems(self, robots: Mapping[str, RobotModel], base: Path) -> list[str]:
        """Robots whose wiring is missing or does not fit their model or calibration, or who share what they cannot."""
        found = [] if self.emulate else self.within_process(name for name in robots if name in self.robots)
        ports: dict[str, list[str]] = {}
        for name in robots:
            if name in self.robots and (link := self.link(name)).interface in SERIAL_INTERFACES:
                ports.setdefault(str(link), [] if not self.emulate else ["the emulated drives"]).append(name)
        found += [
            f"{' and '.join(users)} are processes of their own, and cannot share {port}: make a socketcan interface of "
            "the adapter with slcand (see docs/hardware.md)"
            for port, users in ports.items()
            if len(users) > 1
        ]
        for name, model in robots.items():
            wiring = self.robots.get(name)
            if wiring is None:
                found.append(f"expected a table [backends.can.robots.{name}] with its wiring, found none")
                continue
            if self.emulate and self.protocol_of(name).drive is None:
                found.append(f"robots.{name}: {self.protocol_name(name)} has no emulated drive: leave `emulate` out")
            if missing := self.options_of(name).missing:
                found.append(f"robots.{name}: {missing}")
            found += [f"robots.{name}: {text}" for text in wiring.misfits(name, model)]
            if wiring.calibration:
                try:
                    load_calibration(base / wiring.calibration, wiring.nodes)
                except ConfigError as error:
                    found += map(str, error.problems)
        return found

    def unverified(self, robots: Sequence[str]) -> list[str]:
        """Directions, watchdogs and units of real drives."""
        if self.emulate:
            return []
        found = []
        for name in robots:
            wiring = self.robots[name]
            if wiring.calibration is None:
                found.append(
                    f"{name}: its directions, gear ratio and track are as in the file, and how far it rolls on with "
                    "its motors off as in its model: they were not measured, as `vrg can calibrate` does"
                )
            if wiring.watchdog == "unsafe":
                found.append(f'{name}: nothing stops its motors if this computer fails, as its watchdog is "unsafe"')
            else:
                found.append(f"{name}: the watchdogs of its drives are proved when it is armed for the first time")
            found += [
                f"{name}: how soon the output of its {actuator} goes off if this computer fails depends on the drive"
                for actuator in wiring.outputs
            ]
            if not wiring.options:
                found.append(
                    f"{name}: the units of its drives' numbers are those that the drives or their protocol report"
                )
        return found

    def within_process(self, robots: Iterable[str]) -> list[str]:
        """The buses of these robots that only one process can use, in words, each with what to do."""
        links = {str(link): link for link in map(self.link, robots) if link.interface == "virtual"}
        return [
            f"{link}: the interface virtual is within one process: add --in-process, or take the interface "
            "udp_multicast or socketcan, for which see docs/hardware.md"
            for link in links
        ]

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """Network interfaces of CAN that do not exist or are down."""
        links = {str(link): link for link in map(self.link, robots)}.values()
        return [*self.within_process(robots), *filter(None, map(missing_interface, links))]

    def files(self, robots: Sequence[str]) -> list[str]:
        """The calibration files."""
        return [file for name in robots if (file := self.robots[name].calibration) is not None]
