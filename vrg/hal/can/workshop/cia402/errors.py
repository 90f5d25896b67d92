"""What an emulated drive does when the network fails (CiA 301, CiA 402)."""

import enum
import math

from vrg.hal.can.cia402.codec import NODE_MASK, Function, Object
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.cia402.objects import Objects


class AbortOption(enum.IntEnum):
    """What a drive does when it is no longer commanded (0x6007)."""

    NOTHING = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


class ErrorBehaviour(enum.IntEnum):
    """The network state that a drive takes when its master has fallen silent (0x1029:01)."""

    PRE_OPERATIONAL = 0
    NO_CHANGE = 1
    STOPPED = 2


class HeartbeatConsumer:
    """Watches the heartbeat of the master, if it is told to (0x1016:01). Times are monotonic, s.

    It begins with the first heartbeat, as CiA 301 has it.
    """

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self.due = math.inf

    @property
    def _setting(self) -> int:
        return self._objects.setting(Object.CONSUMER_HEARTBEAT, 1)

    def hear(self, frame: Frame, now: float) -> None:
        """Any frame has come."""
        period = (self._setting & 0xFFFF) / 1000
        if period and frame.id == Function.HEARTBEAT | (self._setting >> 16 & NODE_MASK):
            self.due = now + period

    def set_anew(self) -> None:
        """The setting was written."""
        self.due = math.inf

    def expired(self, now: float) -> bool:
        """Whether the master has fallen silent; told once."""
        late = now >= self.due
        if late:
            self.due = math.inf
        return late
