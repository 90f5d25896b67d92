"""The error codes of CiA 402 (0x603F, and the first two bytes of an EMCY) in words."""

RPDO_TIMEOUT = 0x8250
"""No frame of an RPDO has arrived within its event timer (0x1400:05): the drive's watchdog has expired."""
HEARTBEAT_LOST = 0x8130
"""No heartbeat of the master has arrived within the time of 0x1016, which is the watchdog of some drives."""
STO = 0xFF01
"""The emulated drive's safe torque off: an emergency stop at the drive. CiA 402 has no code for it, so each maker takes
one of its own range, 0xFF00 and up."""
STO_CODES = frozenset({STO})
"""Error codes that mean an emergency stop at the drive. That of a real drive stands in its manual."""

_ERRORS = {
    0x1000: "generic error", 0x2110: "short circuit or earth leakage at the input",
    0x2211: "overcurrent in the device", 0x2220: "continuous overcurrent in the device",
    0x2310: "continuous overcurrent at the output", 0x2311: "overcurrent at the output",
    0x2320: "short circuit or earth leakage at the output", 0x2340: "short circuit in the motor",
    0x2350: "load level too high (I2t)", 0x3110: "mains overvoltage", 0x3120: "mains undervoltage",
    0x3130: "phase failure", 0x3210: "DC link overvoltage", 0x3220: "DC link undervoltage",
    0x3310: "output overvoltage", 0x4110: "ambient temperature too high", 0x4210: "device temperature too high",
    0x4220: "device temperature too low", 0x4310: "drive temperature too high", 0x4320: "drive temperature too low",
    0x5112: "low supply of the control electronics", 0x5210: "measurement circuit", 0x5430: "input stages",
    0x5441: "contactor", 0x5530: "configuration memory", 0x6010: "software reset: the drive's own watchdog",
    0x6100: "internal software", 0x6320: "parameter error", 0x7110: "brake chopper", 0x7121: "motor blocked",
    0x7122: "motor error or commutation malfunction", 0x7300: "position sensor", 0x7305: "incremental encoder 1",
    0x7310: "speed sensor", 0x7380: "position sensor calibration", 0x7500: "communication inside the device",
    0x8100: "communication", 0x8110: "CAN overrun: frames were lost", 0x8120: "CAN error-passive",
    0x8130: "no heartbeat of the master", 0x8140: "recovered from bus-off", 0x8150: "another node uses its identifier",
    0x8210: "a PDO was too short", 0x8220: "a PDO was too long", 0x8250: "no setpoint came in time",
    0x8311: "torque too high", 0x8400: "velocity controller", 0x8480: "velocity too high",
    0x8500: "position controller", 0x8611: "following error", 0x8612: "position limit", 0x8A00: "positioning",
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
"""Words by the high byte of an error code, for codes that are not in the table above."""


def describe_error(code: int) -> str:
    """An error code in words, with its number; empty for 0, which is no error."""
    if not code:
        return ""
    words = _ERRORS.get(code) or _CLASSES.get(code >> 8) or _CLASSES.get(code >> 8 & 0xF0) or "unknown error"
    return f"{words} (0x{code:04X})"


def error_register(code: int) -> int:
    """The bits of the error register, 0x1001, that go with an error code."""
    kind = {2: 1 << 1, 3: 1 << 2, 4: 1 << 3, 0xF: 1 << 7}.get(code >> 12, 0)
    return 0 if not code else 1 | kind | (1 << 4 if code >> 8 in (0x81, 0x82) else 0)
