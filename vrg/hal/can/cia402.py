"""CiA 402 over CANopen: the objects that are used, their units, states and error codes. Pure.

Sources: CiA 301 (application layer: NMT, SDO, PDO, EMCY) and CiA 402-2 / IEC 61800-7-201 (drives). Object numbers are
theirs, written `0x1401:05` for index and sub-index. All values are little-endian.

The mode of operation is profile velocity (3), not cyclic synchronous velocity (9): a setpoint of mode 3 counts from the
moment that it arrives, while mode 9 wants SYNC frames at a fixed period and interpolates between them, which a player
in Python cannot promise, and which many drives on CAN lack. The drive's own ramps (0x6083, 0x6084) limit what a
setpoint may do; they belong to whoever has put the drive into service, and are left alone here.
"""

import enum
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from vrg.hal.can.frame import Frame, FrameError

if TYPE_CHECKING:
    from canopen.objectdictionary import ObjectDictionary, ODVariable

NODES = range(1, 128)
"""Ids that a drive can have."""
PROFILE = 402
"""The low half of the device type, 0x1000."""
DEVICE_TYPE = 0x00020192
"""A servo drive of profile 402."""
PROFILE_VELOCITY = 3
SUPPORTS_PROFILE_VELOCITY = 1 << (PROFILE_VELOCITY - 1)
"""In the supported modes, 0x6502."""


class Object(enum.IntEnum):
    """Indices."""

    DEVICE_TYPE = 0x1000
    ERROR_REGISTER = 0x1001
    NAME = 0x1008
    FIRMWARE = 0x100A
    HEARTBEAT_TIME = 0x1017
    IDENTITY = 0x1018
    RPDO = 0x1400
    RPDO_MAPPING = 0x1600
    TPDO = 0x1800
    TPDO_MAPPING = 0x1A00
    ERROR_CODE = 0x603F
    CONTROLWORD = 0x6040
    STATUSWORD = 0x6041
    QUICK_STOP_OPTION = 0x605A
    FAULT_REACTION = 0x605E
    MODE = 0x6060
    MODE_DISPLAY = 0x6061
    POSITION = 0x6064
    VELOCITY = 0x606C
    VOLTAGE = 0x6079
    ACCELERATION = 0x6083
    DECELERATION = 0x6084
    QUICK_STOP_DECELERATION = 0x6085
    ENCODER_RESOLUTION = 0x608F
    VELOCITY_UNIT = 0x60A9
    TARGET_VELOCITY = 0x60FF
    SUPPORTED_MODES = 0x6502


SERIAL = 4
"""Sub-index of the serial number in 0x1018."""
COB_ID, TRANSMISSION, INHIBIT, EVENT_TIMER = 1, 2, 3, 5
"""Sub-indices of 0x1400 and 0x1800; the inhibit time is in 0.1 ms, the event timer in ms."""
PDOS = 4
"""Of each direction."""


class Function(enum.IntEnum):
    """What an identifier is for: all but its low seven bits, which are the node (the pre-defined connection set)."""

    NMT = 0x000
    EMCY = 0x080
    TPDO1 = 0x180
    RPDO1 = 0x200
    TPDO2 = 0x280
    RPDO2 = 0x300
    TPDO3 = 0x380
    RPDO3 = 0x400
    TPDO4 = 0x480
    RPDO4 = 0x500
    SDO_ANSWER = 0x580
    SDO_REQUEST = 0x600
    HEARTBEAT = 0x700


SYNC = 0x080
"""Identifier; the EMCY of node 0, which is nobody."""
NODE_MASK = 0x7F


class Nmt(enum.IntEnum):
    """What a heartbeat says."""

    BOOTED = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


NMT_WORDS: dict[int, str] = {
    Nmt.BOOTED: "booting",
    Nmt.STOPPED: "stopped",
    Nmt.OPERATIONAL: "operational",
    Nmt.PRE_OPERATIONAL: "pre-operational",
}


class NmtCommand(enum.IntEnum):
    """The first byte of a frame of identifier 0; the second is the node, 0 for all."""

    START = 1
    STOP = 2
    PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


class DriveState(enum.Enum):
    """The state machine of CiA 402: bits of the statusword that count, and what they are then."""

    NOT_READY_TO_SWITCH_ON = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """As people write it."""
        return self.name.lower().replace("_", " ")


def drive_state(statusword: int) -> DriveState | None:
    """The state that a statusword tells; None for a combination of bits that stands for none."""
    return next((state for state in DriveState if statusword & state.value[0] == state.value[1]), None)


class Control(enum.IntEnum):
    """Controlwords."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80
    HALT = 0x100


RPDO_TIMEOUT = 0x8250
"""Error code: no frame of a RPDO has come within its event timer (0x1400:05), the drive's watchdog."""
STO = 0xFF01
"""Error code of the emulated drive's safe torque off, an emergency stop at the drive. CiA 402 has no code for it, so
each maker takes one of its own range, 0xFF00 and up."""
STO_CODES = frozenset({STO})
"""Error codes that mean an emergency stop at the drive; a real drive's stands in its manual."""

_ERRORS = {
    0x1000: "generic error",
    0x2110: "short circuit or earth leakage at the input",
    0x2211: "overcurrent in the device",
    0x2220: "continuous overcurrent in the device",
    0x2310: "continuous overcurrent at the output",
    0x2311: "overcurrent at the output",
    0x2320: "short circuit or earth leakage at the output",
    0x2340: "short circuit in the motor",
    0x2350: "load level too high (I2t)",
    0x3110: "mains overvoltage",
    0x3120: "mains undervoltage",
    0x3130: "phase failure",
    0x3210: "DC link overvoltage",
    0x3220: "DC link undervoltage",
    0x3310: "output overvoltage",
    0x4110: "ambient temperature too high",
    0x4210: "device temperature too high",
    0x4220: "device temperature too low",
    0x4310: "drive temperature too high",
    0x4320: "drive temperature too low",
    0x5112: "low supply of the control electronics",
    0x5210: "measurement circuit",
    0x5430: "input stages",
    0x5441: "contactor",
    0x5530: "configuration memory",
    0x6010: "software reset: the drive's own watchdog",
    0x6100: "internal software",
    0x6320: "parameter error",
    0x7110: "brake chopper",
    0x7121: "motor blocked",
    0x7122: "motor error or commutation malfunction",
    0x7300: "position sensor",
    0x7305: "incremental encoder 1",
    0x7310: "speed sensor",
    0x7380: "position sensor calibration",
    0x7500: "communication inside the device",
    0x8100: "communication",
    0x8110: "CAN overrun: frames were lost",
    0x8120: "CAN error-passive",
    0x8130: "no heartbeat of the master",
    0x8140: "recovered from bus-off",
    0x8150: "another node uses its identifier",
    0x8210: "a PDO was too short",
    0x8220: "a PDO was too long",
    0x8250: "no setpoint came in time",
    0x8311: "torque too high",
    0x8400: "velocity controller",
    0x8480: "velocity too high",
    0x8500: "position controller",
    0x8611: "following error",
    0x8612: "position limit",
    0x8A00: "positioning",
    STO: "safe torque off",
}  # fmt: skip
_CLASSES = {
    0x10: "generic error", 0x20: "current", 0x21: "current at the input", 0x22: "current in the device",
    0x23: "current at the output", 0x30: "voltage", 0x31: "mains voltage", 0x32: "DC link voltage",
    0x33: "output voltage", 0x40: "temperature", 0x41: "ambient temperature", 0x42: "device temperature",
    0x43: "drive temperature", 0x50: "device hardware", 0x60: "device software", 0x61: "internal software",
    0x62: "user software", 0x63: "data set", 0x70: "additional modules", 0x71: "power", 0x72: "measurement circuit",
    0x73: "sensor", 0x80: "monitoring", 0x81: "communication", 0x82: "protocol", 0x83: "torque control",
    0x84: "velocity control", 0x85: "position control", 0x86: "positioning", 0x90: "external error",
    0xF0: "additional functions", 0xFF: "the maker's own",
}  # fmt: skip
"""By the high byte of an error code, for codes that are not in the table."""


def describe_error(code: int) -> str:
    """An error code (0x603F, or an EMCY's) in words; empty for 0, which is none."""
    if not code:
        return ""
    words = _ERRORS.get(code) or _CLASSES.get(code >> 8) or _CLASSES.get(code >> 8 & 0xF0) or "unknown error"
    return f"{words} (0x{code:04X})"


def error_register(code: int) -> int:
    """The bits of 0x1001 that go with an error code."""
    kind = {2: 1 << 1, 3: 1 << 2, 4: 1 << 3, 0xF: 1 << 7}.get(code >> 12, 0)
    return 0 if not code else 1 | kind | (1 << 4 if code >> 8 in (0x81, 0x82) else 0)


class Units(NamedTuple):
    """What a drive's numbers mean.

    Args:
        counts: of the encoder for one turn of the shaft (0x608F). velocity: the drive's units in 1 turn/s (0x60A9).
    """

    counts: float
    velocity: float

    @property
    def wrap(self) -> float:
        """Turns after which the position, 32 bits, begins anew."""
        return 2**32 / self.counts

    def turns(self, counts: int) -> float:
        """Of the shaft."""
        return counts / self.counts

    def turns_per_s(self, velocity: int) -> float:
        """Of the shaft."""
        return velocity / self.velocity

    def velocity_of(self, turns_per_s: float) -> int:
        """As the drive wants it: the nearest that fits into 32 bits."""
        return round(max(-(2.0**31), min(2.0**31 - 1, turns_per_s * self.velocity)))


_REVOLUTIONS, _INCREMENTS, _MINUTES, _SECONDS = 0xB4, 0xB5, 0x47, 0x03
"""Codes of units (CiA 303-2)."""
INCREMENTS_PER_S = _INCREMENTS << 16 | _SECONDS << 8


def units(increments: int, revolutions: int, velocity_unit: int | None) -> Units | None:
    """The units by 0x608F:01, 0x608F:02 and 0x60A9; None where they make no sense.

    The velocity unit is increments/s where the drive has no 0x60A9, or says 0 there. Else its highest byte is a power
    of ten, and then come the codes of what is counted, revolutions or increments, and of the time, minutes or
    seconds: 0x00B44700 is 1/min, 0xFDB44700 0.001/min.
    """
    if increments <= 0 or revolutions <= 0:
        return None
    counts = increments / revolutions
    prefix, counted, time, rest = (velocity_unit or INCREMENTS_PER_S).to_bytes(4, "big")
    per_turn = {_REVOLUTIONS: 1.0, _INCREMENTS: counts}.get(counted)
    per_second = {_MINUTES: 60.0, _SECONDS: 1.0}.get(time)
    if per_turn is None or per_second is None or rest:
        return None
    return Units(counts, per_turn * per_second / 10.0 ** (prefix - 256 if prefix > 127 else prefix))


class Pdo(NamedTuple):
    """A PDO as this master maps it: `packing` is of `objects`, one after the other."""

    function: Function
    objects: tuple[Object, ...]
    packing: struct.Struct

    def frame(self, node: int, *values: int) -> Frame:
        """The frame that carries these values."""
        return Frame(self.function | node, self.packing.pack(*values))

    def values(self, data: bytes) -> tuple[int, ...]:
        """What a frame carries.

        Raises:
            FrameError: it is of another length.
        """
        if len(data) != self.packing.size:
            raise FrameError(f"{self.function.name}: expected {self.packing.size} bytes, got {len(data)}")
        return self.packing.unpack(data)


# Of the two that the drive hears, only the second has a deadline (0x1401:05), and only the player's thread ever sends
# it: whatever steps the state machine, by the first, feeds no watchdog. For the same reason the controlword, which is
# in every RPDO that drives come with, is not in the second: a setpoint enables nothing, and enabling is no setpoint.
CONTROL_PDO = Pdo(Function.RPDO1, (Object.CONTROLWORD,), struct.Struct("<H"))
SETPOINT_PDO = Pdo(Function.RPDO2, (Object.TARGET_VELOCITY,), struct.Struct("<i"))
STATUS_PDO = Pdo(Function.TPDO1, (Object.STATUSWORD, Object.ERROR_CODE, Object.MODE_DISPLAY), struct.Struct("<HHb"))
MOTION_PDO = Pdo(Function.TPDO2, (Object.POSITION, Object.VELOCITY), struct.Struct("<ii"))
SUPPLY_PDO = Pdo(Function.TPDO3, (Object.VOLTAGE,), struct.Struct("<I"))


def nmt(node: int, command: NmtCommand) -> Frame:
    """An NMT command to one node."""
    return Frame(Function.NMT, bytes([command, node]))


def upload_request(node: int, index: int, sub: int = 0) -> Frame:
    """Ask a node for an object by SDO."""
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB4x", 0x40, index, sub))


def download_request(node: int, index: int, sub: int, data: bytes) -> Frame:
    """Write an object of up to 4 bytes by SDO."""
    command = 0x23 | (4 - len(data)) << 2
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB", command, index, sub) + data.ljust(4, b"\0"))


class Answer(NamedTuple):
    """What a node says of an object: its bytes, None where it has refused or has more to say than fits one frame."""

    object: int
    sub: int
    data: bytes | None

    @property
    def unsigned(self) -> int | None:
        """As a number."""
        return None if self.data is None else int.from_bytes(self.data, "little")

    @property
    def signed(self) -> int | None:
        """As a number."""
        return None if self.data is None else int.from_bytes(self.data, "little", signed=True)


def answer(data: bytes) -> Answer | None:
    """The answer to an SDO request; None for what begins none."""
    if len(data) != 8:
        return None
    command, index, sub = struct.unpack_from("<BHB", data)
    if command & 0xE2 == 0x42:
        size = 4 - (command >> 2 & 3) if command & 1 else 4
        return Answer(index, sub, data[4 : 4 + size])
    return Answer(index, sub, b"" if command == 0x60 else None) if command & 0xE0 in (0x40, 0x60, 0x80) else None


_QUESTIONS = (
    (Object.DEVICE_TYPE, 0),
    (Object.HEARTBEAT_TIME, 0),
    (Object.SUPPORTED_MODES, 0),
    (Object.ENCODER_RESOLUTION, 1),
    (Object.ENCODER_RESOLUTION, 2),
    (Object.VELOCITY_UNIT, 0),
    (Object.IDENTITY, SERIAL),
)
"""One after the other, as a drive answers one at a time. The serial number is last: a second drive's answer to it is
waited for."""


class Interview:
    """What a drive says of itself, asked by single SDO frames: each answer lets the next question go out.

    The heartbeat's period is not asked but set, as drives come without one.

    Args:
        heartbeat: that period, ms.
    """

    def __init__(self, heartbeat: int) -> None:
        self._period = heartbeat
        self._answers: dict[tuple[int, int], Answer] = {}
        self._serials: list[int] = []
        self._serial_asked = 0

    @property
    def complete(self) -> bool:
        """Whether every question has its answer."""
        return all(question in self._answers for question in _QUESTIONS)

    @property
    def serial(self) -> str:
        """Number, in words; empty where there is none."""
        return f"{self._serials[0]:X}" if any(self._serials) else ""

    @property
    def units(self) -> Units | None:
        """None where they are not known, or make no sense."""
        increments, turns = (self._number(Object.ENCODER_RESOLUTION, sub) for sub in (1, 2))
        return units(increments or 0, turns or 0, self._number(Object.VELOCITY_UNIT))

    @property
    def problem(self) -> str | None:
        """Why this drive cannot be used, as far as it has answered."""
        return self._identity_problem or (self._ability_problem if self.complete else None)

    def next(self, node: int) -> list[Frame]:
        """The first question that has no answer yet."""
        question = next((question for question in _QUESTIONS if question not in self._answers), None)
        if question is None or self.problem:
            return []
        if question[0] == Object.HEARTBEAT_TIME:
            return [download_request(node, *question, self._period.to_bytes(2, "little"))]
        self._serial_asked += question[0] == Object.IDENTITY
        return [upload_request(node, *question)]

    def hear(self, data: bytes) -> bool:
        """Take in an SDO answer; whether it was new."""
        heard = answer(data)
        if heard is None or (heard.object, heard.sub) not in _QUESTIONS:
            return False
        if heard.object == Object.IDENTITY:
            self._serials.append(heard.unsigned or 0)
        new = (heard.object, heard.sub) not in self._answers
        self._answers.setdefault((heard.object, heard.sub), heard)
        return new

    @property
    def _identity_problem(self) -> str | None:
        serials = sorted(set(self._serials))
        if len(serials) > 1:
            return f"two drives have this id: serial numbers {serials[0]:X} and {serials[1]:X}; give one another id"
        if serials == [0] and len(self._serials) > self._serial_asked:
            return "two drives have this id, as both answer; give one another id"
        profile = (self._number(Object.DEVICE_TYPE) or 0) & 0xFFFF
        if (Object.DEVICE_TYPE, 0) in self._answers and profile != PROFILE:
            return f"expected a drive of profile {PROFILE} (device type, 0x1000), its profile is {profile}"
        return None

    @property
    def _ability_problem(self) -> str | None:
        modes = self._number(Object.SUPPORTED_MODES)
        if modes is not None and not modes & SUPPORTS_PROFILE_VELOCITY:
            return f"expected a drive with profile velocity mode, its modes (0x6502) are 0x{modes:X}"
        if self.units is None:
            counts, turns = (self._number(Object.ENCODER_RESOLUTION, sub) for sub in (1, 2))
            return (
                f"expected units of turns, its encoder resolution (0x608F) is {counts} for {turns} turns and its "
                f"velocity unit (0x60A9) 0x{self._number(Object.VELOCITY_UNIT) or 0:08X}"
            )
        return None

    def _number(self, index: int, sub: int = 0) -> int | None:
        heard = self._answers.get((index, sub))
        return None if heard is None else heard.unsigned


def object_dictionary(node: int) -> "ObjectDictionary":
    """The objects of a drive of this id, with the defaults that the emulated one comes with.

    The PDOs are as CiA 402 has them by default: the first carries controlword and statusword, the others of the drive's
    side nothing yet.
    """
    # canopen takes a while to load, and whoever only looks at frames does without.
    from canopen.objectdictionary import ObjectDictionary, datatypes  # noqa: PLC0415

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
        (Object.QUICK_STOP_OPTION, i16, "ro", 2, False),
        (Object.FAULT_REACTION, i16, "rw", 0, False),
        (Object.MODE, i8, "rw", 0, True),
        (Object.MODE_DISPLAY, i8, "ro", 0, True),
        (Object.POSITION, i32, "ro", 0, True),
        (Object.VELOCITY, i32, "ro", 0, True),
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


ENCODER_COUNTS = 10_000
"""For one turn, of the emulated drive: 2500 lines, each edge of both tracks counted."""
NOT_VALID = 1 << 31
"""In a COB-ID: this PDO is switched off."""
_ENTRIES = range(1, 9)
"""Sub-indices of a mapping. It is a record, not an array: canopen asks for the length of an array before it writes the
entries, and the right order has just set that to 0."""


def mapping_entry(index: int, bits: int, sub: int = 0) -> int:
    """An object in a PDO's mapping."""
    return index << 16 | sub << 8 | bits


def _variable(
    name: str, index: int, sub: int, kind: int, access: str, default: int | str, mappable: bool = False
) -> "ODVariable":
    from canopen.objectdictionary import ODVariable  # noqa: PLC0415

    variable = ODVariable(name, index, sub)
    variable.data_type, variable.access_type, variable.pdo_mappable = kind, access, mappable
    # canopen's annotation knows numbers alone, its code strings too.
    variable.default = default  # type: ignore[assignment]
    return variable


def _record(
    objects: "ObjectDictionary",
    index: int,
    members: Sequence[tuple[int, int, str, int]],
    count: int | None = None,
    count_access: str = "ro",
) -> None:
    from canopen.objectdictionary import ODRecord, datatypes  # noqa: PLC0415

    record = ODRecord(f"{index:04X}", index)
    count = members[-1][0] if count is None else count
    record.add_member(_variable("count", index, 0, datatypes.UNSIGNED8, count_access, count))
    for sub, kind, access, default in members:
        record.add_member(_variable(f"{index:04X}:{sub:02X}", index, sub, kind, access, default))
    objects.add_object(record)
