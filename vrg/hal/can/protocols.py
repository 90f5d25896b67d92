"""The protocols that drives may speak, by the name that people write.

Another package adds a protocol by an entry point of the group `vrg.can_protocols` whose object is a `Protocol`. The
suite vrg.testing.protocol says what a protocol must be able to do.
"""

from dataclasses import dataclass
from typing import Any, TypeVar

from vrg.errors import ConfigError
from vrg.hal.can.axis import Axis
from vrg.hal.can.emulator.drive import EmulatedDrive
from vrg.hal.can.listener import Listener
from vrg.registry import Registry, load_object

C = TypeVar("C", Axis, EmulatedDrive, Listener)


@dataclass(frozen=True)
class Protocol:
    """One protocol. Its classes are imported when they are asked for.

    Args:
        name: as people write it in a match file; the name of the entry point as well.
        axis: `module:Class` of one motor axis, an `Axis`.
        drive: `module:Class` of the emulated drive, an `EmulatedDrive`.
        listener: `module:Class` of what recognises its nodes on a bus, a `Listener`.
    """

    name: str
    axis: str
    drive: str
    listener: str

    @property
    def axis_type(self) -> type[Axis]:
        """The class of one motor axis.

        Raises:
            ConfigError: it cannot be imported, or it is no `Axis`.
        """
        return self._load(self.axis, Axis)  # type: ignore[type-abstract]

    @property
    def drive_type(self) -> type[EmulatedDrive]:
        """The class of the emulated drive.

        Raises:
            ConfigError: it cannot be imported, or it is no `EmulatedDrive`.
        """
        return self._load(self.drive, EmulatedDrive)  # type: ignore[type-abstract]

    @property
    def listener_type(self) -> type[Listener]:
        """The class of what recognises its nodes.

        Raises:
            ConfigError: it cannot be imported, or it is no `Listener`.
        """
        return self._load(self.listener, Listener)  # type: ignore[type-abstract]

    def _load(self, target: str, base: type[C]) -> type[C]:
        try:
            found: Any = load_object(target)
        # Another package may raise anything while it is imported, and that must not look like a fault of VRG.
        except Exception as error:
            raise ConfigError([f"protocol {self.name}: cannot import {target}: {error!r}"]) from error
        if not (isinstance(found, type) and issubclass(found, base)):
            wanted = f"expected a subclass of {base.__name__}, got {found!r}"
            raise ConfigError([f"protocol {self.name}: {target}: {wanted}"])
        return found


def _check(found: object) -> str | None:
    return None if isinstance(found, Protocol) else "expected a vrg.hal.can.protocols.Protocol"


PROTOCOLS: Registry[Protocol] = Registry(
    "protocol",
    "vrg.can_protocols",
    {
        "odrive": "vrg.hal.can.odrive:PROTOCOL",
        "cia402": "vrg.hal.can.cia402:PROTOCOL",
        "moteus": "vrg.hal.can.moteus:PROTOCOL",
        "vesc": "vrg.hal.can.vesc:PROTOCOL",
    },
    _check,
)
"""Every protocol by name."""
