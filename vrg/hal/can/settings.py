"""The settings of CAN robots in a match file: the table [backends.can]."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, ValidationInfo, field_validator, model_validator

from vrg.errors import ConfigError
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import Calibration, load_calibration
from vrg.hal.can.link import SERIAL_INTERFACES, AdapterValue, Link, known_interface
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.hal.companions import Companion
from vrg.hal.models.drivetrain import Drivetrain
from vrg.hal.settings import BackendSettings
from vrg.tables import Table, problems_of

if TYPE_CHECKING:
    from vrg.hal.can.workshop.simulation import Simulation

EMULATING = "emulating"
"""The first word that `vrg can node` prints once it is on the bus."""


InterfaceName = Annotated[str, AfterValidator(known_interface)]


_INTERFACES = Path("/sys/class/net")
"""The folder in which the kernel lists its network interfaces."""
_UP = 1
"""The kernel's flag IFF_UP of an interface."""


class MotorSettings(Table):
    """The motors of emulated drives, in the words of `MotorModel`; what is missing is as usual there.

    Args:
        inertia: of rotor and load, kg m^2. friction: at the shaft, Nm. current_limit: A.
        velocity_limit: turn/s. delay: from a setpoint to when the drive acts on it, s.
    """

    inertia: float | None = Field(None, gt=0)
    friction: float | None = Field(None, ge=0)
    current_limit: float | None = Field(None, gt=0)
    velocity_limit: float | None = Field(None, gt=0)
    delay: float | None = Field(None, ge=0, le=0.5)


class RobotWiring(Table):
    """One robot: [backends.can.robots.<name>].

    Args:
        left, right: node ids of the motors on each side, one or two.
        axes: of a robot whose drivetrain has other axes than `left` and `right`: the node ids of each, by its name.
        ratio: turns of a motor for one turn of its wheel. reversed: node ids of the motors whose positive speed drives
            back. A calibration file stands above both.
        calibration: file written by `vrg can calibrate`, relative to the match file.
        watchdog: `proved` lets each drive's own watchdog stop its motor once, at zero speed, before the robot is armed
            for the first time; `unsafe` drives a robot whose drives have none. If this computer fails, nothing stops
            such a robot.
        supply: the voltage of an empty and of a full battery, V.
        interface, channel, bitrate, adapter, protocol: for a robot on a bus of its own, in place of those of
            [backends.can].
        options: the protocol's options of the drives; see `Axis.options_type` of the protocol.
        motor: what emulated drives and their load are like, where that is not as usual; real drives are as they are.
    """

    left: list[int] = Field(default_factory=list, max_length=2)
    right: list[int] = Field(default_factory=list, max_length=2)
    axes: dict[str, list[int]] = Field(default_factory=dict, validate_default=True)
    ratio: float = Field(1.0, gt=0, le=10_000)
    reversed: list[int] = Field(default_factory=list)
    calibration: str | None = None
    watchdog: Literal["proved", "unsafe"] = "proved"
    supply: tuple[float, float] = (20.0, 25.2)
    interface: InterfaceName | None = None
    channel: str | None = None
    bitrate: int | None = Field(None, ge=10_000, le=1_000_000)
    adapter: dict[str, AdapterValue] | None = None
    protocol: str | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    motor: MotorSettings = Field(default_factory=lambda: MotorSettings.model_validate({}))

    @field_validator("protocol")
    @classmethod
    def _protocol(cls, value: str | None) -> str | None:
        return value if value is None else PROTOCOLS.known(value)

    # One validator for each field, so that all mistakes are found at once; what is wrong itself is not in `info.data`.
    @field_validator("axes")
    @classmethod
    def _wired(cls, axes: dict[str, list[int]], info: ValidationInfo) -> dict[str, list[int]]:
        if not {"left", "right"} <= info.data.keys():
            return axes
        left, right = info.data["left"], info.data["right"]
        if axes and (left or right):
            raise ValueError("expected either `left` and `right` or `axes`, got both")
        if len(left) != len(right):
            raise ValueError(f"expected as many motors left as right, got {len(left)} and {len(right)}")
        if empty := [name for name, nodes in (axes or {"left": left}).items() if not nodes]:
            raise ValueError(f"expected a motor for each axis, got none for {', '.join(empty)}")
        nodes = [*left, *right, *(node for own in axes.values() for node in own)]
        if len(set(nodes)) != len(nodes):
            raise ValueError(f"expected an id of its own for every motor, got {nodes}")
        return axes

    @field_validator("reversed")
    @classmethod
    def _reversed(cls, value: list[int], info: ValidationInfo) -> list[int]:
        if {"left", "right", "axes"} <= info.data.keys():
            wired = [info.data["left"], info.data["right"], *info.data["axes"].values()]
            nodes = [node for own in wired for node in own]
            if strangers := set(value) - set(nodes):
                raise ValueError(f"expected ids of {nodes}, got {sorted(strangers)}")
        return value

    @field_validator("supply")
    @classmethod
    def _supply(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] < value[1]:
            raise ValueError(f"expected the voltage of an empty and of a full battery, got {value}")
        return value

    @property
    def empty(self) -> float:
        """The voltage of an empty battery, V; 0 if it is not given."""
        return self.supply[0] if "supply" in self.model_fields_set else 0.0

    @property
    def nodes(self) -> list[int]:
        """The node ids of all motors."""
        return [node for nodes in self._by_axis.values() for node in nodes]

    @property
    def _by_axis(self) -> dict[str, list[int]]:
        return self.axes or {"left": self.left, "right": self.right}

    def wheel_axes(self, names: Sequence[str], calibration: Calibration | None) -> list[WheelAxis]:
        """The assignment of motors to the axes of a drivetrain, by the calibration if there is one.

        Args:
            names: those of the axes.

        Raises:
            ConfigError: the wiring has other axes.
        """
        if sorted(self._by_axis) != sorted(names):
            wired = ", ".join(self._by_axis)
            raise ConfigError(
                f"expected the motors of the axes {', '.join(names)} of this model, got {wired}: write "
                f"`axes = {{ {', '.join(f'{name} = [...]' for name in names)} }}` into the wiring of this robot"
            )
        axes = []
        for name, nodes in self._by_axis.items():
            for node in nodes:
                axis = WheelAxis(node, names.index(name), -1 if node in self.reversed else 1, self.ratio)
                if calibration is not None:
                    own = calibration.axes[node]
                    axis = replace(axis, direction=own.direction, ratio=own.ratio, serial=own.serial)
                axes.append(axis)
        return axes


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
    protocol: str = "odrive"
    emulate: bool = False
    robots: dict[str, RobotWiring] = Field(default_factory=dict)

    @field_validator("protocol")
    @classmethod
    def _protocol(cls, value: str) -> str:
        return PROTOCOLS.known(value)

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
                    raise ValueError(f"robots.{name}: node {node} on {bus} is {other}'s already")
        return self

    @property
    def emulated(self) -> bool:
        """True if the drives are emulated."""
        return self.emulate

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

    def problems(self, robots: Sequence[str], base: Path) -> list[str]:
        """Robots without wiring, calibration files that do not fit, and robots that share what cannot be shared."""
        found = []
        ports: dict[str, list[str]] = {}
        for name in robots:
            if name in self.robots and (link := self.link(name)).interface in SERIAL_INTERFACES:
                ports.setdefault(str(link), [] if not self.emulate else ["the emulated drives"]).append(name)
        found += [
            f"{' and '.join(users)} are processes of their own, and cannot share {port}: make a socketcan interface of "
            "the adapter by slcand (see docs/hardware.md)"
            for port, users in ports.items()
            if len(users) > 1
        ]
        for name in robots:
            wiring = self.robots.get(name)
            if wiring is None:
                found.append(f"expected a table [backends.can.robots.{name}] with its wiring, found none")
                continue
            if self.emulate and self.protocol_of(name).drive is None:
                found.append(f"robots.{name}: {self.protocol_name(name)} has no emulated drive: leave `emulate` out")
            if missing := self.options_of(name).missing:
                found.append(f"robots.{name}: {missing}")
            if wiring.calibration:
                try:
                    load_calibration(base / wiring.calibration, wiring.nodes)
                except ConfigError as error:
                    found += map(str, error.problems)
        return found

    def unproved(self, robots: Sequence[str]) -> list[str]:
        """Directions, watchdogs and units of real drives."""
        if self.emulate:
            return []
        found = []
        for name in robots:
            wiring = self.robots[name]
            if wiring.calibration is None:
                found.append(
                    f"{name}: its directions, gear ratio and track are as in the file: they were not measured, as "
                    "`vrg can calibrate` does"
                )
            if wiring.watchdog == "unsafe":
                found.append(f'{name}: nothing stops its motors if this computer fails, as its watchdog is "unsafe"')
            else:
                found.append(f"{name}: the watchdogs of its drives are proved when it is armed for the first time")
            if not wiring.options:
                found.append(
                    f"{name}: the units of its drives' numbers are those that the drives or their protocol tell"
                )
        return found

    def only_in_process(self, robots: Sequence[str]) -> list[str]:
        """Buses that only one process can use."""
        links = {str(link): link for link in map(self.link, robots) if link.interface == "virtual"}
        return [
            f"{link}: the interface virtual is within one process: add --in-process, or take the interface "
            "udp_multicast or socketcan, for which see docs/hardware.md"
            for link in links
        ]

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """Network interfaces of CAN that do not exist or are down."""
        found = self.only_in_process(robots)
        for link in {str(link): link for link in map(self.link, robots) if link.interface == "socketcan"}.values():
            interface = _INTERFACES / link.channel
            if not interface.exists():
                there = ", ".join(sorted(path.name for path in _INTERFACES.iterdir())) if _INTERFACES.exists() else ""
                found.append(f"expected the interface {link.channel}, found {there or 'none'}: see docs/hardware.md")
            elif not int((interface / "flags").read_text(), 16) & _UP:
                bitrate = link.bitrate or 500000
                found.append(f"{link.channel} is down: sudo ip link set {link.channel} up type can bitrate {bitrate}")
        return found

    def files(self, robots: Sequence[str]) -> list[str]:
        """The calibration files."""
        return [file for name in robots if (file := self.robots[name].calibration) is not None]

    def simulate(self, robots: Sequence[str], simulation: "Simulation", seed: int) -> bool:
        """Put emulated drives of these robots into a simulation; False where the drives are real."""
        if not self.emulate:
            return False
        from vrg.hal.can.workshop.emulated import DriveOptions  # noqa: PLC0415 - real drives need no workshop
        from vrg.hal.can.workshop.motor import MotorModel  # noqa: PLC0415

        for name in robots:
            link, kind, told = self.link(name), self.protocol_of(name).drive_type, self.options_of(name)
            drives = []
            for node in self.robots[name].nodes:
                rng = random.Random(f"{seed} {link} {node}")
                motor = MotorModel(**self.robots[name].motor.model_dump(exclude_none=True))
                options = DriveOptions(serial=rng.getrandbits(40), motor=motor, protocol=told)
                drives.append(kind(node, options, simulation.clock.now(), rng))
            simulation.wire(link).attach(drives)
        return True

    def as_wired(self, robot: str, drivetrain: Drivetrain, base: Path) -> Drivetrain:
        """See `BackendSettings.as_wired`."""
        wiring = self.robots[robot]
        if not wiring.calibration or "ratio" not in wiring.model_fields_set:
            return drivetrain  # of wheels whose ratio is not in the file nothing but the calibration is known
        found = load_calibration(base / wiring.calibration, wiring.nodes)
        axes = wiring.wheel_axes(drivetrain.axes, found)
        ratios = [
            [
                axis.ratio * axis.direction * (-1 if axis.node in wiring.reversed else 1)
                for axis in axes
                if axis.axis == number
            ]
            for number in range(len(drivetrain.axes))
        ]
        rates = zip(drivetrain.with_track(found.track).rates, ratios, strict=True)
        return replace(
            drivetrain,
            rates=tuple(
                (ahead * scale, turn * scale, side * scale)
                for (ahead, turn, side), own in rates
                for scale in [sum(own) / len(own) / wiring.ratio]
            ),
        )

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The emulated drives of these robots, one process for each bus."""
        if not self.emulate:
            return []
        buses: dict[tuple[str, str], list[str]] = {}
        for name in robots:
            # Drives with different options are processes of their own.
            own = self.robots[name]
            buses.setdefault((str(self.link(name)), f"{own.options} {own.motor}"), []).append(name)
        companions = []
        for number, members in enumerate(buses.values(), 1):
            link, protocol = self.link(members[0]), self.protocol_name(members[0])
            ids = [node for name in members for node in self.robots[name].nodes]
            arguments = ["can", "node", *link.arguments, "--protocol", protocol]
            arguments += [f"--option={name}={value}" for name, value in self.robots[members[0]].options.items()]
            told = self.robots[members[0]].motor.model_dump(exclude_none=True)
            arguments += [f"--{name.replace('_', '-')}={value}" for name, value in told.items()]
            # They are the same drives when their process is started again.
            arguments += ["--serial", str(random.Random(f"{link} {ids}").getrandbits(40))]
            for node in ids:
                arguments += ["--id", str(node)]
            companions.append(Companion("drives" if number == 1 else f"drives-{number}", tuple(arguments), EMULATING))
        return companions


def can_settings(table: Mapping[str, Any]) -> CanSettings:
    """The settings in a table [backends.can].

    Raises:
        ConfigError: with every problem of the table.
    """
    try:
        return CanSettings.model_validate(dict(table))
    except ValidationError as error:
        raise ConfigError(problems_of(error, ("backends", "can"))) from None
