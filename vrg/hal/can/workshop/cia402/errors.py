"""What an emulated drive does when the network fails, and what it remembers of its errors (CiA 301, CiA 402)."""

import enum
import math

from vrg.hal.can.cia402.codec import ERRORS_KEPT, NODE_MASK, Function, Object
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


class ErrorHistory:
    """The errors that a drive has had, newest first (0x1003). Writing 0 to its count forgets them."""

    def __init__(self, objects: Objects) -> None:
        self._objects = objects

    def add(self, code: int) -> None:
        """An error has come up."""
        count = self._objects[Object.ERROR_HISTORY, 0]
        kept = [self._objects[Object.ERROR_HISTORY, sub] for sub in range(1, count + 1)]
        for sub, value in enumerate([code, *kept][:ERRORS_KEPT], 1):
            self._objects[Object.ERROR_HISTORY, sub] = value
        self._objects[Object.ERROR_HISTORY, 0] = min(count + 1, ERRORS_KEPT)


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
