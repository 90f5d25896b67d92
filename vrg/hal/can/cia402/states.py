"""The state machine of CiA 402, as statusword (0x6041) and controlword (0x6040) tell it."""

import enum


class DriveState(enum.Enum):
    """The states. A value is a pair: the bits of the statusword that count, and what they are in this state."""

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
        """The state in words."""
        return self.name.lower().replace("_", " ")


POWERED = (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""The states in which the motor has voltage."""


def drive_state(statusword: int) -> DriveState | None:
    """The state that a statusword tells; None for a combination of bits that stands for none."""
    return next((state for state in DriveState if statusword & state.value[0] == state.value[1]), None)


class Control(enum.IntEnum):
    """Controlwords; HALT is one bit that may be added."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80
    HALT = 0x100
