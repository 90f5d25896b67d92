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

from vrg_crazyflie.emulated import wire
from vrg_crazyflie.emulated.vehicle import Vehicle
from vrg_crazyflie.emulated.wire import Contents, Packet

RELEASE, DEVICE = "2026.08", "CF21"
"""The release that it says it is, and the name of the Crazyflie 2.1 (platform_cf2.c)."""
BLOCKS, VARIABLES, BLOCK_BYTES = 16, 128, 26
"""What the firmware says are the most log blocks, and variables in them together; and the most bytes of one."""
LOGGED: Final[dict[str, tuple[int, Callable[[Vehicle], float]]]] = {
    "stateEstimate.x": (7, lambda v: v.estimate[0]), "stateEstimate.y": (7, lambda v: v.estimate[1]),
    "stateEstimate.z": (7, lambda v: v.estimate[2]), "stateEstimate.yaw": (7, lambda v: math.degrees(v.yaw)),
    "stateEstimate.vx": (7, lambda v: v.vx), "stateEstimate.vy": (7, lambda v: v.vy),
    "stateEstimate.roll": (7, lambda v: math.degrees(v.tilt)), "stateEstimateZ.rateYaw": (5, lambda v: v.w * 1000.0),
    "stabilizer.thrust": (7, lambda v: v.thrust), "supervisor.info": (2, lambda v: v.info),
    "pm.vbat": (7, lambda v: v.volts), "pm.state": (4, lambda v: v.power),
    "pm.batteryLevel": (1, lambda v: 100.0 * v.charge),
}  # fmt: skip
"""The types and the values of the log variables."""

SETTINGS: Final[dict[str, tuple[int, float]]] = {
    "stabilizer.stop": (0x08, 0),
    "stabilizer.estimator": (0x08, 2),
    "kalman.resetEstimation": (0x08, 0),
    "pm.lowVoltage": (0x06, 3.2),
    "deck.bcFlow2": (0x08 | wire.READ_ONLY, 1),
}
"""The types and the defaults of the parameters. Of those that can be set, the estimator's kind has no effect."""


@dataclass
class Block:
    """A log block: its variables with the types in which they are sent, and when it is next due, s."""

    variables: list[tuple[str, str]] = field(default_factory=list)
    period: float = 0.0
    due: float = math.inf


class Firmware:
    """What runs on the body. Every packet is answered at once."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.log_contents = Contents({name: kind for name, (kind, _) in LOGGED.items()})
        self.param_contents = Contents({name: kind for name, (kind, _) in SETTINGS.items()})
        self.values = [value for _, value in SETTINGS.values()]
        self.blocks: dict[int, Block] = {}
        self._ports: dict[int, Callable[[int, bytes], bytes | None]] = {
            wire.LINK: self._link, wire.PLATFORM: self._platform, wire.SUPERVISOR: self._supervisor,
            wire.LOG: self._log, wire.PARAM: self._param, wire.MEM: self._mem,
            wire.COMMANDER: self._commander, wire.GENERIC: self._generic, wire.HIGH_LEVEL: self._high_level,
            wire.LOCALIZATION: self._localization,
        }  # fmt: skip

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
        return [] if answer is None else [(port, channel, answer[: wire.MOST])]

    def due(self) -> list[Packet]:
        """The values of the log blocks that are due now."""
        found: list[Packet] = []
        for number, block in self.blocks.items():
            if self.vehicle.now >= block.due - 1e-9:
                block.due += block.period
                stamp = int(self.vehicle.now * 1000) & 0xFFFFFF
                values = b"".join(wire.packed(form, LOGGED[name][1](self.vehicle)) for name, form in block.variables)
                found.append((wire.LOG, 2, bytes([number]) + stamp.to_bytes(3, "little") + values))
        return found

    def _link(self, channel: int, data: bytes) -> bytes | None:
        if channel == 1:
            return b"Bitcraze Crazyflie".ljust(wire.MOST, b"\0")
        return data if channel == 0 else None

    def _platform(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0 and data[0] in (1, 2):  # as before protocol version 12
            return data[:1] + self._asked(data[0], data[1:])
        told = {0: struct.pack("<i", wire.VERSION), 1: RELEASE.encode(), 2: DEVICE.encode()}
        return data[:1] + told[data[0]] if channel == 1 and data[0] in told else None

    def _supervisor(self, channel: int, data: bytes) -> bytes | None:
        answered, info = bytes([data[0] | 0x80]), self.vehicle.info
        if channel == 1:
            self._stop(data[0])
            return answered + self._asked(data[0], data[1:]) if data[0] in (1, 2) else None
        if data[0] == 0x0C:
            return answered + struct.pack("<H", info)
        return answered + bytes([info >> data[0] - 1 & 1]) if 1 <= data[0] <= 11 else None

    def _asked(self, command: int, data: bytes) -> bytes:
        """Arm or disarm, or recover: whether that was granted, and whether it is armed, or not crashed."""
        supervisor = self.vehicle.supervisor
        if command == 1:
            return bytes([supervisor.arm(bool(data[0])), supervisor.armed])
        return bytes([supervisor.recover(), not supervisor.crashed])

    def _stop(self, command: int) -> None:
        """Do an emergency stop, or notify its watchdog."""
        if command == 3:
            self.vehicle.supervisor.emergency = True
        elif command == 4:
            self.vehicle.supervisor.notify(self.vehicle.now)

    def _localization(self, channel: int, data: bytes) -> None:
        vehicle = self.vehicle
        if channel == 1:  # as before protocol version 12
            self._stop(data[0])
        elif channel == 0:  # a position that somebody else has measured, which the estimator takes over at once
            seen = struct.unpack("<fff", data[:12])
            vehicle.error = [a - b for a, b in zip(seen, (vehicle.x, vehicle.y, vehicle.z), strict=True)]

    def _commander(self, _: int, data: bytes) -> None:
        # Of roll, pitch, yaw rate and thrust only a thrust of 0 is emulated: cflib sends it as it closes a link.
        if struct.unpack("<fffH", data[:14])[3] == 0:
            self.vehicle.command(wire.OFF)

    def _generic(self, channel: int, data: bytes) -> None:
        if channel == 1 and data[0] == 0:
            self.vehicle.low_level = False
        elif channel == 0 and (told := wire.setpoint_of(data)) is not None:
            self.vehicle.command(told)

    def _high_level(self, _: int, data: bytes) -> bytes:
        vehicle, (x, y, z), done = self.vehicle, self.vehicle.estimate, True
        if data[0] == 3:
            vehicle.plan = None
        elif data[0] in (7, 8):  # take off, land
            _, _, height, yaw, keep, duration = struct.unpack("<BBff?f", data[:15])
            done = vehicle.fly_to((x, y, height, vehicle.yaw if keep else yaw), duration, lands=data[0] == 8)
        elif data[0] in (4, 12):  # go to; the newer one can also go straight
            *to, duration = struct.unpack("<fffff", data[3 if data[0] == 4 else 4 :][:20])
            start = (x, y, z, vehicle.yaw) if data[2] else (0.0,) * 4
            done = vehicle.fly_to([a + b for a, b in zip(start, to, strict=True)], duration)
        else:
            return data[:3].ljust(3, b"\0") + bytes([errno.ENOEXEC])
        return data[:3].ljust(3, b"\0") + bytes([0 if done else errno.EBUSY])

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
            if number >= len(LOGGED) or kind & 0x0F not in wire.LOG_FORMATS:
                return errno.ENOENT
            variable = self.log_contents.entries[number][0], wire.LOG_FORMATS[kind & 0x0F]
            if sum(struct.calcsize(form) for _, form in (*block.variables, variable)) > BLOCK_BYTES:
                return errno.E2BIG
            block.variables.append(variable)
        return 0

    def _param(self, channel: int, data: bytes) -> bytes | None:
        if channel == 0:
            return self.param_contents.answer(data)
        if channel == 3:  # defaults and what is stored: nothing
            return data[:3] + bytes([errno.ENOENT])
        number = struct.unpack_from("<H", data)[0]
        if number >= len(self.values):
            return data[:2] + bytes([errno.ENOENT])
        name, kind = self.param_contents.entries[number]
        form = wire.PARAM_FORMATS[kind & ~wire.READ_ONLY]
        if channel == 1:
            return data[:2] + b"\0" + wire.packed(form, self.values[number])
        if kind & wire.READ_ONLY:
            return None
        (self.values[number],) = struct.unpack_from(form, data, 2)
        self._effect(name, self.values[number])
        return data

    def _effect(self, name: str, value: float) -> None:
        """Do what a parameter that was set is for."""
        vehicle = self.vehicle
        match name:
            case "stabilizer.stop":
                vehicle.supervisor.emergency |= bool(value)
            case "kalman.resetEstimation" if value:
                vehicle.error = [-vehicle.x, -vehicle.y, 0.0]
            case "pm.lowVoltage":
                vehicle.low_voltage = value

    def _mem(self, channel: int, data: bytes) -> bytes | None:
        return bytes([1, 0]) if channel == 0 and data[0] == 1 else None  # how many memories it has: none
