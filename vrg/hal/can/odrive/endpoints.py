"""The endpoints of an ODrive's firmware: every firmware numbers them anew, and its maker publishes the numbers.

Source: ODrive's documentation of SDO over CAN, and its file flat_endpoints.json for each firmware.
"""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vrg.errors import ConfigError

_PACKINGS = {
    "bool": "?", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I", "int32": "i", "float": "f",
}  # fmt: skip
"""The types of endpoints that fit into one frame, as struct has them."""


@dataclass(frozen=True)
class Endpoint:
    """One setting.

    Args:
        number: of the endpoint. kind: its type, one of those of the file.
    """

    number: int
    kind: str

    def raw(self, text: str) -> int:
        """The value that somebody has typed, as the protocol has it.

        Raises:
            ValueError: it is none of this type.
        """
        packing = struct.Struct("<" + _PACKINGS[self.kind])
        try:
            data = packing.pack(_value_of(text, self.kind))
        except struct.error as error:
            raise ValueError(f"expected a value of type {self.kind}, got {text!r}: {error}") from None
        return int.from_bytes(data, "little")

    def words(self, raw: int) -> str:
        """A value of the protocol, as people read it."""
        packing = struct.Struct("<" + _PACKINGS[self.kind])
        (value,) = packing.unpack(raw.to_bytes(4, "little")[: packing.size])
        if isinstance(value, bool):
            return str(value).lower()
        return f"{value:.7g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Endpoints:
    """All endpoints of one firmware.

    Args:
        firmware: its version, such as 0.6.11.
        by_name: the endpoints by their path, such as axis0.config.watchdog_timeout.
    """

    firmware: str
    by_name: dict[str, Endpoint]

    def find(self, name: str) -> Endpoint:
        """The endpoint of this name.

        Raises:
            ValueError: there is none; says which are similar.
        """
        if name in self.by_name:
            return self.by_name[name]
        last = name.rpartition(".")[2]
        similar = [known for known in self.by_name if last in known][:5]
        guess = f", did you mean {' or '.join(similar)}?" if similar else ""
        raise ValueError(f"expected the path of an endpoint, got {name!r}{guess}")


def read_endpoints(path: Path) -> Endpoints:
    """Read a file flat_endpoints.json.

    Raises:
        ConfigError: it cannot be read, or it is none.
    """
    try:
        data: Any = json.loads(path.read_text(encoding="utf-8"))
        listed = data["endpoints"]
        found = {name: Endpoint(int(e["id"]), e["type"]) for name, e in listed.items() if e.get("type") in _PACKINGS}
        return Endpoints(str(data["fw_version"]), found)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError([f"{path}: expected a file flat_endpoints.json, as ODrive publishes it: {error!r}"]) from None


def _value_of(text: str, kind: str) -> bool | int | float:
    if kind == "bool":
        if text.lower() not in ("true", "false"):
            raise ValueError(f"expected true or false, got {text!r}")
        return text.lower() == "true"
    return float(text) if kind == "float" else int(text, 0)
