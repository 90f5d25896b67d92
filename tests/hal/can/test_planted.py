"""Frames that are planted beside an ODrive that drives."""

import math

import pytest

from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec as odrive
from vrg.hal.can.odrive import messages as m
from vrg.hal.can.odrive.messages import AxisState, Command
from vrg.testing.can.planted import ANOTHER, NODE, Planted, check_filters, check_planted


def od(message: m.Message, node: int = NODE) -> Frame:
    return odrive.encode(node, message)


def raw(identifier: int, data: bytes, *, extended: bool = False, remote: bool = False) -> Frame:
    return Frame(identifier, data, remote, extended)


PLANTED: list[Planted] = [
    ("odrive", "a setpoint", od(m.SetInputVel(5.0)), f"{ANOTHER}: SetInputVel"),
    ("odrive", "a position", raw(odrive.frame_id(NODE, Command.SET_INPUT_POS), bytes(8)), f"{ANOTHER}: SetInputPos"),
    ("odrive", "a torque", raw(odrive.frame_id(NODE, 0x0E), bytes(4)), f"{ANOTHER}: SetInputTorque"),
    ("odrive", "a gain", raw(odrive.frame_id(NODE, Command.SET_POS_GAIN), bytes(4)), f"{ANOTHER}: SetPosGain"),
    ("odrive", "a limit of trajectories", raw(odrive.frame_id(NODE, 0x11), bytes(4)), f"{ANOTHER}: SetTrajVelLimit"),
    ("odrive", "limits of acceleration", raw(odrive.frame_id(NODE, 0x12), bytes(8)), f"{ANOTHER}: SetTrajAccelLimits"),
    ("odrive", "an inertia", raw(odrive.frame_id(NODE, 0x13), bytes(4)), f"{ANOTHER}: SetTrajInertia"),
    ("odrive", "gains of speed", raw(odrive.frame_id(NODE, 0x1B), bytes(8)), f"{ANOTHER}: SetVelGains"),
    ("odrive", "a firmware update", raw(odrive.frame_id(NODE, 0x1F), b""), f"{ANOTHER}: EnterDfuMode"),
    ("odrive", "a mode", od(m.SetControllerMode(1, 1)), f"{ANOTHER}: SetControllerMode"),
    ("odrive", "limits", od(m.SetLimits(1.0, 1.0)), f"{ANOTHER}: SetLimits"),
    ("odrive", "limits for all", od(m.SetLimits(1.0, 1.0), odrive.BROADCAST), f"{ANOTHER}: SetLimits"),
    ("odrive", "an axis state", od(m.SetAxisState(AxisState.IDLE)), f"{ANOTHER}: SetAxisState"),
    ("odrive", "a state for all", od(m.SetAxisState(AxisState.IDLE), odrive.BROADCAST), f"{ANOTHER}: SetAxisState"),
    ("odrive", "errors cleared", od(m.ClearErrors()), f"{ANOTHER}: ClearErrors"),
    ("odrive", "a reboot", od(m.Reboot(0)), f"{ANOTHER}: Reboot"),
    ("odrive", "an endpoint written", od(m.RxSdo(1, 2, 0)), f"{ANOTHER}: RxSdo"),
    ("odrive", "an endpoint read", od(m.RxSdo(0, 2, 0)), None),
    ("odrive", "a position set", od(m.SetAbsolutePosition(0.0)), f"{ANOTHER}: SetAbsolutePosition"),
    ("odrive", "an id given", od(m.Address(9, 77), odrive.BROADCAST), "another program gives drives other ids"),
    ("odrive", "a speed of NaN", od(m.EncoderEstimates(0.0, math.nan)), "its encoder says 0.0 turn, nan turn/s"),
    ("odrive", "a voltage of NaN", od(m.BusVoltageCurrent(math.nan, 0.0)), "its supply says nan V"),
    ("odrive", "a voltage of 1e30", od(m.BusVoltageCurrent(1e30, 0.0)), "its supply says 1e+30 V"),
    ("odrive", "a short heartbeat", raw(odrive.frame_id(NODE, Command.HEARTBEAT), b"\0\0"), "a malformed frame"),
    ("odrive", "an unknown command", raw(odrive.frame_id(NODE, 0x1E), b""), "a malformed frame: command 0x1E"),
    ("odrive", "a question for its version", odrive.request(NODE, Command.VERSION), None),
    ("odrive", "a setpoint for another drive", od(m.SetInputVel(5.0), NODE + 1), None),
]


@pytest.mark.parametrize(
    ("protocol", "frame", "words"),
    [pytest.param(p, frame, words, id=f"{p}: {what}") for p, what, frame, words in PLANTED],
)
def test_what_a_planted_frame_causes(protocol: str, frame: Frame, words: str | None) -> None:
    check_planted(protocol, frame, words)


@pytest.mark.parametrize("protocol", ["odrive"])
def test_each_passes_the_filters_of_the_interface(protocol: str) -> None:
    check_filters(protocol, PLANTED)
