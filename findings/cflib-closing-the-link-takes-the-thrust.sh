#!/usr/bin/env bash
# cflib 0.1.34, CPython 3.11, 2026-11-30
#
# Crazyflie.close_link(), documented as "Close the communication link", first sends a set-point of roll, pitch and yaw
# rate 0 with a thrust of 0. Set-points outrank the high-level commander on board: a Crazyflie that hovers or lands by
# that, on its own and as planned, falls when a program closes its link. So do SyncCrazyflie at the end of its `with` and
# any handler that closes the link after an exception. One expects that closing only ends the connection, as a link that
# fails does: the firmware then lets the plan on board go on, or levels the body by its own watchdog.
# To live with it: land, wait until it lies on the ground, and close the link then.
. "$(dirname "$0")/setup.bash" cflib==0.1.34
"$python" - <<'PYTHON'
import struct

from cflib.crazyflie import Crazyflie
from cflib.crtp.crtpstack import CRTPPort


class Link:
    """Takes packets in place of a radio."""

    needs_resending = False

    def __init__(self):
        self.events = []

    def send_packet(self, packet):
        self.events.append((packet.port, bytes(packet.data)))
        return True

    def close(self):
        self.events.append("closed")


crazyflie = Crazyflie()
link = crazyflie.link = Link()
crazyflie.high_level_commander.land(0.0, 3.0, yaw=None)
crazyflie.close_link()
landing, (port, data), last = link.events
assert landing[0] == CRTPPort.SETPOINT_HL
assert (port, last) == (CRTPPort.COMMANDER, "closed")
roll, pitch, yaw_rate, thrust = struct.unpack("<fffH", data)
print(f"sent after the order to land, before the link is closed: roll {roll:g}, pitch {pitch:g}, thrust {thrust}")
assert (roll, pitch, yaw_rate, thrust) == (0.0, 0.0, 0.0, 0)
PYTHON
# Seen:
# sent after the order to land, before the link is closed: roll 0, pitch 0, thrust 0
