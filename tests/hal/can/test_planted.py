"""Frames that are planted beside an ODrive that drives."""

import math
from typing import ClassVar

from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec as odrive
from vrg.hal.can.odrive import messages as m
from vrg.hal.can.odrive.messages import AxisState, Command
from vrg.testing.can.planted import ANOTHER, NODE, PlantedFrames


def od(message: m.Message, node: int = NODE) -> Frame:
    return odrive.encode(node, message)


def raw(identifier: int, data: bytes, *, extended: bool = False, remote: bool = False) -> Frame:
    return Frame(identifier, data, remote, extended)


class TestODrive(PlantedFrames):
    protocol = "odrive"
    planted: ClassVar[dict[str, tuple[Frame, str | None]]] = {
        "a setpoint": (od(m.SetInputVel(5.0)), f"{ANOTHER}: SetInputVel"),
        "a position": (raw(odrive.frame_id(NODE, Command.SET_INPUT_POS), bytes(8)), f"{ANOTHER}: SetInputPos"),
        "a torque": (raw(odrive.frame_id(NODE, 0x0E), bytes(4)), f"{ANOTHER}: SetInputTorque"),
        "a gain": (raw(odrive.frame_id(NODE, Command.SET_POS_GAIN), bytes(4)), f"{ANOTHER}: SetPosGain"),
        "a limit of trajectories": (raw(odrive.frame_id(NODE, 0x11), bytes(4)), f"{ANOTHER}: SetTrajVelLimit"),
        "limits of acceleration": (raw(odrive.frame_id(NODE, 0x12), bytes(8)), f"{ANOTHER}: SetTrajAccelLimits"),
        "an inertia": (raw(odrive.frame_id(NODE, 0x13), bytes(4)), f"{ANOTHER}: SetTrajInertia"),
        "gains of speed": (raw(odrive.frame_id(NODE, 0x1B), bytes(8)), f"{ANOTHER}: SetVelGains"),
        "a firmware update": (raw(odrive.frame_id(NODE, 0x1F), b""), f"{ANOTHER}: EnterDfuMode"),
        "a mode": (od(m.SetControllerMode(1, 1)), f"{ANOTHER}: SetControllerMode"),
        "limits": (od(m.SetLimits(1.0, 1.0)), f"{ANOTHER}: SetLimits"),
        "limits for all": (od(m.SetLimits(1.0, 1.0), odrive.BROADCAST), f"{ANOTHER}: SetLimits"),
        "an axis state": (od(m.SetAxisState(AxisState.IDLE)), f"{ANOTHER}: SetAxisState"),
        "a state for all": (od(m.SetAxisState(AxisState.IDLE), odrive.BROADCAST), f"{ANOTHER}: SetAxisState"),
        "errors cleared": (od(m.ClearErrors()), f"{ANOTHER}: ClearErrors"),
        "a reboot": (od(m.Reboot(0)), f"{ANOTHER}: Reboot"),
        "an endpoint written": (od(m.RxSdo(1, 2, 0)), f"{ANOTHER}: RxSdo"),
        "an endpoint read": (od(m.RxSdo(0, 2, 0)), None),
        "a position set": (od(m.SetAbsolutePosition(0.0)), f"{ANOTHER}: SetAbsolutePosition"),
        "an id given": (od(m.Address(9, 77), odrive.BROADCAST), "another program gives drives other ids"),
        "a speed of NaN": (od(m.EncoderEstimates(0.0, math.nan)), "its encoder says 0.0 turn, nan turn/s"),
        "a voltage of NaN": (od(m.BusVoltageCurrent(math.nan, 0.0)), "its supply says nan V"),
        "a voltage of 1e30": (od(m.BusVoltageCurrent(1e30, 0.0)), "its supply says 1e+30 V"),
        "a short heartbeat": (raw(odrive.frame_id(NODE, Command.HEARTBEAT), b"\0\0"), "a malformed frame"),
        "an unknown command": (raw(odrive.frame_id(NODE, 0x1E), b""), "a malformed frame: command 0x1E"),
        "a question for its version": (odrive.request(NODE, Command.VERSION), None),
        "a setpoint for another drive": (od(m.SetInputVel(5.0), NODE + 1), None),
    }  # fmt: skip
