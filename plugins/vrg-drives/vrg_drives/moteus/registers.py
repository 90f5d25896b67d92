"""The registers of moteus that are used here, and what their values mean."""

import enum

from vrg_drives.moteus.codec import WHOLE, Scale

Register = enum.IntEnum("Register", {
    "MODE": 0x000, "POSITION": 0x001, "VELOCITY": 0x002, "TORQUE": 0x003, "Q_CURRENT": 0x004, "VOLTAGE": 0x00D,
    "TEMPERATURE": 0x00E, "FAULT": 0x00F, "COMMAND_POSITION": 0x020, "COMMAND_VELOCITY": 0x021,
    "COMMAND_FEEDFORWARD_TORQUE": 0x022, "COMMAND_KP_SCALE": 0x023, "COMMAND_KD_SCALE": 0x024,
    "COMMAND_MAX_TORQUE": 0x025, "COMMAND_STOP_POSITION": 0x026, "COMMAND_TIMEOUT": 0x027,
    "COMMAND_VELOCITY_LIMIT": 0x028, "COMMAND_ACCEL_LIMIT": 0x029, "MILLISECONDS": 0x070, "MODEL_NUMBER": 0x100,
    "FIRMWARE_VERSION": 0x101, "REGISTER_MAP_VERSION": 0x102, "MULTIPLEX_ID": 0x110, "SERIAL_1": 0x120,
    "SERIAL_2": 0x121, "SERIAL_3": 0x122, "SET_OUTPUT_NEAREST": 0x130, "REQUIRE_REINDEX": 0x132,
})  # fmt: skip
"""The number of each register."""


_R = Register
SCALES: dict[int, Scale] = {
    register: scale
    for scale, registers in (
        (Scale(0.01, 0.0001, 0.00001), (_R.POSITION, _R.COMMAND_POSITION, _R.SET_OUTPUT_NEAREST)),
        (Scale(0.1, 0.00025, 0.00001), (_R.VELOCITY, _R.COMMAND_VELOCITY, _R.COMMAND_VELOCITY_LIMIT)),
        (Scale(0.5, 0.01, 0.001), (_R.TORQUE, _R.COMMAND_FEEDFORWARD_TORQUE, _R.COMMAND_MAX_TORQUE)),
        (Scale(1.0, 0.1, 0.001), (_R.Q_CURRENT, _R.TEMPERATURE)),
        (Scale(0.5, 0.1, 0.001), (_R.VOLTAGE,)),
        (Scale(0.01, 0.001, 0.000001), (_R.COMMAND_TIMEOUT,)),
        (Scale(1.0 / 127, 1.0 / 32767, 1.0 / 2147483647), (_R.COMMAND_KP_SCALE, _R.COMMAND_KD_SCALE)),
        (Scale(0.05, 0.001, 0.00001), (_R.COMMAND_ACCEL_LIMIT,)),
    )
    for register in registers
}
"""The scales of registers that hold quantities; all others are whole numbers."""


def scale_of(register: int) -> Scale:
    """The scale of a register."""
    return SCALES.get(register, WHOLE)


WRAP = 65536.0
"""turns after which a position starts again: a drive counts in 16.48 bits of fixed point, from -32768 turns."""


Mode = enum.IntEnum("Mode", {
    "STOPPED": 0, "FAULT": 1, "ENABLING": 2, "CALIBRATING": 3, "CALIBRATION_COMPLETE": 4, "PWM": 5, "VOLTAGE": 6,
    "VOLTAGE_FOC": 7, "VOLTAGE_DQ": 8, "CURRENT": 9, "POSITION": 10, "TIMEOUT": 11, "ZERO_VELOCITY": 12,
    "STAY_WITHIN": 13, "MEASURE_INDUCTANCE": 14, "BRAKE": 15,
})  # fmt: skip
"""The mode of a drive: the register MODE."""


_FAULTS = {
    32: "calibration fault", 33: "motor driver fault", 34: "over voltage", 35: "encoder fault",
    36: "motor not configured", 37: "PWM cycle overrun", 38: "over temperature", 39: "outside of its position limits",
    40: "under voltage", 41: "configuration changed", 42: "no valid commutation encoder",
    43: "no valid position encoder", 44: "driver enable fault", 45: "stop position together with velocity limits",
    46: "timing violation", 47: "back-EMF without acceleration limit", 48: "invalid limits",
    49: "position control error: the motor is too far from its position (servo.fault_position_error)",
    50: "velocity control error: the motor does not turn as it should (servo.fault_velocity_error)",
}  # fmt: skip
"""The codes of the register FAULT; those of 96 and above only tell what limits the drive."""
MAP_VERSION = 5
"""The version of the register map from which on all is as it is used here."""
LIMITS = 96
"""The first code that is no fault."""


def describe_mode(mode: int) -> str:
    """A mode in words."""
    try:
        return Mode(mode).name.lower().replace("_", " ")
    except ValueError:
        return f"mode {mode}"


def describe_fault(code: int) -> str:
    """A fault in words; empty where it is not one."""
    if not 0 < code < LIMITS:
        return ""
    return _FAULTS.get(code, f"fault {code}")


def describe_version(version: int) -> str:
    """The firmware's version as people write it."""
    return f"{version >> 16 & 0xFF}.{version >> 8 & 0xFF}.{version & 0xFF}"
