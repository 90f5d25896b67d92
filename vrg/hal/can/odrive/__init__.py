"""ODrive CANSimple, firmware 0.6: the protocol of the motor controllers of ODrive Robotics."""

from vrg.hal.can.protocols import Protocol

PROTOCOL = Protocol(
    "odrive",
    axis="vrg.hal.can.odrive.axis:OdriveAxis",
    drive="vrg.hal.can.workshop.odrive.drive:OdriveDrive",
    listener="vrg.hal.can.workshop.odrive.listener:OdriveListener",
)
