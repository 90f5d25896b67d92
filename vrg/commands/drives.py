"""`vrg node drives`: emulated motor controllers on a CAN bus; and the options of a command that uses such a bus."""

import random
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from pydantic import ValidationError

from vrg.commands.options import LeashOption, exit_if_interrupted
from vrg.errors import ConfigError
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.link import Link, known_interface, read_adapter
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.emulation import EMULATING
from vrg.hal.can.workshop.motor import MotorModel
from vrg.launch.process_main import child_process
from vrg.system import boot_time
from vrg.tables import problems_of

if TYPE_CHECKING:
    from vrg.hal.can.link import Medium

_MOTOR = MotorModel()
T = TypeVar("T")
U = TypeVar("U")

ProtocolOption = Annotated[
    str,
    typer.Option("--protocol", help="The drives' protocol: odrive, or one that another package adds."),
]
OptionsOption = Annotated[
    list[str] | None,
    typer.Option("--option", help="An option of these drives, as in the wiring: NAME=VALUE."),
]


def medium() -> "Medium":
    """The buses of this computer."""
    from vrg.hal.can.bus import RealMedium  # python-can is for who uses a bus

    return RealMedium()


@dataclass(frozen=True)
class BusOptions:
    """The bus that a command means."""

    channel: Annotated[
        str | None, typer.Option("--channel", help="The bus; the default is can0, or vcan0 if there is no can0.")
    ] = None
    interface: Annotated[str, typer.Option("--interface", help="python-can's name for the interface.")] = "socketcan"
    bitrate: Annotated[int | None, typer.Option("--bitrate", help="bit/s, if the interface sets it itself.")] = None
    adapter: Annotated[
        list[str] | None,
        typer.Option("--adapter", help="A further option of python-can's interface, NAME=VALUE; can be repeated."),
    ] = None

    def link(self) -> Link:
        """The bus, with its interface.

        Raises:
            ConfigError: there is no such interface, or an option of the adapter makes no sense.
        """
        _read("--interface", known_interface, self.interface)
        adapter = _read("--adapter", read_adapter, self.adapter or [])
        return Link(
            interface=self.interface, channel=self.channel or _some_channel(), bitrate=self.bitrate, adapter=adapter
        )


@dataclass(frozen=True)
class EmulatedBusOptions(BusOptions):
    """The bus of emulated drives."""

    channel: Annotated[str, typer.Option("--channel", help="The bus, such as can0.")] = "vcan0"


def _read(option: str, read: Callable[[T], U], typed: T) -> U:
    """Read what was typed for an option.

    Raises:
        ConfigError: it makes no sense.
    """
    try:
        return read(typed)
    except ValueError as error:
        raise ConfigError(f"{option}: {error}") from None


def protocol_of(name: str, *, drive: bool = False, listener: bool = False) -> Protocol:
    """The protocol of this name.

    Args:
        drive: its emulated drive is needed. listener: its listener is needed.

    Raises:
        ConfigError: there is none, it has not what is needed, or it cannot be imported.
    """
    try:
        spoken = PROTOCOLS.get(name)
        _ = spoken.axis_type, drive and spoken.drive_type, listener and spoken.listener_type
    except ConfigError as error:
        raise ConfigError([f"--{problem}" for problem in error.problems]) from None
    return spoken


def options_of(protocol: Protocol, typed: list[str] | None) -> ProtocolOptions:
    """Return a protocol's options of its drives.

    Raises:
        ConfigError: it has no such options.
    """
    try:
        return protocol.axis_type.options_type.model_validate(_read("--option", read_adapter, typed or []))
    except ValidationError as error:
        raise ConfigError([f"--option: {problem}" for problem in problems_of(error)]) from None


def _some_channel() -> str:
    """The bus that is meant where none is named: without a real bus, the virtual one."""
    names = {name for _, name in socket.if_nameindex()}
    return "vcan0" if "vcan0" in names and "can0" not in names else "can0"


def drives(
    id_: Annotated[list[int], typer.Option("--id", help="A drive's id; may be given several times.")],
    on: EmulatedBusOptions,
    protocol: ProtocolOption = "odrive",
    option: OptionsOption = None,
    watchdog: Annotated[
        float, typer.Option(min=0, max=60, help="Time without a setpoint until the motor is off, s; 0 = never.")
    ] = 0.2,
    voltage: Annotated[float, typer.Option(min=0, max=1000, help="The voltage of the supply, V.")] = 24.0,
    inertia: Annotated[
        float, typer.Option(min=1e-9, help="Moment of inertia of rotor and load, kg m2.")
    ] = _MOTOR.inertia,
    current_limit: Annotated[
        float, typer.Option(min=0.01, help="Highest current of the motor, A.")
    ] = _MOTOR.current_limit,
    velocity_limit: Annotated[
        float, typer.Option(min=0.01, help="Highest speed of the motor, turn/s.")
    ] = _MOTOR.velocity_limit,
    friction: Annotated[float, typer.Option(min=0, help="Friction at the shaft, Nm.")] = _MOTOR.friction,
    delay: Annotated[float, typer.Option(min=0, max=0.5, help="Time from a setpoint to its effect, s.")] = _MOTOR.delay,
    braking: Annotated[
        float, typer.Option(min=1e-3, max=60, help="Time constant of a motor that is off, s.")
    ] = _MOTOR.braking,
    serial: Annotated[
        int | None, typer.Option(min=0, help="Serial number of the first drive; random by default.")
    ] = None,
    leash: LeashOption = False,
) -> None:
    """Emulate one or several motor controllers on a bus, until stopped."""
    from vrg.hal.can.workshop.run import run_drives  # python-can is for who uses a bus

    spoken = protocol_of(protocol, drive=True)
    options = options_of(spoken, option)
    problems = [f"--id: {problem}" for one in id_ if (problem := spoken.axis_type.check_node(one))]
    if problems:
        raise ConfigError(problems)
    link = on.link()
    first = secrets.randbits(40) if serial is None else serial
    motor = MotorModel(
        inertia=inertia,
        current_limit=current_limit,
        velocity_limit=velocity_limit,
        friction=friction,
        delay=delay,
        braking=braking,
    )
    with child_process(leash) as stop:
        drives = [
            spoken.drive_type(
                one,
                DriveOptions(serial=first + index, motor=motor, watchdog=watchdog, voltage=voltage, protocol=options),
                boot_time(),
                random.Random(first + index),
            )
            for index, one in enumerate(id_)
        ]
        names = ", ".join(f"{drive.node} (serial number {drive.options.serial:X})" for drive in drives)
        run_drives(link, drives, stop, ready=lambda: typer.echo(f"{EMULATING} {protocol} on {link}: {names}"))
    exit_if_interrupted(stop)
