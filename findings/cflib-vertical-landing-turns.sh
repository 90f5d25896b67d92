#!/usr/bin/env bash
# cflib 0.1.34, CPython 3.11, 2026-11-30
#
# HighLevelCommander.takeoff(height, duration) and land(height, duration) are documented as a vertical take-off and
# landing "from current x-y position". Their argument yaw, if it is left out, is 0.0 and not None, which alone means the
# present heading: so both turn the Crazyflie to heading 0 on the way, by as much as it stands turned. The firmware
# (crtp_commander_high_level.c) plans to the yaw of the packet unless its flag useCurrentYaw is set. PositionHlCommander,
# which has no such argument, always turns. One expects that what is called vertical changes the height alone, as its
# go_to(relative=True) does. With decks that look forwards, a gripper or a cable, a turn of half a circle within a
# landing of one second matters.
# To live with it: pass yaw=None.
. "$(dirname "$0")/setup.bash" cflib==0.1.34
"$python" - <<'PYTHON'
import struct
from types import SimpleNamespace

from cflib.crazyflie.high_level_commander import HighLevelCommander

sent = []
# What the high-level commander uses of a Crazyflie: its packets, and the version of its protocol.
crazyflie = SimpleNamespace(send_packet=sent.append, platform=SimpleNamespace(get_protocol_version=lambda: 12))
commander = HighLevelCommander(crazyflie)


def planned(name, *numbers, **named):
    """What the packet of a call plans: (yaw in rad, use the present yaw)."""
    getattr(commander, name)(*numbers, **named)
    # TAKEOFF_2 and LAND_2: command, group, height, yaw, useCurrentYaw, duration (crtp_commander_high_level.c)
    _, _, _, yaw, uses_present, _ = struct.unpack("<BBff?f", bytes(sent.pop().data))
    print(f"{name}{numbers} {named or ''}: to yaw {yaw:g}, or to the present one: {uses_present}")
    return yaw, uses_present


for name, height in (("takeoff", 0.5), ("land", 0.0)):
    assert planned(name, height, 1.0) == (0.0, False)
    assert planned(name, height, 1.0, yaw=None) == (0.0, True)
PYTHON
# Seen:
# takeoff(0.5, 1.0) : to yaw 0, or to the present one: False
# takeoff(0.5, 1.0) {'yaw': None}: to yaw 0, or to the present one: True
# land(0.0, 1.0) : to yaw 0, or to the present one: False
# land(0.0, 1.0) {'yaw': None}: to yaw 0, or to the present one: True
