"""The objects of a drive that are used here, by number (CiA 301, CiA 402)."""

import enum

PROFILE = 402
"""The low half of the device type, 0x1000."""
DEVICE_TYPE = 0x00020192
"""The device type of a servo drive of profile 402."""
PROFILE_VELOCITY = 3
"""The mode of operation, 0x6060."""
SUPPORTS_PROFILE_VELOCITY = 1 << (PROFILE_VELOCITY - 1)
"""The bit of that mode in the supported modes, 0x6502."""


class Object(enum.IntEnum):
    """The index of each object."""

    DEVICE_TYPE = 0x1000
    ERROR_REGISTER = 0x1001
    ERROR_HISTORY = 0x1003
    SYNC_COB_ID = 0x1005
    NAME = 0x1008
    FIRMWARE = 0x100A
    STORE = 0x1010
    EMCY_COB_ID = 0x1014
    CONSUMER_HEARTBEAT = 0x1016
    HEARTBEAT_TIME = 0x1017
    IDENTITY = 0x1018
    ERROR_BEHAVIOUR = 0x1029
    RPDO = 0x1400
    RPDO_MAPPING = 0x1600
    TPDO = 0x1800
    TPDO_MAPPING = 0x1A00
    ABORT_CONNECTION_OPTION = 0x6007
    ERROR_CODE = 0x603F
    CONTROLWORD = 0x6040
    STATUSWORD = 0x6041
    QUICK_STOP_OPTION = 0x605A
    SHUTDOWN_OPTION = 0x605B
    HALT_OPTION = 0x605D
    FAULT_REACTION = 0x605E
    MODE = 0x6060
    MODE_DISPLAY = 0x6061
    POSITION = 0x6064
    VELOCITY_DEMAND = 0x606B
    VELOCITY = 0x606C
    TORQUE = 0x6077
    VOLTAGE = 0x6079
    MOTOR_SPEED_LIMIT = 0x6080
    ACCELERATION = 0x6083
    DECELERATION = 0x6084
    QUICK_STOP_DECELERATION = 0x6085
    ENCODER_RESOLUTION = 0x608F
    VELOCITY_UNIT = 0x60A9
    TARGET_VELOCITY = 0x60FF
    SUPPORTED_MODES = 0x6502


SERIAL = 4
"""The sub-index of the serial number in 0x1018."""
COB_ID, TRANSMISSION, INHIBIT, EVENT_TIMER = 1, 2, 3, 5
"""Sub-indices of 0x1400 and 0x1800. The inhibit time is in 0.1 ms, the event timer in ms."""
SAVE = int.from_bytes(b"save", "little")
"""What must be written to 0x1010:01."""
ERRORS_KEPT = 8
"""The errors in the history, 0x1003."""
PDOS = 4
"""The number of PDOs in each direction."""
NOT_VALID = 1 << 31
"""The bit of a COB-ID which says that its PDO is switched off."""


NO_REMOTE = 1 << 30
"""The bit of a TPDO's COB-ID which says that it does not answer remote frames."""


def mapping_entry(index: int, bits: int, sub: int = 0) -> int:
    """How a PDO's mapping (0x1600, 0x1A00) names an object of so many bits."""
    return index << 16 | sub << 8 | bits
