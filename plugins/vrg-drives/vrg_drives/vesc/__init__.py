"""VESC controllers: CAN frames with 29-bit identifiers.

Source: the VESC firmware's own documentation of CAN, and the behaviour of its firmware from 5.03 on. A VESC is neither
armed nor disarmed: it obeys every setpoint, and lets go of the motor when none has arrived for its time-out. What keeps
it off here is that no setpoint is sent unless the robot is armed.
"""

from vrg.hal.can.protocols import Protocol

PROTOCOL = Protocol(
    "vesc",
    axis="vrg_drives.vesc.axis:VescAxis",
    drive="vrg_drives.vesc.drive:VescDrive",
    listener="vrg_drives.vesc.drive:VescListener",
)
