"""The PDOs as this master maps them, and how their frames are packed."""

import struct
from typing import NamedTuple

from vrg.hal.can.cia402.network import Function
from vrg.hal.can.cia402.objects import Object
from vrg.hal.can.frame import Frame, FrameError


class Pdo(NamedTuple):
    """One PDO: the function of its identifier, the objects in it one after the other, and how those are packed."""

    function: Function
    objects: tuple[Object, ...]
    packing: struct.Struct

    def frame(self, node: int, *values: int) -> Frame:
        """The frame that carries these values."""
        return Frame(self.function | node, self.packing.pack(*values))

    def values(self, data: bytes) -> tuple[int, ...]:
        """The values that a frame carries.

        Raises:
            FrameError: it is of another length.
        """
        if len(data) != self.packing.size:
            raise FrameError(f"{self.function.name}: expected {self.packing.size} bytes, got {len(data)}")
        return self.packing.unpack(data)


# Of the two PDOs that the drive hears, only the second has a deadline (0x1401:05), and only the robot's own thread ever
# sends it: whoever steps the state machine, by the first, feeds no watchdog. For the same reason the controlword, which
# is in every RPDO that drives come with, is not in the second: a setpoint enables nothing, and enabling is no setpoint.
CONTROL_PDO = Pdo(Function.RPDO1, (Object.CONTROLWORD,), struct.Struct("<H"))
SETPOINT_PDO = Pdo(Function.RPDO2, (Object.TARGET_VELOCITY,), struct.Struct("<i"))
STATUS_PDO = Pdo(Function.TPDO1, (Object.STATUSWORD, Object.ERROR_CODE, Object.MODE_DISPLAY), struct.Struct("<HHb"))
MOTION_PDO = Pdo(Function.TPDO2, (Object.POSITION, Object.VELOCITY), struct.Struct("<ii"))
SUPPLY_PDO = Pdo(Function.TPDO3, (Object.VOLTAGE,), struct.Struct("<I"))
