"""Reads and writes the objects of a drive: canopen's SDO client, on frames that another object receives."""

import contextlib
import logging
import queue
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import can
import canopen
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable, datatypes

from vrg.errors import RobotError
from vrg.hal.can.cia402.codec import (
    COB_ID,
    DEVICE_TYPE,
    ERRORS,
    EVENT_TIMER,
    INHIBIT,
    NOT_VALID,
    PDOS,
    SERIAL_NUMBER,
    SUPPORTS_PROFILE_VELOCITY,
    TRANSMISSION,
    Function,
    Object,
    mapping_entry,
)
from vrg.hal.can.cia402.units import INCREMENTS_PER_S
from vrg.hal.can.frame import Frame
from vrg.hal.clock import Clock

ENCODER_COUNTS = 10_000
"""Counts of the emulated drive's encoder for one turn: 2500 lines, and each edge of both tracks counts."""
_ENTRIES = range(1, 9)
"""The sub-indices of a mapping. It is a record and not an array: canopen asks for the length of an array before it
writes the entries, and the right order has just set that to 0."""


def object_dictionary(node: int) -> ObjectDictionary:
    """The objects of a drive of this id.

    The PDOs are as CiA 402 has them by default: the first ones carry controlword and statusword, the others nothing.
    """
    u8, u16, u32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
    i8, i16, i32, text = datatypes.INTEGER8, datatypes.INTEGER16, datatypes.INTEGER32, datatypes.VISIBLE_STRING
    objects = ObjectDictionary()  # type: ignore[no-untyped-call]
    ramp = 200 * ENCODER_COUNTS
    variables = (
        (Object.DEVICE_TYPE, u32, "ro", DEVICE_TYPE, False), (Object.ERROR_REGISTER, u8, "ro", 0, True),
        (Object.NAME, text, "const", "VRG emulated drive", False), (Object.FIRMWARE, text, "const", "1.0.0", False),
        (Object.HEARTBEAT_TIME, u16, "rw", 0, False), (Object.ERROR_CODE, u16, "ro", 0, True),
        (Object.CONTROLWORD, u16, "rw", 0, True), (Object.STATUSWORD, u16, "ro", 0, True),
        (Object.ABORT_CONNECTION_OPTION, i16, "rw", 1, False), (Object.FAULT_REACTION, i16, "rw", 0, False),
        (Object.MODE, i8, "rw", 0, True), (Object.MODE_DISPLAY, i8, "ro", 0, True),
        (Object.POSITION, i32, "ro", 0, True), (Object.VELOCITY, i32, "ro", 0, True),
        (Object.VOLTAGE, u32, "ro", 0, True), (Object.ACCELERATION, u32, "rw", ramp, True),
        (Object.DECELERATION, u32, "rw", ramp, True), (Object.QUICK_STOP_DECELERATION, u32, "rw", ramp, True),
        (Object.VELOCITY_UNIT, u32, "ro", INCREMENTS_PER_S, False), (Object.TARGET_VELOCITY, i32, "rw", 0, True),
        (Object.SUPPORTED_MODES, u32, "ro", SUPPORTS_PROFILE_VELOCITY, False),
    )  # fmt: skip
    for index, kind, access, default, mappable in variables:
        objects.add_object(_variable(index.name, index, 0, kind, access, default, mappable))
    counts, one = ENCODER_COUNTS, 1
    _record(
        objects,
        Object.IDENTITY,
        [(1, u32, "ro", 0), (2, u32, "ro", 1), (3, u32, "ro", 1), (SERIAL_NUMBER, u32, "ro", 0)],
    )
    history = [(sub, u32, "ro", 0) for sub in range(1, ERRORS + 1)]
    _record(objects, Object.ERROR_HISTORY, history, count=0, count_access="rw")
    _record(objects, Object.STORE, [(1, u32, "rw", 1)])
    _record(objects, Object.CONSUMER_HEARTBEAT, [(1, u32, "rw", 0)])
    _record(objects, Object.ERROR_BEHAVIOUR, [(1, u8, "rw", 0)])
    _record(objects, Object.ENCODER_RESOLUTION, [(1, u32, "ro", counts), (2, u32, "ro", one)])
    for number in range(PDOS):
        for communication, mapping, cob_id, first in (
            (Object.RPDO, Object.RPDO_MAPPING, Function.RPDO1, Object.CONTROLWORD),
            (Object.TPDO, Object.TPDO_MAPPING, Function.TPDO1, Object.STATUSWORD),
        ):
            identifier = (cob_id + 0x100 * number) | node | (NOT_VALID if number else 0)
            settings = [(COB_ID, u32, "rw", identifier), (TRANSMISSION, u8, "rw", 255)]
            settings += [(INHIBIT, u16, "rw", 0), (EVENT_TIMER, u16, "rw", 0)]
            _record(objects, communication + number, settings)
            entries = [(sub, u32, "rw", mapping_entry(first, 16) if sub == 1 and not number else 0) for sub in _ENTRIES]
            _record(objects, mapping + number, entries, count=0 if number else 1, count_access="rw")
    return objects


def _variable(
    name: str, index: int, sub: int, kind: int, access: str, default: int | str, mappable: bool = False
) -> ODVariable:
    variable = ODVariable(name, index, sub)
    variable.data_type, variable.access_type, variable.pdo_mappable = kind, access, mappable
    # canopen's annotation knows numbers alone, its code strings too.
    variable.default = default  # type: ignore[assignment]
    return variable


def _record(
    objects: ObjectDictionary,
    index: int,
    members: Sequence[tuple[int, int, str, int]],
    count: int | None = None,
    count_access: str = "ro",
) -> None:
    record = ODRecord(f"{index:04X}", index)
    count = members[-1][0] if count is None else count
    record.add_member(_variable("count", index, 0, datatypes.UNSIGNED8, count_access, count))
    for sub, kind, access, default in members:
        record.add_member(_variable(f"{index:04X}:{sub:02X}", index, sub, kind, access, default))
    objects.add_object(record)


# canopen logs the errors that it raises as well.
logging.getLogger("canopen").setLevel(logging.CRITICAL)

_SERIAL_ANSWER = struct.pack("<BHB", 0x43, Object.IDENTITY, SERIAL_NUMBER)
"""The first four bytes of the answer to the question for the serial number; the number itself follows."""
_BEGINS = (0x20, 0x40)
"""The first bytes of requests that name an object: a download and an upload."""


class NoAnswerError(RobotError):
    """A drive has not answered, or its answer makes no sense."""


class SdoClient:
    """The SDO client of one drive. The receiver of frames calls `hear` with its SDO answers, on another thread.

    canopen takes the first answer to a question for the only one. A second drive that has the same id by mistake gives
    another one, so the answers that tell a serial number are counted here as well.

    Args:
        node: the drive's id. send: sends a frame. clock: the time by which its answers are waited for.

    Attributes:
        remote: the drive as canopen has it. Use it only within `transfer`.
        serials: all serial numbers that were received. serial_answers: the number of answers with one.
        asking: a transfer is under way.
    """

    def __init__(self, node: int, send: Callable[[Frame], None], clock: Clock) -> None:
        self.serials: set[int] = set()
        self.serial_answers = 0
        self.asking = False
        self._answer = Function.SDO_ANSWER | node
        self._network = canopen.Network()
        self._sender = _Sender(send)
        self._network.bus = self._sender  # type: ignore[assignment]
        self.remote = canopen.RemoteNode(node, object_dictionary(node))
        self._network.add_node(self.remote)
        self._timeout = 0.0
        _wait_by(clock, self.remote, lambda: self._timeout)

    @property
    def asked(self) -> tuple[int, int]:
        """The object of the newest transfer."""
        return self._sender.asked

    def hear(self, data: bytes) -> None:
        """Take in the data of an SDO answer of the drive."""
        if data.startswith(_SERIAL_ANSWER) and len(data) == 8:
            self.serials.add(int.from_bytes(data[4:], "little"))
            self.serial_answers += 1
        # Answers to the questions of another master are not kept: they would never be taken.
        if self.asking:
            self._network.notify(self._answer, bytearray(data), 0.0)

    @contextmanager
    def transfer(self, timeout: float) -> Iterator[None]:
        """Let canopen ask within this block.

        Args:
            timeout: s to wait for each answer.

        Raises:
            NoAnswerError: the drive has not answered, or its answer makes no sense.
            canopen.SdoAbortedError: it has refused.
            RobotError: a question could not be sent.
        """
        self._timeout = max(1e-3, timeout)
        self.asking = True
        try:
            yield
        except (canopen.SdoCommunicationError, canopen.ObjectDictionaryError, struct.error) as error:
            raise NoAnswerError(str(error)) from None
        finally:
            self.asking = False

    def read(self, index: int, sub: int, timeout: float) -> bytes | None:
        """The value of an object, or None where the drive refuses to tell it: it may have no such object.

        Raises:
            NoAnswerError: the drive has not answered within `timeout` s, or its answer makes no sense.
            RobotError: the question could not be sent.
        """
        with self.transfer(timeout):
            try:
                return bytes(self.remote.sdo.upload(index, sub))
            except canopen.SdoAbortedError:
                return None

    def write(self, index: int, sub: int, data: bytes, timeout: float) -> bool:
        """Write an object; False where the drive refuses.

        Raises:
            NoAnswerError: the drive has not answered within `timeout` s, or its answer makes no sense.
            RobotError: the request could not be sent.
        """
        with self.transfer(timeout):
            try:
                self.remote.sdo.download(index, sub, data)
            except canopen.SdoAbortedError:
                return False
            return True


def _wait_by(clock: Clock, remote: canopen.RemoteNode, timeout: Callable[[], float]) -> None:
    """Let canopen's client wait for answers by a clock; by itself it waits in real time."""
    sdo = remote.sdo
    read_response = sdo.read_response
    sdo.RESPONSE_TIMEOUT = 0.0

    def wait_and_read() -> bytes:
        with contextlib.suppress(queue.Empty):
            sdo.responses.put(clock.take(sdo.responses, timeout()))
        return bytes(read_response())

    sdo.read_response = wait_and_read


class _Sender:
    """The object that canopen uses in place of python-can's bus: canopen calls one method of it."""

    def __init__(self, send: Callable[[Frame], None]) -> None:
        self._send = send
        self.asked = (0, 0)

    def send(self, message: can.Message) -> None:
        """Send now."""
        if message.data[0] & 0xE0 in _BEGINS:
            self.asked = (int.from_bytes(message.data[1:3], "little"), message.data[3])
        self._send(Frame(message.arbitration_id, bytes(message.data)))
