"""The object dictionary of a drive, for canopen, with the defaults that the emulated drive comes with."""

from collections.abc import Sequence

from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable, datatypes

from vrg.hal.can.cia402.network import SYNC, Function
from vrg.hal.can.cia402.objects import (
    COB_ID,
    DEVICE_TYPE,
    ERRORS_KEPT,
    EVENT_TIMER,
    INHIBIT,
    NOT_VALID,
    PDOS,
    SERIAL,
    SUPPORTS_PROFILE_VELOCITY,
    TRANSMISSION,
    Object,
    mapping_entry,
)
from vrg.hal.can.cia402.units import INCREMENTS_PER_S

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
    for index, kind, access, default, mappable in (
        (Object.DEVICE_TYPE, u32, "ro", DEVICE_TYPE, False),
        (Object.ERROR_REGISTER, u8, "ro", 0, True),
        (Object.NAME, text, "const", "VRG emulated drive", False),
        (Object.FIRMWARE, text, "const", "1.0.0", False),
        (Object.HEARTBEAT_TIME, u16, "rw", 0, False),
        (Object.ERROR_CODE, u16, "ro", 0, True),
        (Object.CONTROLWORD, u16, "rw", 0, True),
        (Object.STATUSWORD, u16, "ro", 0, True),
        (Object.SYNC_COB_ID, u32, "rw", SYNC, False),
        (Object.EMCY_COB_ID, u32, "rw", Function.EMCY | node, False),
        (Object.ABORT_CONNECTION_OPTION, i16, "rw", 1, False),
        (Object.QUICK_STOP_OPTION, i16, "ro", 2, False),
        (Object.SHUTDOWN_OPTION, i16, "ro", 0, False),
        (Object.HALT_OPTION, i16, "ro", 1, False),
        (Object.FAULT_REACTION, i16, "rw", 0, False),
        (Object.MODE, i8, "rw", 0, True),
        (Object.MODE_DISPLAY, i8, "ro", 0, True),
        (Object.POSITION, i32, "ro", 0, True),
        (Object.VELOCITY, i32, "ro", 0, True),
        (Object.VELOCITY_DEMAND, i32, "ro", 0, True),
        (Object.TORQUE, i16, "ro", 0, True),
        (Object.MOTOR_SPEED_LIMIT, u32, "rw", 60 * 120, False),
        (Object.VOLTAGE, u32, "ro", 0, True),
        (Object.ACCELERATION, u32, "rw", ramp, True),
        (Object.DECELERATION, u32, "rw", ramp, True),
        (Object.QUICK_STOP_DECELERATION, u32, "rw", ramp, True),
        (Object.VELOCITY_UNIT, u32, "ro", INCREMENTS_PER_S, False),
        (Object.TARGET_VELOCITY, i32, "rw", 0, True),
        (Object.SUPPORTED_MODES, u32, "ro", SUPPORTS_PROFILE_VELOCITY, False),
    ):
        objects.add_object(_variable(index.name, index, 0, kind, access, default, mappable))
    counts, one = ENCODER_COUNTS, 1
    _record(objects, Object.IDENTITY, [(1, u32, "ro", 0), (2, u32, "ro", 1), (3, u32, "ro", 1), (SERIAL, u32, "ro", 0)])
    _record(objects, Object.STORE, [(1, u32, "rw", 1)])
    _record(objects, Object.CONSUMER_HEARTBEAT, [(1, u32, "rw", 0)])
    _record(objects, Object.ERROR_BEHAVIOUR, [(1, u8, "rw", 0)])
    history = [(sub, u32, "ro", 0) for sub in range(1, ERRORS_KEPT + 1)]
    _record(objects, Object.ERROR_HISTORY, history, count=0, count_access="rw")
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
