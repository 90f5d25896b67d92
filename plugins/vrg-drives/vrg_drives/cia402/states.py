"""The state machine of an emulated drive, by CiA 402's table of commands."""

import enum
import math

from vrg.hal.can.frame import Frame
from vrg_drives.cia402.codec import NODE_MASK, Control, DriveState, Function, Object
from vrg_drives.cia402.objects import Objects

_POWERED = frozenset({DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE})
_VOLTAGE_ENABLED, _REMOTE, _TARGET_REACHED, _NO_QUICK_STOP = 1 << 4, 1 << 9, 1 << 10, 1 << 5
"""The bits of the statusword that stand for no state."""


class Cia402States:
    """The state machine of one drive.

    Attributes:
        state: the state it is in. error: the error code of its fault; 0 = none. word: the newest controlword.
    """

    def __init__(self) -> None:
        self.state = DriveState.SWITCH_ON_DISABLED
        self.error = 0
        self.word = 0

    @property
    def powered(self) -> bool:
        """True if the motor is under control."""
        return self.state in _POWERED

    def statusword(self, reached: bool) -> int:
        """The statusword of the drive; `reached`: the motor turns at the target velocity."""
        word = self.state.value[1] | _REMOTE | _VOLTAGE_ENABLED
        if self.state is DriveState.SWITCH_ON_DISABLED:
            word |= _NO_QUICK_STOP
        if self.state is DriveState.OPERATION_ENABLED and reached:
            word |= _TARGET_REACHED
        return word

    def fail(self, code: int, *, brakes: bool) -> None:
        """A fault has occurred; `brakes`: the motor is braked before it is switched off."""
        if self.state is not DriveState.FAULT:
            self.state = DriveState.FAULT_REACTION_ACTIVE if brakes else DriveState.FAULT
        self.error = code

    def stand(self) -> None:
        """The motor, which was braked, has come to rest."""
        quick = self.state is DriveState.QUICK_STOP_ACTIVE
        self.state = DriveState.SWITCH_ON_DISABLED if quick else DriveState.FAULT

    def control(self, word: int) -> bool:
        """Take a controlword; whether it has reset a fault."""
        rises, self.word = word & ~self.word & Control.FAULT_RESET, word
        if self.state is DriveState.FAULT:
            if rises:
                self.state, self.error = DriveState.SWITCH_ON_DISABLED, 0
            return bool(rises)
        if self.state is not DriveState.FAULT_REACTION_ACTIVE and not word & Control.FAULT_RESET:
            if not word & 0x02:
                self.state = DriveState.SWITCH_ON_DISABLED
            elif not word & 0x04:
                self._quick_stop()
            elif not word & 0x01:
                if self.state is not DriveState.QUICK_STOP_ACTIVE:
                    self.state = DriveState.READY_TO_SWITCH_ON
            else:
                self._switch_on(bool(word & 0x08))
        return False

    def _quick_stop(self) -> None:
        if self.state is DriveState.OPERATION_ENABLED:
            self.state = DriveState.QUICK_STOP_ACTIVE
        elif self.state is not DriveState.QUICK_STOP_ACTIVE:
            self.state = DriveState.SWITCH_ON_DISABLED

    def _switch_on(self, enable: bool) -> None:
        """Switch on, or enable operation, which a drive that is ready to switch on does in one go."""
        if self.state not in (DriveState.SWITCH_ON_DISABLED, DriveState.QUICK_STOP_ACTIVE):
            self.state = DriveState.OPERATION_ENABLED if enable else DriveState.SWITCHED_ON


class AbortOption(enum.IntEnum):
    """The reaction of a drive that is no longer commanded (0x6007)."""

    NOTHING = 0
    FAULT = 1


class ErrorBehaviour(enum.IntEnum):
    """The network state that a drive takes when its master has fallen silent (0x1029:01)."""

    PRE_OPERATIONAL = 0
    NO_CHANGE = 1
    STOPPED = 2


class HeartbeatConsumer:
    """Watches the heartbeat of the master, if it is set to do so (0x1016:01). Times are monotonic, s.

    It begins with the first heartbeat, as CiA 301 has it.
    """

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self.due = math.inf

    @property
    def _setting(self) -> int:
        return self._objects.setting(Object.CONSUMER_HEARTBEAT, 1)

    def hear(self, frame: Frame, now: float) -> None:
        """Any frame has arrived."""
        period = (self._setting & 0xFFFF) / 1000
        if period and frame.id == Function.HEARTBEAT | (self._setting >> 16 & NODE_MASK):
            self.due = now + period

    def set_anew(self) -> None:
        """The setting was written."""
        self.due = math.inf

    def expired(self, now: float) -> bool:
        """True if the master has fallen silent; reported once."""
        late = now >= self.due
        if late:
            self.due = math.inf
        return late
