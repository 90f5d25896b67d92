"""CANopen nodes on a bus: how they are recognised, and what they tell; drives of profile 402 tell the most."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport, Send
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.listener import ANSWER_TIMEOUT, Claim, Listener
from vrg.hal.clock import MonotonicClock
from vrg_drives.cia402 import codec
from vrg_drives.cia402.codec import Control, Function, Nmt, NmtCommand, Object
from vrg_drives.cia402.errors import describe_error
from vrg_drives.cia402.units import units

if TYPE_CHECKING:
    from vrg_drives.cia402.sdo import SdoClient

_TEXTS = (Object.NAME, Object.NAME + 1, Object.FIRMWARE)
"""The names of the device and the versions of its hardware and firmware, which CiA 301 has as texts."""
_NUMBER_BYTES = (1, 2, 4, 8)
_LISTEN = 0.45
"""s for which it is listened before all ids are written to: ODrives 48 to 51, which have these identifiers, have been
heard by then."""
_AT_ONCE, _PAUSE = 8, 0.005
"""Frames to all ids that are sent at once, and the s until the next ones."""
_NMT_BYTES = 2
"""The bytes of a network command."""
_WRITE_TIMEOUT = 2.0
"""s for a drive to save its settings."""
_FUNCTIONS = frozenset(Function) - {Function.NMT, Function.HEARTBEAT}
_GREETINGS = 2
"""Times that all ids are asked: a question may get lost, and more of them would fill the bus."""
_LASTING = (
    (Object.ENCODER_RESOLUTION, 1), (Object.ENCODER_RESOLUTION, 2), (Object.VELOCITY_UNIT, 0), (Object.FIRMWARE, 0),
    (Object.NAME, 0),
)  # fmt: skip
"""The objects that are read only once."""
_CHANGING = (
    (Object.IDENTITY, codec.SERIAL_NUMBER), (Object.STATUSWORD, 0), (Object.ERROR_CODE, 0), (Object.POSITION, 0),
    (Object.VELOCITY, 0), (Object.VOLTAGE, 0),
)  # fmt: skip
"""The objects that are read each time. The serial number does not change, but a second drive of the same id may have
joined."""


class CanopenNode(AxisReport):
    """The report of one node by its heartbeats and its answers by SDO. Only its master knows what is in its PDOs.

    A velocity whose unit it does not report is NaN.

    Args:
        node: its id. send: sends a question. clock: the time by which answers are waited for.

    Attributes:
        network: its state in the network; None while no heartbeat has been heard.
    """

    def __init__(self, node: int, send: Send, clock: MonotonicClock) -> None:
        super().__init__(node)
        self.network: int | None = None
        self._send, self._clock = send, clock
        self._client: SdoClient | None = None
        self._answers: dict[tuple[int, int], bytes | None] = {}

    @property
    def client(self) -> "SdoClient":
        """What asks it. canopen takes a while to load, and who only listens does without."""
        from vrg_drives.cia402.sdo import SdoClient  # noqa: PLC0415

        if self._client is None:
            self._client = SdoClient(self.node, self._send, self._clock)
        return self._client

    @property
    def words(self) -> str:
        """Its states in the network and, if it is a drive, as one."""
        words = "no heartbeat" if self.network is None else codec.NMT_WORDS[self.network]
        status = self._number(Object.STATUSWORD, size=2)
        if status is None:
            return words
        known = codec.drive_state(status)
        return f"{words}, {known.words if known else f'statusword 0x{status:04X}'}"

    @property
    def errors(self) -> str:
        """Its newest error code, in words."""
        return describe_error(self._number(Object.ERROR_CODE, size=2) or 0)

    def receive(self, frame: Frame) -> None:
        """Hear one of its frames."""
        function = frame.id & ~codec.NODE_MASK
        if function == Function.HEARTBEAT:
            self.heard, self.network = frame.at, frame.data[0] & 0x7F
        elif function == Function.SDO_ANSWER:
            self.heard = frame.at
            if codec.concerns(frame.data, Object.STATUSWORD):
                self._learn_status(codec.uploaded(frame.data), frame.at)
            if self._client is not None:
                self._client.hear(frame.data)
                self.serials |= {f"{serial:X}" for serial in self._client.serials}

    def _learn_status(self, status: int | None, at: float) -> None:
        """Take in its statusword; a node that has none is no drive."""
        self.is_drive = status is not None
        self._answers[Object.STATUSWORD, 0] = None if status is None else status.to_bytes(4, "little")
        self.on = None if status is None else codec.drive_state(status) in codec.POWERED
        self.reported_at = at

    def ask(self) -> None:
        """Ask it for its values. One that does not answer a question is not asked the next one."""
        from vrg_drives.cia402.sdo import NoAnswerError  # noqa: PLC0415

        if self.network == Nmt.STOPPED:
            return  # it answers no SDO
        try:
            for question in (*_CHANGING, *_LASTING):
                if question in _CHANGING or question not in self._answers:
                    self._answers[question] = self.client.read(*question, ANSWER_TIMEOUT)
        except NoAnswerError:
            pass
        self._learn()

    def _learn(self) -> None:
        """Put what it has answered into words and units."""
        millivolts = self._number(Object.VOLTAGE)
        self.voltage = None if millivolts is None else millivolts / 1000
        text = self._answers.get((Object.FIRMWARE, 0)) or self._answers.get((Object.NAME, 0)) or b""
        self.firmware = text.decode("ascii", "replace").strip("\0 ")
        counts, turns = (self._number(Object.ENCODER_RESOLUTION, sub) or 0 for sub in (1, 2))
        found = units(counts, turns, self._number(Object.VELOCITY_UNIT))
        position = self._number(Object.POSITION, signed=True)
        velocity = self._number(Object.VELOCITY, signed=True)
        if position is not None and counts and turns:
            self.position, self.measured = position * turns / counts, self.heard
        self.velocity = math.nan if velocity is None or found is None else found.turns_per_s(velocity)

    def _number(self, index: int, sub: int = 0, *, size: int = 4, signed: bool = False) -> int | None:
        data = self._answers.get((index, sub))
        return None if data is None else int.from_bytes(data[:size], "little", signed=signed)


class CanopenListener(Listener[CanopenNode]):
    """See `Listener`. A node is recognised by its heartbeat, or by its answer where it has none."""

    word = "cia402"
    title = "CANopen"
    node_type = CanopenNode

    def __init__(self, send: Send, clock: MonotonicClock) -> None:
        super().__init__(send, clock)
        self._greetings = 0
        self._speaks_at = clock.now() + _LISTEN

    def claim(self, frame: Frame) -> Claim:
        """A heartbeat is certainly one, as is an answer to a question for all, and every frame of a known node.

        A node that starts up tells one byte of zero, as orders of other protocols do.
        """
        number = frame.id & codec.NODE_MASK
        if frame.extended or frame.fd or frame.remote or not number:
            return Claim.NONE
        function = frame.id & ~codec.NODE_MASK
        if number in self.found and function in _FUNCTIONS:
            return Claim.CERTAIN
        if function == Function.HEARTBEAT and len(frame.data) == 1 and frame.data[0] & 0x7F in codec.NMT_WORDS:
            return Claim.CERTAIN if frame.data[0] or number in self.found else Claim.LIKELY
        asked = self._greetings and function == Function.SDO_ANSWER and codec.concerns(frame.data, Object.STATUSWORD)
        return Claim.CERTAIN if asked else Claim.NONE

    def owns(self, frame: Frame) -> bool:
        """True for a frame to or from a known node, or a network command."""
        if frame.extended or frame.fd or frame.remote or not self.found:
            return False
        if frame.id == Function.NMT:
            return len(frame.data) == _NMT_BYTES
        return frame.id & ~codec.NODE_MASK in set(Function) and frame.id & codec.NODE_MASK in self.found

    def hear(self, frame: Frame) -> None:
        """Take in a frame: heartbeats, and the answers to what was asked."""
        self._recognise(frame.id & codec.NODE_MASK, frame).receive(frame)

    def greet(self) -> None:
        """Ask all ids whether a drive is there that is on: some have no heartbeat."""
        if self._greetings < _GREETINGS and self._clock.now() >= self._speaks_at:
            self._greetings += 1
            self._send_all(codec.upload(number, Object.STATUSWORD) for number in codec.NODE_IDS)

    def _send_all(self, frames: Iterable[Frame]) -> None:
        """Send many frames, and leave others room on the bus.

        Raises:
            RobotError: one could not be sent.
        """
        for count, frame in enumerate(frames, 1):
            self._send(frame)
            if count % _AT_ONCE == 0:
                self._clock.sleep(_PAUSE)

    def ask(self, node: CanopenNode) -> None:
        """Ask a node for its values by SDO."""
        node.ask()

    def stop(self) -> None:
        """Disable the voltage of every drive, and let all nodes leave the state in which PDOs count.

        All ids are written to, as a drive may have no heartbeat, and go on without a master (0x6007).
        """
        for number in list(self.found):
            self._send(_switch_off(number), urgent=True)
        self._send(codec.nmt(0, NmtCommand.PRE_OPERATIONAL), urgent=True)
        if self._clock.now() >= self._speaks_at:
            self._send_all(map(_switch_off, codec.NODE_IDS))
        self._greetings = 0

    def clear(self, node: CanopenNode) -> None:
        """Send a fault reset, which is the rising edge of bit 7."""
        for word in (Control.DISABLE_VOLTAGE, Control.FAULT_RESET, Control.DISABLE_VOLTAGE):
            self._send(codec.download(node.node, Object.CONTROLWORD, word, 2))

    def read(self, node: CanopenNode, setting: str) -> str:
        """Return the value of an object of a drive, such as 0x6083 or 0x1401:05: a text, or an unsigned number.

        Raises:
            RobotError: there is no answer, or it refuses. ValueError: that is no object.
        """
        data = self._object(node, setting)
        text = data.decode("ascii", "replace").rstrip("\0 ")
        if _object_of(setting)[0] in _TEXTS or (len(data) not in _NUMBER_BYTES and text.isprintable()):
            return text
        return str(int.from_bytes(data, "little"))

    def write(self, node: CanopenNode, setting: str, value: str) -> None:
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

    def save(self, node: CanopenNode) -> None:
        """Let a drive keep all its settings (0x1010:01).

        Raises:
            RobotError: there is no answer, or it refuses.
        """
        self._write(node, Object.STORE, 1, codec.SAVE.to_bytes(4, "little"))

    def _object(self, node: CanopenNode, setting: str) -> bytes:
        data = node.client.read(*_object_of(setting), ANSWER_TIMEOUT)
        if data is None:
            raise RobotError(f"canopen {node.node}: it has no object {setting}, or does not report it")
        return data

    def _write(self, node: CanopenNode, index: int, sub: int, data: bytes) -> None:
        if not node.client.write(index, sub, data, _WRITE_TIMEOUT):
            raise RobotError(f"canopen {node.node}: it refuses 0x{index:04X}:{sub:02X}")


def _switch_off(number: int) -> Frame:
    return codec.download(number, Object.CONTROLWORD, Control.DISABLE_VOLTAGE, 2)


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
