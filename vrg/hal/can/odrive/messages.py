"""The messages of ODrive CANSimple, firmware 0.6, as plain data.

Source: ODrive's documentation of the CAN protocol and its DBC file for 0.6.10. Units are those of the protocol: turns,
turns per second, newton metres, amperes, volts.
"""

import enum
from typing import NamedTuple

PROTOCOL_VERSION = 2
"""The version of CANSimple that these messages are of."""


Command = enum.IntEnum("Command", {
    "VERSION": 0x00, "HEARTBEAT": 0x01, "ESTOP": 0x02, "ERROR": 0x03, "RX_SDO": 0x04, "TX_SDO": 0x05, "ADDRESS": 0x06,
    "SET_AXIS_STATE": 0x07, "ENCODER_ESTIMATES": 0x09, "SET_CONTROLLER_MODE": 0x0B, "SET_INPUT_POS": 0x0C,
    "SET_INPUT_VEL": 0x0D, "SET_INPUT_TORQUE": 0x0E, "SET_LIMITS": 0x0F, "SET_TRAJ_VEL_LIMIT": 0x11,
    "SET_TRAJ_ACCEL_LIMITS": 0x12, "SET_TRAJ_INERTIA": 0x13, "IQ": 0x14, "TEMPERATURE": 0x15, "REBOOT": 0x16,
    "BUS_VOLTAGE_CURRENT": 0x17, "CLEAR_ERRORS": 0x18, "SET_ABSOLUTE_POSITION": 0x19, "SET_POS_GAIN": 0x1A,
    "SET_VEL_GAINS": 0x1B, "TORQUES": 0x1C, "POWERS": 0x1D, "ENTER_DFU_MODE": 0x1F,
})  # fmt: skip
"""The meaning of the low five bits of an identifier."""


AxisState = enum.IntEnum("AxisState", {
    "UNDEFINED": 0, "IDLE": 1, "STARTUP_SEQUENCE": 2, "FULL_CALIBRATION_SEQUENCE": 3, "MOTOR_CALIBRATION": 4,
    "ENCODER_INDEX_SEARCH": 6, "ENCODER_OFFSET_CALIBRATION": 7, "CLOSED_LOOP_CONTROL": 8, "LOCKIN_SPIN": 9,
    "ENCODER_DIR_FIND": 10, "HOMING": 11, "ENCODER_HALL_POLARITY_CALIBRATION": 12,
    "ENCODER_HALL_PHASE_CALIBRATION": 13, "ANTICOGGING_CALIBRATION": 14, "HARMONIC_CALIBRATION": 15,
    "HARMONIC_CALIBRATION_COMMUTATION": 16,
})  # fmt: skip
"""The state of an axis."""


AxisError = enum.IntFlag("AxisError", {
    "INITIALIZING": 1 << 0, "SYSTEM_LEVEL": 1 << 1, "TIMING_ERROR": 1 << 2, "MISSING_ESTIMATE": 1 << 3,
    "BAD_CONFIG": 1 << 4, "DRV_FAULT": 1 << 5, "MISSING_INPUT": 1 << 6, "DC_BUS_OVER_VOLTAGE": 1 << 8,
    "DC_BUS_UNDER_VOLTAGE": 1 << 9, "DC_BUS_OVER_CURRENT": 1 << 10, "DC_BUS_OVER_REGEN_CURRENT": 1 << 11,
    "CURRENT_LIMIT_VIOLATION": 1 << 12, "MOTOR_OVER_TEMP": 1 << 13, "INVERTER_OVER_TEMP": 1 << 14,
    "VELOCITY_LIMIT_VIOLATION": 1 << 15, "POSITION_LIMIT_VIOLATION": 1 << 16, "WATCHDOG_TIMER_EXPIRED": 1 << 24,
    "ESTOP_REQUESTED": 1 << 25, "SPINOUT_DETECTED": 1 << 26, "BRAKE_RESISTOR_DISARMED": 1 << 27,
    "THERMISTOR_DISCONNECTED": 1 << 28, "CALIBRATION_ERROR": 1 << 30,
})  # fmt: skip
"""Why an axis is disarmed."""


VELOCITY_CONTROL, PASSTHROUGH = 2, 1
"""A control mode, and the input mode that follows a setpoint as it is."""


class Version(NamedTuple):
    """The versions of protocol, hardware and firmware; `unreleased` is 0 for an official build."""

    protocol: int
    hw_major: int
    hw_minor: int
    hw_variant: int
    fw_major: int
    fw_minor: int
    fw_revision: int
    unreleased: int

    @property
    def firmware(self) -> str:
        """The firmware's version as people write it."""
        return f"{self.fw_major}.{self.fw_minor}.{self.fw_revision}{'-dev' if self.unreleased else ''}"


class Heartbeat(NamedTuple):
    """The message that a drive sends ten times a second.

    `error` has the active errors or, while it is disarmed, the reason for that; `done` is 1 at the end of a trajectory.
    """

    error: int
    state: int
    result: int = 0
    done: int = 0


class Estop(NamedTuple):
    """The drive is to disarm, and to latch ESTOP_REQUESTED."""


class RxSdo(NamedTuple):
    """The drive is to read (opcode 0) or write (opcode 1) an endpoint."""

    opcode: int
    endpoint: int
    value: int = 0


class TxSdo(NamedTuple):
    """The answer to an RxSdo."""

    opcode: int
    endpoint: int
    value: int = 0


class Address(NamedTuple):
    """A drive reports its id and its serial number. A drive that gets it takes this id if the number is its own."""

    node: int
    serial: int


class SetAxisState(NamedTuple):
    """The axis is to change into this AxisState."""

    state: int


class EncoderEstimates(NamedTuple):
    """Position in turns and velocity in turn/s. They are float32, so the step grows with the position."""

    position: float
    velocity: float


class SetControllerMode(NamedTuple):
    """The way in which the drive is to take setpoints."""

    control_mode: int
    input_mode: int


class SetInputVel(NamedTuple):
    """A setpoint of the velocity in turn/s; the torque in Nm is fed forward."""

    velocity: float
    torque: float = 0.0


class SetLimits(NamedTuple):
    """The limits of velocity in turn/s and of current in A."""

    velocity: float
    current: float


class Reboot(NamedTuple):
    """The drive is to start again: 0 at once, 1 after saving, 2 after erasing its settings, 3 for a firmware update."""

    action: int = 0


class BusVoltageCurrent(NamedTuple):
    """The supply's voltage in V and current in A."""

    voltage: float
    current: float


class ClearErrors(NamedTuple):
    """The drive is to forget its errors; `identify` 1 lets it blink as well."""

    identify: int = 0


class SetAbsolutePosition(NamedTuple):
    """The position in turns that the encoder is to say here."""

    position: float


class Other(NamedTuple):
    """A command of which only its name is of use here."""

    command: Command

    @property
    def title(self) -> str:
        """Its name as those of the other messages are written."""
        return self.command.name.title().replace("_", "")


Message = (
    Version | Heartbeat | Estop | RxSdo | TxSdo | Address | SetAxisState | EncoderEstimates | SetControllerMode
    | SetInputVel | SetLimits | Reboot | BusVoltageCurrent | ClearErrors | SetAbsolutePosition | Other
)  # fmt: skip


def describe_errors(bits: int) -> str:
    """Error bits in words, as ODrive writes them, joined by commas; empty where there is none."""
    names = [error.name for error in AxisError if error & bits and error.name]
    unknown = bits & ~sum(AxisError)
    if unknown:
        names.append(f"unknown error 0x{unknown:X}")
    return ", ".join(names)


def describe_state(state: int) -> str:
    """An axis state in words."""
    try:
        return AxisState(state).name
    except ValueError:
        return f"state {state}"


ProcedureResult = enum.IntEnum("ProcedureResult", {
    "SUCCESS": 0, "BUSY": 1, "CANCELLED": 2, "DISARMED": 3, "NO_RESPONSE": 4, "POLE_PAIR_CPR_MISMATCH": 5,
    "PHASE_RESISTANCE_OUT_OF_RANGE": 6, "PHASE_INDUCTANCE_OUT_OF_RANGE": 7, "UNBALANCED_PHASES": 8,
    "INVALID_MOTOR_TYPE": 9, "ILLEGAL_HALL_STATE": 10, "TIMEOUT": 11, "HOMING_WITHOUT_ENDSTOP": 12,
    "INVALID_STATE": 13, "NOT_CALIBRATED": 14, "NOT_CONVERGING": 15,
})  # fmt: skip
"""The second byte after the errors of a heartbeat (ODrive's documentation, firmware 0.6)."""


_ADVICE = {
    ProcedureResult.INVALID_STATE: "it is not ready to be switched on: is it calibrated and without errors?",
    ProcedureResult.NOT_CALIBRATED: "calibrate motor and encoder, and save that",
    ProcedureResult.DISARMED: "it was switched off again at once",
}


def describe_result(result: int) -> str:
    """A procedure result in words."""
    try:
        known = ProcedureResult(result)
    except ValueError:
        return f"procedure result {result}"
    advice = _ADVICE.get(known)
    return f"{known.name} ({advice})" if advice else known.name
