"""CANopen nodes on a bus: how they are recognised, and what they tell; drives of profile 402 tell the most."""

from typing import TYPE_CHECKING

from vrg.errors import RobotError
from vrg.hal.can.axis import Send
from vrg.hal.can.cia402.codec import (
    NMT_WORDS,
    NODE_MASK,
    POWERED,
    SAVE,
    SERIAL_NUMBER,
    Control,
    Function,
    Nmt,
    NmtCommand,
    Object,
    download,
    drive_state,
    nmt,
)
from vrg.hal.can.cia402.errors import describe_error
from vrg.hal.can.cia402.units import units
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.listener import ANSWER_TIMEOUT, Claim, Found, Listener
from vrg.hal.clock import Clock

if TYPE_CHECKING:
    from vrg.hal.can.cia402.sdo import SdoClient

_TEXTS = (Object.NAME, Object.NAME + 1, Object.FIRMWARE)
"""The names of the device and the versions of its hardware and firmware, which CiA 301 has as texts."""
_NUMBER_BYTES = (1, 2, 4, 8)
_WRITE_TIMEOUT = 2.0
"""s for a drive to save its settings."""
_FUNCTIONS = frozenset(Function) - {Function.NMT, Function.HEARTBEAT}
_LASTING = (
    (Object.ENCODER_RESOLUTION, 1),
    (Object.ENCODER_RESOLUTION, 2),
    (Object.VELOCITY_UNIT, 0),
    (Object.FIRMWARE, 0),
    (Object.NAME, 0),
)
"""The objects that are read only once."""
_CHANGING = (
    (Object.IDENTITY, SERIAL_NUMBER),
    (Object.STATUSWORD, 0),
    (Object.ERROR_CODE, 0),
    (Object.POSITION, 0),
    (Object.VELOCITY, 0),
    (Object.VOLTAGE, 0),
)
"""The objects that are read each time. The serial number does not change, but a second drive of the same id may have
joined."""


class CanopenListener(Listener):
    """See `Listener`. A node is recognised by its heartbeat, which hardly any frame of another protocol looks like."""

    word = "canopen"
    title = "CANopen"

    def __init__(self, send: Send, clock: Clock) -> None:
        super().__init__(send, clock)
        self._network: dict[int, int] = {}
        self._clients: dict[int, SdoClient] = {}
        self._answers: dict[int, dict[tuple[int, int], bytes | None]] = {}

    def claim(self, frame: Frame) -> Claim:
        """A heartbeat is certainly one, and so is every frame of a node that has sent one."""
        number = frame.id & NODE_MASK
        if frame.extended or frame.fd or frame.remote or not number:
            return Claim.NONE
        function = frame.id & ~NODE_MASK
        heartbeat = function == Function.HEARTBEAT and len(frame.data) == 1 and frame.data[0] & 0x7F in NMT_WORDS
        return Claim.CERTAIN if heartbeat or (function in _FUNCTIONS and number in self.found) else Claim.NONE

    def hear(self, frame: Frame) -> None:
        """Take in a frame: heartbeats, and the answers to what was asked."""
        number, function = frame.id & NODE_MASK, frame.id & ~NODE_MASK
        if function == Function.HEARTBEAT:
            node = self._recognise(number, frame)
            node.heard = frame.at
            self._network[number] = frame.data[0] & 0x7F
            self._tell(node)
        elif function == Function.SDO_ANSWER and number in self._clients:
            self._clients[number].hear(frame.data)

    def ask(self, node: Found) -> None:
        """Ask a node for its values by SDO. One that does not answer a question is not asked the next one."""
        from vrg.hal.can.cia402.sdo import NoAnswerError  # noqa: PLC0415

        if self._network[node.node] == Nmt.STOPPED:
            return  # it answers no SDO
        client = self._client(node)
        answers = self._answers.setdefault(node.node, {})
        try:
            for question in (*_CHANGING, *_LASTING):
                if question in _CHANGING or question not in answers:
                    answers[question] = client.read(*question, ANSWER_TIMEOUT)
        except NoAnswerError:
            pass
        self._tell(node)

    def stop(self) -> None:
        """Disable the voltage of every drive that is known, and let all nodes leave the state in which PDOs count.

        What a drive that has not been heard does then is set by its 0x6007. It is heard by its next heartbeat, and
        the next call then reaches it too.
        """
        for number in list(self.found):
            self._send(download(number, Object.CONTROLWORD, Control.DISABLE_VOLTAGE, 2), urgent=True)
        self._send(nmt(0, NmtCommand.PRE_OPERATIONAL), urgent=True)

    def clear(self, node: Found) -> None:
        """Send a fault reset, which is the rising edge of bit 7."""
        for word in (Control.DISABLE_VOLTAGE, Control.FAULT_RESET, Control.DISABLE_VOLTAGE):
            self._send(download(node.node, Object.CONTROLWORD, word, 2))

    def read(self, node: Found, setting: str) -> str:
        """Return the value of an object of a drive, such as 0x6083 or 0x1401:05: a text, or an unsigned number.

        Raises:
            RobotError: there is no answer, or it refuses. ValueError: that is no object.
        """
        data = self._object(node, setting)
        text = data.decode("ascii", "replace").rstrip("\0 ")
        if _object_of(setting)[0] in _TEXTS or (len(data) not in _NUMBER_BYTES and text.isprintable()):
            return text
        return str(int.from_bytes(data, "little"))

    def write(self, node: Found, setting: str, value: str) -> None:
        """Change an object to a whole number.

        Raises:
            RobotError: there is no answer, or it refuses. ValueError: that is no object, or no value of it.
        """
        size = len(self._object(node, setting))
        number = int(value, 0)
        if not -(1 << 8 * size - 1) <= number < 1 << 8 * size:
            raise ValueError(f"{setting}: expected a number of {size} bytes, got {value}")
        data = (number % (1 << 8 * size)).to_bytes(size, "little")
        self._write(node, *_object_of(setting), data)

    def save(self, node: Found) -> None:
        """Let a drive keep all its settings (0x1010:01).

        Raises:
            RobotError: there is no answer, or it refuses.
        """
        self._write(node, Object.STORE, 1, SAVE.to_bytes(4, "little"))

    def _object(self, node: Found, setting: str) -> bytes:
        data = self._client(node).read(*_object_of(setting), ANSWER_TIMEOUT)
        if data is None:
            raise RobotError(f"canopen {node.node}: it has no object {setting}, or does not tell it")
        return data

    def _write(self, node: Found, index: int, sub: int, data: bytes) -> None:
        if not self._client(node).write(index, sub, data, _WRITE_TIMEOUT):
            raise RobotError(f"canopen {node.node}: it refuses 0x{index:04X}:{sub:02X}")

    def _client(self, node: Found) -> "SdoClient":
        # canopen takes a while to load, and who only listens does without.
        from vrg.hal.can.cia402.sdo import SdoClient  # noqa: PLC0415

        if node.node not in self._clients:
            self._clients[node.node] = SdoClient(node.node, self._send, self._clock)
        return self._clients[node.node]

    def _tell(self, node: Found) -> None:
        """Put what a node has answered into words and units."""
        answers = self._answers.get(node.node, {})

        def number(index: int, sub: int = 0, *, size: int = 4, signed: bool = False) -> int | None:
            data = answers.get((index, sub))
            return None if data is None else int.from_bytes(data[:size], "little", signed=signed)

        state = NMT_WORDS[self._network[node.node]]
        status, error = number(Object.STATUSWORD, size=2), number(Object.ERROR_CODE, size=2)
        millivolts = number(Object.VOLTAGE)
        if status is not None:
            known = drive_state(status)
            state += f", {known.words if known else f'statusword 0x{status:04X}'}"
            node.on = known in POWERED
        node.state = state
        node.errors = describe_error(error or 0)
        node.voltage = None if millivolts is None else millivolts / 1000
        if node.node in self._clients:
            node.serials = tuple(f"{serial:X}" for serial in sorted(self._clients[node.node].serials))
        text = answers.get((Object.FIRMWARE, 0)) or answers.get((Object.NAME, 0)) or b""
        node.firmware = text.decode("ascii", "replace").strip("\0 ")
        counts, turns = (number(Object.ENCODER_RESOLUTION, sub) or 0 for sub in (1, 2))
        found = units(counts, turns, number(Object.VELOCITY_UNIT))
        position, velocity = number(Object.POSITION, signed=True), number(Object.VELOCITY, signed=True)
        if position is not None and counts and turns:
            node.position = position * turns / counts
        if velocity is not None and found is not None:
            node.velocity = found.turns_per_s(velocity)


def _object_of(text: str) -> tuple[int, int]:
    """The index and sub-index that people write as 0x6083 or 0x1401:05.

    Raises:
        ValueError: it is neither.
    """
    index, _, sub = text.partition(":")
    try:
        found = int(index, 16), int(sub or "0", 16)
    except ValueError:
        found = -1, -1
    if not (0 < found[0] <= 0xFFFF and 0 <= found[1] <= 0xFF):
        raise ValueError(f"expected an object such as 0x6083 or 0x1401:05, got {text!r}")
    return found
