"""The object dictionary of an emulated drive with its values, and the SDO server that gives them to masters."""

import struct
from collections.abc import Callable, Sequence
from typing import Any

import can
from canopen import objectdictionary
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable, datatypes
from canopen.sdo.exceptions import SdoAbortedError
from canopen.sdo.server import SdoServer

from vrg.hal.can.frame import Frame
from vrg_drives.cia402 import codec
from vrg_drives.cia402.codec import Function, Object
from vrg_drives.cia402.units import INCREMENTS_PER_S

NO_OBJECT, NO_SUB, WRITE_ONLY, READ_ONLY = 0x0602_0000, 0x0609_0011, 0x0601_0001, 0x0601_0002
NOT_MAPPABLE, PDO_TOO_LONG, WRONG_LENGTH = 0x0604_0041, 0x0604_0042, 0x0607_0010
BAD_VALUE, NOT_NOW, UNSUPPORTED, NOT_STORED = 0x0609_0030, 0x0800_0022, 0x0601_0000, 0x0800_0020
"""SDO abort codes (CiA 301)."""


ENCODER_COUNTS = 10_000
"""Counts of the emulated drive's encoder for one turn: 2500 lines, and each edge of both tracks counts."""
_ENTRIES = range(1, 9)
"""The sub-indices of a mapping. It is a record and not an array: canopen's masters ask for the length of an array
before they write the entries, and the right order has just set that to 0."""
_Member = tuple[int, int, str, int]
"""A member of a record: sub-index, data type, access, and value by default."""


def object_dictionary(node: int) -> ObjectDictionary:
    """The objects of a drive of this id.

    The PDOs are as CiA 402 has them by default: the first ones carry controlword and statusword, the others nothing.
    """
    u8, u16, u32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
    i8, i16, i32, text = datatypes.INTEGER8, datatypes.INTEGER16, datatypes.INTEGER32, datatypes.VISIBLE_STRING
    objects = ObjectDictionary()  # type: ignore[no-untyped-call]
    ramp = 200 * ENCODER_COUNTS
    variables = (
        (Object.DEVICE_TYPE, u32, "ro", codec.DEVICE_TYPE, False), (Object.ERROR_REGISTER, u8, "ro", 0, True),
        (Object.NAME, text, "const", "VRG emulated drive", False), (Object.FIRMWARE, text, "const", "1.0.0", False),
        (Object.HEARTBEAT_TIME, u16, "rw", 0, False), (Object.ERROR_CODE, u16, "ro", 0, True),
        (Object.CONTROLWORD, u16, "rw", 0, True), (Object.STATUSWORD, u16, "ro", 0, True),
        (Object.ABORT_CONNECTION_OPTION, i16, "rw", 1, False), (Object.FAULT_REACTION, i16, "rw", 0, False),
        (Object.MODE, i8, "rw", 0, True), (Object.MODE_DISPLAY, i8, "ro", 0, True),
        (Object.POSITION, i32, "ro", 0, True), (Object.VELOCITY, i32, "ro", 0, True),
        (Object.VOLTAGE, u32, "ro", 0, True), (Object.ACCELERATION, u32, "rw", ramp, True),
        (Object.DECELERATION, u32, "rw", ramp, True), (Object.QUICK_STOP_DECELERATION, u32, "rw", ramp, True),
        (Object.VELOCITY_UNIT, u32, "ro", INCREMENTS_PER_S, False), (Object.TARGET_VELOCITY, i32, "rw", 0, True),
        (Object.SUPPORTED_MODES, u32, "ro", codec.SUPPORTS_PROFILE_VELOCITY, False),
    )  # fmt: skip
    for index, kind, access, default, mappable in variables:
        objects.add_object(_variable(index.name, index, 0, kind, access, default, mappable))
    identity = [(1, u32, "ro", 0), (2, u32, "ro", 1), (3, u32, "ro", 1), (codec.SERIAL_NUMBER, u32, "ro", 0)]
    _record(objects, Object.IDENTITY, identity)
    _record(objects, Object.STORE, [(1, u32, "rw", 1)])
    _record(objects, Object.CONSUMER_HEARTBEAT, [(1, u32, "rw", 0)])
    _record(objects, Object.ERROR_BEHAVIOUR, [(1, u8, "rw", 0)])
    _record(objects, Object.DIGITAL_OUTPUTS, [(1, u32, "rw", 0), (2, u32, "rw", 0)], mappable=True)
    _record(objects, Object.ENCODER_RESOLUTION, [(1, u32, "ro", ENCODER_COUNTS), (2, u32, "ro", 1)])
    for number in range(codec.PDOS):
        for communication, mapping, cob_id, first in (
            (Object.RPDO, Object.RPDO_MAPPING, Function.RPDO1, Object.CONTROLWORD),
            (Object.TPDO, Object.TPDO_MAPPING, Function.TPDO1, Object.STATUSWORD),
        ):
            identifier = (cob_id + 0x100 * number) | node | (codec.NOT_VALID if number else 0)
            settings = [(codec.COB_ID, u32, "rw", identifier), (codec.TRANSMISSION, u8, "rw", 255)]
            settings += [(codec.INHIBIT, u16, "rw", 0), (codec.EVENT_TIMER, u16, "rw", 0)]
            _record(objects, communication + number, settings)
            entries = [
                (sub, u32, "rw", codec.mapping_entry(first, 16) if sub == 1 and not number else 0) for sub in _ENTRIES
            ]
            _record(objects, mapping + number, entries, count=0 if number else 1)
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
    members: Sequence[_Member],
    count: int | None = None,
    *,
    mappable: bool = False,
) -> None:
    """Add a record, whose number of members is their highest sub-index, or `count`, which masters may write."""
    record = ODRecord(f"{index:04X}", index)
    most, access = (members[-1][0], "ro") if count is None else (count, "rw")
    record.add_member(_variable("count", index, 0, datatypes.UNSIGNED8, access, most))
    for sub, kind, access, default in members:
        record.add_member(_variable(f"{index:04X}:{sub:02X}", index, sub, kind, access, default, mappable))
    objects.add_object(record)


class Objects:
    """The drive's object dictionary with its values, as canopen's SDO server wants a node.

    Args:
        node: the drive's id.
        measured: gives the values of objects that are measured, None for the others.
        refused: gives the abort code of a write (index, sub-index, value) that is not allowed now, 0 for the others.
        wrote: called with every object that was written (index, sub-index, value).
    """

    def __init__(
        self,
        node: int,
        measured: Callable[[int], int | None],
        refused: Callable[[int, int, int], int],
        wrote: Callable[[int, int, int], None],
    ) -> None:
        self.object_dictionary = object_dictionary(node)
        self._measured = measured
        self._refused = refused
        self._wrote = wrote
        self._values: dict[tuple[int, int], int | str] = {}
        self._defaults: dict[tuple[int, int], Any] = {}

    def __getitem__(self, key: tuple[int, int]) -> Any:
        """The value of an object by index and sub-index."""
        for value in (self._measured(key[0]), self._values.get(key)):
            if value is not None:
                return value
        default = self._defaults.get(key)
        if default is None:
            default = self._defaults[key] = self.find(*key).default
        return default

    def setting(self, index: int, sub: int) -> int:
        """A number that is kept; 0 where the drive has no such object."""
        try:
            found: int = self[index, sub]
        except SdoAbortedError:
            return 0
        return found

    def __setitem__(self, key: tuple[int, int], value: int | str) -> None:
        self._values[key] = value

    def remove(self, index: int) -> None:
        """Be a drive that has no such object."""
        del self.object_dictionary[index]
        self._defaults.clear()

    def stored(self) -> dict[tuple[int, int], int | str]:
        """The values that a drive saves on request: those that can be written."""
        return {key: value for key, value in self._values.items() if self.find(*key).writable}

    def restore(self, stored: dict[tuple[int, int], int | str]) -> None:
        """Have saved values again."""
        self._values.update(stored)

    def find(self, index: int, sub: int) -> ODVariable:
        """The description of an object.

        Raises:
            SdoAbortedError: there is no such object.
        """
        if index not in self.object_dictionary:
            raise SdoAbortedError(NO_OBJECT)
        found = self.object_dictionary.get_variable(index, sub)
        if found is None or found.subindex != sub:
            raise SdoAbortedError(NO_SUB)
        return found

    def get_data(self, index: int, sub: int, check_readable: bool = False) -> bytes:
        """The value of an object as bytes; the SDO server calls this.

        Raises:
            SdoAbortedError: there is no such object, or it cannot be read.
        """
        variable = self.find(index, sub)
        if check_readable and not variable.readable:
            raise SdoAbortedError(WRITE_ONLY)
        return variable.encode_raw(self[index, sub])

    def set_data(self, index: int, sub: int, data: bytes, check_writable: bool = False) -> None:
        """Write an object; the SDO server calls this.

        Raises:
            SdoAbortedError: there is no such object, or it cannot be written so.
        """
        variable = self.find(index, sub)
        if check_writable and not variable.writable:
            raise SdoAbortedError(READ_ONLY)
        if variable.data_type in objectdictionary.NUMBER_TYPES and 8 * len(data) != len(variable):
            raise SdoAbortedError(WRONG_LENGTH)
        value: Any = variable.decode_raw(bytes(data))
        abort = self._refused(index, sub, value)
        if abort:
            raise SdoAbortedError(abort)
        self[index, sub] = value
        self._wrote(index, sub, value)


class ObjectServer:
    """Answers SDO requests by canopen's server.

    Args:
        node: the drive's id. objects: what is served.
    """

    def __init__(self, node: int, objects: Objects) -> None:
        self._outbox = _Outbox()
        self._server = _Server(node, objects, self._outbox)

    def answer(self, frame: Frame) -> list[Frame]:
        """The answers to a request of 8 bytes; none to one that makes no sense."""
        try:
            self._server.on_request(frame.id, bytearray(frame.data), 0.0)  # type: ignore[no-untyped-call]
        except (struct.error, can.CanError):
            self._outbox.take()
        return self._outbox.take()


class _Outbox:
    """The object that the SDO server uses in place of a network: it collects the answers."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []

    def send_message(self, can_id: int, data: bytes) -> None:
        """Keep one answer."""
        self._frames.append(Frame(can_id, bytes(data)))

    def take(self) -> list[Frame]:
        """All answers since the last call."""
        frames, self._frames = self._frames, []
        return frames


class _Server(SdoServer):
    """canopen's server, which takes it for granted that no transfer goes on before one has begun."""

    def __init__(self, node: int, objects: Objects, network: _Outbox) -> None:
        super().__init__(Function.SDO_REQUEST | node, Function.SDO_ANSWER | node, objects)  # type: ignore[no-untyped-call]
        self.network: Any = network
        self._index = self._subindex = 0
        self._buffer = bytearray()
