"""The firmware of an emulated Crazyflie: what it answers to packets of CRTP, and what it sends by itself.

Source: crazyflie-firmware 2026.08: crtpservice.c, platformservice.c, log.c, param_logic.c, crtp_mem.c,
crtp_commander_*.c, crtp_localization_service.c and crtp_supervisor.c.
"""

import errno
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from vrg_crazyflie.emulated.vehicle import Vehicle
from vrg_crazyflie.emulated.wire import (
    LOG_FORMATS,
    MOST,
    OFF,
    PARAM_FORMATS,
    READ_ONLY,
    VERSION,
    Contents,
    Entry,
    Packet,
    Port,
    packed,
    setpoint_of,
)

RELEASE: Final = "2026.08"
"""The release that it says it is."""
DEVICE: Final = "CF21"
"""The name of the Crazyflie 2.1 (platform_cf2.c)."""
BLOCKS, VARIABLES, BLOCK_BYTES = 16, 128, 26
"""The most log blocks, variables in them together, and bytes of one."""
TRAJECTORY_MEMORY, TRAJECTORY_BYTES = 0x12, 4096
"""The type and the size of the memory of trajectories, which can be written and read, but not flown."""

LOGGED: Final[dict[str, tuple[int, Callable[[Vehicle], float]]]] = {
    "stateEstimate.x": (7, lambda v: v.estimate[0]),
    "stateEstimate.y": (7, lambda v: v.estimate[1]),
    "stateEstimate.z": (7, lambda v: v.estimate[2]),
    "stateEstimate.vx": (7, lambda v: v.vx),
    "stateEstimate.vy": (7, lambda v: v.vy),
    "stateEstimate.vz": (7, lambda v: v.vz),
    "stateEstimate.roll": (7, lambda v: math.degrees(v.tilt)),
    "stateEstimate.pitch": (7, lambda _: 0.0),
    "stateEstimate.yaw": (7, lambda v: math.degrees(v.yaw)),
    "stateEstimateZ.rateYaw": (5, lambda v: v.w * 1000.0),
    "stabilizer.thrust": (7, lambda v: v.thrust),
    "supervisor.info": (2, lambda v: v.info),
    "pm.vbat": (7, lambda v: v.volts),
    "pm.state": (4, lambda v: v.power),
    "pm.batteryLevel": (1, lambda v: 100.0 * v.charge),
}
"""The types and the values of the log variables."""

SETTINGS: Final[dict[str, tuple[int, float]]] = {
    "stabilizer.stop": (0x08, 0),
    "stabilizer.estimator": (0x08, 2),
    "stabilizer.controller": (0x08, 1),
    "kalman.resetEstimation": (0x08, 0),
    "supervisor.tmblChckEn": (0x08, 1),
    "commander.enHighLevel": (0x08, 0),
    "pm.lowVoltage": (0x06, 3.2),
    "pm.criticalLowVoltage": (0x06, 3.0),
    "deck.bcFlow2": (0x08 | READ_ONLY, 1),
    "deck.bcLighthouse4": (0x08 | READ_ONLY, 0),
}
"""The types and the defaults of the parameters. The first, the fourth and those of the battery have an effect."""


@dataclass
class Block:
    """A log block: its variables with the types in which they are sent, and when it is next due, s."""

    variables: list[tuple[str, str]] = field(default_factory=list)
    period: float = 0.0
    due: float = math.inf

    @property
    def size(self) -> int:
        """The bytes of its values."""
        return sum(struct.calcsize(form) for _, form in self.variables)


class Firmware:
    """What runs on the body. Every packet is answered at once."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.log_contents = Contents(Entry(name, kind) for name, (kind, _) in LOGGED.items())
        self.param_contents = Contents(Entry(name, kind) for name, (kind, _) in SETTINGS.items())
        self.values = [value for _, value in SETTINGS.values()]
        self.blocks: dict[int, Block] = {}
        self.memory = bytearray(TRAJECTORY_BYTES)
        self._ports: dict[int, Callable[[int, bytes], bytes | None]] = {
            Port.LINK: self._link,
            Port.PLATFORM: self._platform,
            Port.LOG: self._log,
            Port.PARAM: self._param,
            Port.MEM: self._mem,
            Port.COMMANDER: self._commander,
            Port.GENERIC: self._generic,
            Port.HIGH_LEVEL: self._high_level,
            Port.LOCALIZATION: self._localization,
            Port.SUPERVISOR: self._supervisor,
        }

    def receive(self, packet: Packet) -> list[Packet]:
        """The answers to a packet. One that is cut short or unknown is ignored."""
        port, channel, data = packet
        handler = self._ports.get(port)
        if handler is None or not data:
            return []
        try:
            answer = handler(channel, data)
        except (struct.error, IndexError):
            return []
        return [] if answer is None else [(port, channel, answer[:MOST])]

    def due(self) -> list[Packet]:
        """The values of the log blocks that are due now."""
        found: list[Packet] = []
        for number, block in self.blocks.items():
            if self.vehicle.now >= block.due - 1e-9:
                block.due += block.period
                stamp = int(self.vehicle.now * 1000) & 0xFFFFFF
                values = b"".join(packed(form, LOGGED[name][1](self.vehicle)) for name, form in block.variables)
                found.append((Port.LOG, 2, bytes([number]) + stamp.to_bytes(3, "little") + values))
        return found

    def _link(self, channel: int, data: bytes) -> bytes | None:
        if channel == 1:
            return b"Bitcraze Crazyflie".ljust(MOST, b"\0")
        return data if channel == 0 else None

    def _platform(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0 and data[0] in (1, 2):  # arming and recovery, as before protocol version 12
            return data[:1] + self._asked(data[0], data[1:])
        if channel == 1:
            told = {0: struct.pack("<i", VERSION), 1: RELEASE.encode(), 2: DEVICE.encode()}
            return data[:1] + told[data[0]] if data[0] in told else None
        return None

    def _supervisor(self, channel: int, data: bytes) -> bytes | None:
        answered = bytes([data[0] | 0x80])
        if channel == 0:
            if data[0] == 0x0C:
                return answered + struct.pack("<H", self.vehicle.info)
            return answered + bytes([self.vehicle.info >> data[0] - 1 & 1]) if 1 <= data[0] <= 11 else None
        if data[0] in (1, 2):
            return answered + self._asked(data[0], data[1:])
        if data[0] in (3, 4):
            self._stop(watchdog=data[0] == 4)
        return None

    def _asked(self, command: int, data: bytes) -> bytes:
        """Arm, disarm or recover: whether that was granted, and whether it is armed, or not crashed."""
        supervisor = self.vehicle.supervisor
        if command == 1:
            granted = supervisor.arm(bool(data[0]))
            return bytes([granted, supervisor.armed])
        return bytes([supervisor.recover(), not supervisor.crashed])

    def _stop(self, *, watchdog: bool) -> None:
        if watchdog:
            self.vehicle.supervisor.notify(self.vehicle.now)
        else:
            self.vehicle.supervisor.emergency = True

    def _localization(self, channel: int, data: bytes) -> bytes | None:
        if channel == 1 and data[0] in (3, 4):  # the emergency stop, as before protocol version 12
            self._stop(watchdog=data[0] == 4)
        elif channel == 0:  # a position that somebody else has measured, which the estimator takes over at once
            seen = struct.unpack("<fff", data[:12])
            vehicle = self.vehicle
            vehicle.error = [a - b for a, b in zip(seen, (vehicle.x, vehicle.y, vehicle.z), strict=True)]
        return None

    def _commander(self, _: int, data: bytes) -> bytes | None:
        # Of roll, pitch, yaw rate and thrust only a thrust of 0 is emulated: cflib sends it as it closes a link.
        if struct.unpack("<fffH", data[:14])[3] == 0:
            self.vehicle.command(OFF)
        return None

    def _generic(self, channel: int, data: bytes) -> bytes | None:
        if channel == 1 and data[0] == 0:
            self.vehicle.relax()
        elif channel == 0 and (told := setpoint_of(data)) is not None:
            self.vehicle.command(told)
        return None

    def _high_level(self, _: int, data: bytes) -> bytes | None:
        done, vehicle = errno.ENOEXEC, self.vehicle
        x, y, z = vehicle.estimate
        if data[0] == 3:
            vehicle.halt()
            done = 0
        elif data[0] in (7, 8):  # take off, land
            _, _, height, yaw, keep, duration = struct.unpack("<BBff?f", data[:15])
            end = (x, y, height, vehicle.yaw if keep else yaw)
            done = 0 if vehicle.fly_to(end, duration) else errno.EBUSY
        elif data[0] in (4, 12):  # go to; the newer one can also go straight
            relative = bool(data[2])
            gx, gy, gz, yaw, duration = struct.unpack("<fffff", data[3 if data[0] == 4 else 4 :][:20])
            end = (x + gx, y + gy, z + gz, vehicle.yaw + yaw) if relative else (gx, gy, gz, yaw)
            done = 0 if vehicle.fly_to(end, duration) else errno.EBUSY
        return data[:3].ljust(3, b"\0") + bytes([done])

    def _log(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0:
            return self.log_contents.answer(data, bytes([BLOCKS, VARIABLES]))
        if channel != 1:
            return None
        number = data[1] if len(data) > 1 else 0
        return bytes([data[0], number, self._log_command(data[0], number, data[2:])])

    def _log_command(self, command: int, number: int, data: bytes) -> int:
        """Do what is asked about a log block, and return 0 or the reason why not."""
        if command == 5:  # reset
            self.blocks.clear()
            return 0
        if command == 6 and (number in self.blocks or len(self.blocks) >= BLOCKS):
            return errno.EEXIST if number in self.blocks else errno.ENOMEM
        block = self.blocks.setdefault(number, Block()) if command == 6 else self.blocks.get(number)
        if block is None:
            return errno.ENOENT
        match command:
            case 6 | 7:  # create, append
                return self._append(block, data)
            case 2:  # delete
                del self.blocks[number]
            case 3 | 8:  # start, with a period in hundredths or thousandths of a second
                period = data[0] / 100.0 if command == 3 else struct.unpack("<H", data[:2])[0] / 1000.0
                block.period, block.due = (period or math.inf), self.vehicle.now + period
            case 4:  # stop
                block.due = math.inf
            case _:
                return errno.ENOEXEC
        return 0

    def _append(self, block: Block, data: bytes) -> int:
        for kind, number in struct.iter_unpack("<BH", data[: len(data) // 3 * 3]):
            if number >= len(LOGGED) or kind & 0x0F not in LOG_FORMATS:
                return errno.ENOENT
            variable = self.log_contents.entries[number].name, LOG_FORMATS[kind & 0x0F]
            if block.size + struct.calcsize(variable[1]) > BLOCK_BYTES:
                return errno.E2BIG
            if sum(len(other.variables) for other in self.blocks.values()) >= VARIABLES:
                return errno.ENOMEM
            block.variables.append(variable)
        return 0

    def _param(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0:
            return self.param_contents.answer(data)
        misc = channel == 3
        number = struct.unpack_from("<H", data, int(misc))[0]
        if number >= len(self.values) or (misc and data[0] != 8):  # of the others, only the default value is emulated
            return data[: 2 + misc] + bytes([errno.ENOENT])
        entry = self.param_contents.entries[number]
        form = PARAM_FORMATS[entry.type & ~READ_ONLY]
        if channel != 2:
            value = SETTINGS[entry.name][1] if misc else self.values[number]
            return data[: 2 + misc] + b"\0" + packed(form, value)
        if entry.type & READ_ONLY:
            return None
        (self.values[number],) = struct.unpack_from(form, data, 2)
        self._effect(entry.name, self.values[number])
        return data

    def _effect(self, name: str, value: float) -> None:
        """Do what a parameter that was set is for."""
        vehicle = self.vehicle
        if name == "stabilizer.stop":
            vehicle.supervisor.emergency |= bool(value)
        elif name == "kalman.resetEstimation" and value:
            vehicle.error = [-vehicle.x, -vehicle.y, 0.0]
        elif name == "pm.lowVoltage":
            vehicle.low_voltage = value
        elif name == "pm.criticalLowVoltage":
            vehicle.critical_voltage = value

    def _mem(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0:
            if data[0] == 1:
                return bytes([1, 1])
            if data[0] == 2 and data[1] == 0:
                return struct.pack("<BBBI", 2, 0, TRAJECTORY_MEMORY, TRAJECTORY_BYTES) + bytes(8)
            return data[:2] if data[0] == 2 else None
        number, address = struct.unpack_from("<BI", data)
        size = data[5] if channel == 1 else len(data) - 5
        if number != 0 or address + size > TRAJECTORY_BYTES or size > MOST - 6:
            return data[:5] + bytes([errno.EIO])
        if channel == 1:
            return data[:5] + b"\0" + bytes(self.memory[address : address + size])
        self.memory[address : address + size] = data[5:]
        return data[:5] + b"\0"
