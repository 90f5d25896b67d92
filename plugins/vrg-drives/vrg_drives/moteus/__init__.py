"""moteus controllers (mjbots): registers, read and written by CAN FD frames.

Source: the reference of moteus' protocol and registers at register map version 5, and the behaviour of its own Python
library. A drive says nothing by itself: it answers who asks. So a robot's own program must ask again and again, and a
listener that only listens hears what others ask.
"""

from vrg.hal.can.protocols import Protocol

PROTOCOL = Protocol(
    "moteus",
    axis="vrg_drives.moteus.axis:MoteusAxis",
    drive="vrg_drives.moteus.drive:MoteusDrive",
    listener="vrg_drives.moteus.drive:MoteusListener",
)
