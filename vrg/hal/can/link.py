"""The description of a CAN bus, in python-can's words."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Protocol

from vrg.hal.can.frame import Filter, Frame
from vrg.hal.clock import MonotonicClock
from vrg.registry import expected_one_of

SERIAL_INTERFACES = frozenset({"slcan", "serial", "robotell"})
"""Interfaces on a serial port, which two processes cannot share: each would set it up again and take frames away."""

_OFTEN = frozenset({"socketcan", "udp_multicast", "virtual"})
"""Interfaces that are known without asking python-can, which takes time to load."""

_INTERFACES = Path("/sys/class/net")
"""The folder in which the kernel lists its network interfaces."""
_UP = 1
"""The kernel's flag IFF_UP of an interface."""

AdapterValue = bool | int | float | str | Mapping[str, int | float]
"""The types of an adapter's options; a table is a bit timing."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """The interface, the channel and the bit rates of a bus.

    Args:
        interface: python-can's name of it, such as `socketcan`, `udp_multicast`, `slcan` or `pcan`.
        channel: the bus, such as `can0`.
        bitrate: bit/s, where the interface sets it itself; None leaves it as it is. Where it does not, as `socketcan`,
            frames follow one another as slowly as on a bus that has it.
        adapter: further options of python-can's interface, such as `host` and `port`, `fd`, or `timing`, a table that
            describes a `can.BitTiming` or a `can.BitTimingFd`.
    """

    interface: str = "socketcan"
    channel: str = "can0"
    bitrate: int | None = None
    adapter: Mapping[str, AdapterValue] = field(default_factory=dict)

    def __str__(self) -> str:
        where = self.channel if self.interface == "socketcan" else f"{self.interface}:{self.channel}"
        # Two servers may each have a can0.
        extras = [f"{name} {self.adapter[name]}" for name in ("host", "port") if name in self.adapter]
        return f"{where} ({', '.join(extras)})" if extras else where

    @property
    def arguments(self) -> list[str]:
        """The options of a `vrg can` command that mean this bus."""
        words = ["--interface", self.interface, "--channel", self.channel]
        if self.bitrate is not None:
            words += ["--bitrate", str(self.bitrate)]
        for name, value in _flat(self.adapter):
            words += ["--adapter", f"{name}={str(value).lower() if isinstance(value, bool) else value}"]
        return words


def known_interface(name: str) -> str:
    """The name of an interface, if python-can has it, itself or by an entry point of another package.

    Raises:
        ValueError: it has not, with those that it has.
    """
    if name not in _OFTEN:
        from can.interfaces import VALID_INTERFACES  # noqa: PLC0415 - slow to load

        if name not in VALID_INTERFACES:
            raise ValueError(expected_one_of(sorted(VALID_INTERFACES), name))
    return name


def missing_interface(link: Link) -> str | None:
    """What a bus lacks on this machine, in words, with what to do: the kernel's interface, or that it is up."""
    if link.interface != "socketcan":
        return None
    interface = _INTERFACES / link.channel
    if not interface.exists():
        there = ", ".join(sorted(path.name for path in _INTERFACES.iterdir())) if _INTERFACES.exists() else ""
        return f"expected the interface {link.channel}, found {there or 'none'}: see docs/hardware.md"
    if not int((interface / "flags").read_text(), 16) & _UP:
        bitrate = link.bitrate or 500000
        return f"{link.channel} is down: sudo ip link set {link.channel} up type can bitrate {bitrate}"
    return None


def read_adapter(texts: Iterable[str]) -> dict[str, AdapterValue]:
    """The options of an adapter as people type them, `fd=true`, `port=29536` or `timing.brp=6`.

    Raises:
        ValueError: one has no `=`, with what was expected.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise ValueError(f"expected NAME=VALUE, such as fd=true, got {text!r}")
        table, dot, member = name.partition(".")
        if dot:
            found.setdefault(table, {})[member] = _value(value)
        else:
            found[name] = _value(value)
    return found


def _value(text: str) -> AdapterValue:
    """A value as TOML would have it, or else the text itself."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    return value if isinstance(value, bool | int | float | str) else text


def _flat(adapter: Mapping[str, AdapterValue]) -> Iterable[tuple[str, AdapterValue]]:
    for name, value in adapter.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}.{member}", number) for member, number in value.items())
        else:
            yield name, value


SEND_TIMEOUT: Final = 0.02
"""s that a frame may wait for those before it; one that would wait longer is refused. A queue of ten frames is emptied
in half that time."""
IDLE_TIMEOUT: Final = 0.05
"""s without a frame that is wanted after which a bus reports that nothing waits to be received."""


class Bus(Protocol):
    """One bus, as `vrg.hal.can.bus.CanBus` documents it.

    Attributes:
        link: how it is reached.
    """

    link: Link

    def start(self) -> None:
        """Open the bus and begin to listen. Idempotent.

        Raises:
            RobotError: there is no such interface or channel, with what to do.
        """

    def listen_to(self, wanted: Iterable[Filter] | None) -> None:
        """Drop all frames but those that one of the filters lets through; None hears everything again."""

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send a frame within SEND_TIMEOUT or never.

        Raises:
            RobotError: it could not be sent, with the reason.
        """

    def restart(self) -> str | None:
        """Bring the controller of a closed bus back if it is bus-off.

        Returns:
            why it still is, and what to do, in words; None if it is not, or if that is not known.
        """

    def stop(self) -> None:
        """Close the bus. Idempotent. Hold no lock that its callbacks want."""


class Medium(Protocol):
    """Buses and their time."""

    @property
    def clock(self) -> MonotonicClock:
        """The time of its buses."""

    def bus(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = ...,
        on_quiet: Callable[[float], None] = ...,
    ) -> Bus:
        """Make a bus, which is not open yet; the arguments are those of `vrg.hal.can.bus.CanBus`."""
