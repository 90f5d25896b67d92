"""The protocols that drives may speak, by the name that people write.

Another package adds a protocol by an entry point of the group `vrg.can_protocols` whose object is a `Protocol`. The
suite vrg.testing.protocol tests what a protocol must be able to do.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vrg.errors import ConfigError
from vrg.registry import Registry, load_object

if TYPE_CHECKING:
    from vrg.hal.can.axis import Axis
    from vrg.hal.can.workshop.emulated import EmulatedDrive
    from vrg.hal.can.workshop.listener import Listener


@dataclass(frozen=True)
class Protocol:
    """One protocol. Its classes are imported when they are asked for.

    Args:
        name: as people write it in a match file; the name of the entry point as well.
        axis: `module:Class` of one motor axis, an `Axis`: all that a match with real drives needs.
        drive: `module:Class` of the emulated drive, an `EmulatedDrive`; None where there is none.
        listener: `module:Class` of what recognises its nodes on a bus, a `Listener`; None where there is none.
    """

    name: str
    axis: str
    drive: str | None = None
    listener: str | None = None

    @property
    def axis_type(self) -> "type[Axis]":
        """The class of one motor axis.

        Raises:
            ConfigError: it cannot be imported, or it is no `Axis`.
        """
        found: type[Axis] = self._load(self.axis, "vrg.hal.can.axis:Axis")
        return found

    @property
    def drive_type(self) -> "type[EmulatedDrive]":
        """The class of the emulated drive.

        Raises:
            ConfigError: there is none, it cannot be imported, or it is no `EmulatedDrive`.
        """
        lacks = "it has no emulated drive, so that only real ones can be driven"
        found: type[EmulatedDrive] = self._load(self.drive, "vrg.hal.can.workshop.emulated:EmulatedDrive", lacks)
        return found

    @property
    def listener_type(self) -> "type[Listener[Any]]":
        """The class of what recognises its nodes.

        Raises:
            ConfigError: there is none, it cannot be imported, or it is no `Listener`.
        """
        lacks = "it has no listener, so that its drives cannot be found or set on a bus"
        found: type[Listener[Any]] = self._load(self.listener, "vrg.hal.can.workshop.listener:Listener", lacks)
        return found

    def _load(self, target: str | None, base: str, lacks: str = "") -> Any:
        """The class at `target`, a subclass of the one of VRG at `base`; `lacks`: the words where there is none."""
        if target is None:
            raise ConfigError(f"protocol {self.name}: {lacks}")
        try:
            found: Any = load_object(target)
        # Another package may raise anything while it is imported, and that must not look like a fault of VRG.
        except Exception as error:
            raise ConfigError(f"protocol {self.name}: cannot import {target}: {error!r}") from error
        if not (isinstance(found, type) and issubclass(found, load_object(base))):
            wanted = f"expected a subclass of {base.partition(':')[2]}, got {found!r}"
            raise ConfigError(f"protocol {self.name}: {target}: {wanted}")
        return found


def _check(found: object) -> str | None:
    return None if isinstance(found, Protocol) else "expected a vrg.hal.can.protocols.Protocol"


PROTOCOLS: Registry[Protocol] = Registry(
    "protocol",
    "vrg.can_protocols",
    {"odrive": "vrg.hal.can.odrive:PROTOCOL"},
    _check,
)
"""Every protocol by name."""
