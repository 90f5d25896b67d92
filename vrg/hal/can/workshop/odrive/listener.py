"""ODrives on a bus: how they are recognised, and what they tell."""

import struct
from dataclasses import dataclass
from pathlib import Path

from vrg.errors import ConfigError, RobotError
from vrg.files import read_json
from vrg.hal.can.axis import Send
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command, ProcedureResult
from vrg.hal.can.workshop.listener import ANSWER_TIMEOUT, Claim, Listener
from vrg.hal.clock import MonotonicClock

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
        """The value that a person has typed, as the protocol has it.

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
            ValueError: there is none, with the similar ones.
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
        ConfigError: it cannot be read, or it is not one.
    """
    try:
        data = read_json(path)
        listed = data["endpoints"]
        found = {name: Endpoint(int(e["id"]), e["type"]) for name, e in listed.items() if e.get("type") in _PACKINGS}
        return Endpoints(str(data["fw_version"]), found)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError(f"{path}: expected a file flat_endpoints.json, as ODrive publishes it: {error!r}") from None


def _value_of(text: str, kind: str) -> bool | int | float:
    if kind == "bool":
        if text.lower() not in ("true", "false"):
            raise ValueError(f"expected true or false, got {text!r}")
        return text.lower() == "true"
    return float(text) if kind == "float" else int(text, 0)


_ADDRESS_BYTES = (7, 8)
"""The bytes of the answer to who is there; newer firmware appends a connection id."""
_READ, _WRITE, _SAVE = 0, 1, 1
"""The operations of an RxSdo, and the action of a Reboot that saves first."""
_VALUES = (Command.VERSION, Command.HEARTBEAT, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT)


def _makes_sense(frame: Frame) -> bool:
    """True if a frame may be a heartbeat: a state and errors that there are, and errors only of an axis that is off."""
    try:
        message = codec.decode(frame)
    except FrameError:
        return False
    # Firmware 0.5 tells in the highest bit of the last byte what newer one tells in the last but one.
    if not isinstance(message, messages.Heartbeat) or message.done > 1 or frame.data[-1] & 0x7F:
        return False
    known = message.state in set(AxisState) - {AxisState.UNDEFINED} and message.result in set(ProcedureResult)
    return known and not message.error & ~sum(AxisError) and not (message.error and message.state != AxisState.IDLE)


class OdriveNode(OdriveAxis):
    """An axis that only listens: it asks nothing by itself, whatever it hears. It may have no id yet."""

    @property
    def words(self) -> str:
        """The state of the axis, as ODrive writes it."""
        return "has no id yet" if self.node == codec.BROADCAST else super().words

    def _learn(self, version: messages.Version) -> None:
        self.firmware = version.firmware


class OdriveListener(Listener[OdriveNode]):
    """See `Listener`. A drive is recognised by its heartbeat, which some telegrams of CANopen look like.

    Attributes:
        endpoints: those of the drives' firmware; None as long as they are not given. Settings are named by them.
    """

    word = "odrive"
    title = "ODrive"
    node_type = OdriveNode

    def __init__(self, send: Send, clock: MonotonicClock) -> None:
        super().__init__(send, clock)
        self.endpoints: Endpoints | None = None
        self._answers: dict[tuple[int, int], int] = {}
        self._alike: set[int] = set()
        """Nodes that may be ODrives, by one frame at least."""

    def claim(self, frame: Frame) -> Claim:
        """A heartbeat that makes sense is likely one. An answer to who is there, or a frame of a known node, fits."""
        if frame.extended or frame.fd or frame.remote:
            return Claim.NONE
        node, command, data = codec.node_of(frame.id), codec.command_of(frame.id), frame.data
        if command == Command.ADDRESS and len(data) in _ADDRESS_BYTES and data[0] in (node, codec.BROADCAST):
            return Claim.FITTING
        if node == codec.BROADCAST:
            return Claim.NONE
        if node in self.found:
            return Claim.FITTING
        if command != Command.HEARTBEAT or not _makes_sense(frame):
            return Claim.NONE
        self._alike.add(node)
        return Claim.LIKELY

    def owns(self, frame: Frame) -> bool:
        """True for a frame to or from an axis that is known, or that may be one, or to all."""
        if frame.extended or frame.remote:
            return False
        node = codec.node_of(frame.id)
        return node in self.found or node in self._alike or (node == codec.BROADCAST and bool(self.found))

    def hear(self, frame: Frame) -> None:
        """Take in a frame."""
        try:
            message = codec.decode(frame)
        except FrameError:
            return
        node = self._recognise(codec.node_of(frame.id), frame)
        node.receive(frame)
        match message:
            case messages.Address(serial=serial):
                node.serials.add(f"{serial:X}")
                node.heard = frame.at  # it may have a slow heartbeat, or none
            case messages.TxSdo(endpoint=endpoint, value=value):
                self._answers[node.node, endpoint] = value

    def greet(self) -> None:
        """Ask every drive for its serial number."""
        self._send(codec.request(codec.BROADCAST, Command.ADDRESS))

    def stop(self) -> None:
        """Ask every axis to be idle: all at once, and each that is known by its id as well."""
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.encode(number, messages.SetAxisState(messages.AxisState.IDLE)), urgent=True)

    def clear(self, node: OdriveNode) -> None:
        """Let an axis forget its errors."""
        node.clear()

    def rename(self, node: OdriveNode, serial: str, to: int) -> None:
        """Give the drive of this serial number another id, which it keeps until it is switched off, unless it is saved.

        Raises:
            RobotError: it could not be sent.
        """
        self._send(codec.encode(codec.BROADCAST, messages.Address(to, int(serial, 16))))

    def read(self, node: OdriveNode, setting: str) -> str:
        """Return the value of an endpoint of a drive, which is named by its path.

        Raises:
            RobotError: there is no answer. ValueError: there is no such endpoint, or its firmware has other numbers.
        """
        endpoint = self._endpoint(node, setting)
        self._answers.pop((node.node, endpoint.number), None)
        self._send(codec.encode(node.node, messages.RxSdo(_READ, endpoint.number)))
        if not self._clock.wait(lambda: (node.node, endpoint.number) in self._answers, ANSWER_TIMEOUT):
            raise RobotError(f"odrive {node.node}: expected an answer to {setting}, got none")
        return endpoint.words(self._answers[node.node, endpoint.number])

    def write(self, node: OdriveNode, setting: str, value: str) -> None:
        """Change an endpoint.

        Raises:
            RobotError: it could not be sent. ValueError: as for `read`, or the value is none that it can have.
        """
        endpoint = self._endpoint(node, setting)
        self._send(codec.encode(node.node, messages.RxSdo(_WRITE, endpoint.number, endpoint.raw(value))))

    def save(self, node: OdriveNode) -> None:
        """Let a drive keep all its settings; it starts again.

        Raises:
            RobotError: it could not be sent.
        """
        self._send(codec.encode(node.node, messages.Reboot(_SAVE)))

    def _endpoint(self, node: OdriveNode, setting: str) -> Endpoint:
        if self.endpoints is None:
            raise ValueError(
                "expected --endpoints with the file flat_endpoints.json of the drive's firmware: each firmware numbers "
                "its settings anew, and a wrong number would change another one"
            )
        if node.firmware != self.endpoints.firmware:
            raise ValueError(
                f"odrive {node.node}: expected firmware {self.endpoints.firmware}, as in the file of the endpoints, "
                f"got {node.firmware or 'no answer'}"
            )
        return self.endpoints.find(setting)

    def ask(self, node: OdriveNode) -> None:
        """Ask a drive for its values, and for its serial number once it has reported a version.

        Firmware 0.5, which tells none, would take the latter for an order to change its id.
        """
        if node.node == codec.BROADCAST:
            return  # it answers nothing but who it is
        for command in _VALUES:
            self._send(codec.request(node.node, command))
        if self._clock.wait(lambda: node.firmware, ANSWER_TIMEOUT):
            self._send(codec.request(node.node, Command.ADDRESS))
