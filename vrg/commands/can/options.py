"""The options that the commands of `vrg can` share, and what they mean."""

import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from pydantic import ValidationError

from vrg.errors import ConfigError
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.link import Link, known_interface, read_adapter
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.tables import problems_of

if TYPE_CHECKING:
    from vrg.hal.can.link import Medium

T = TypeVar("T")
U = TypeVar("U")

ProtocolOption = Annotated[
    str,
    typer.Option("--protocol", help="What the drives speak: odrive, or what another package adds."),
]
OptionsOption = Annotated[
    list[str] | None,
    typer.Option("--option", help="An option of such drives as in the wiring, NAME=VALUE."),
]


def medium() -> "Medium":
    """The buses of this computer."""
    from vrg.hal.can.bus import RealMedium  # python-can is for who uses a bus

    return RealMedium()


@dataclass(frozen=True)
class BusOptions:
    """The bus that a command means."""

    channel: Annotated[
        str | None, typer.Option("--channel", help="The bus; can0 if missing, or vcan0 where there is no can0.")
    ] = None
    interface: Annotated[str, typer.Option("--interface", help="python-can's name of the interface.")] = "socketcan"
    bitrate: Annotated[int | None, typer.Option("--bitrate", help="bit/s, where the interface sets it itself.")] = None
    adapter: Annotated[
        list[str] | None,
        typer.Option("--adapter", help="A further option of python-can's interface, NAME=VALUE; several are possible."),
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
