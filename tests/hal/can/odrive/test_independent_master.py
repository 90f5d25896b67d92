"""Somebody else's master side of CANSimple: the package odrive-can, with ODrive's own DBC file.

It checks the codec field by field, and drives the emulated drives on vcan0.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st
from odrive_can.odrive import DriveError, ODriveCAN
from odrive_can.utils import get_dbc

from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.testing.can.live import PATIENCE, LiveDrives
from vrg.testing.can.vcan import INTERFACE, VCAN

DBC = get_dbc()
f32 = st.floats(-1e6, 1e6, width=32)
u32 = st.integers(0, (1 << 32) - 1)


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("Set_Input_Vel", ("Input_Vel", "Input_Torque_FF")),
        ("Get_Encoder_Estimates", ("Pos_Estimate", "Vel_Estimate")),
        ("Set_Limits", ("Velocity_Limit", "Current_Limit")),
        ("Get_Bus_Voltage_Current", ("Bus_Voltage", "Bus_Current")),
    ],
)
@given(first=f32, second=f32, node=st.integers(0, 7))
def test_pairs_of_floats_are_where_the_dbc_says(
    name: str, fields: tuple[str, str], first: float, second: float, node: int
) -> None:
    described = DBC.get_message_by_name(f"Axis{node}_{name}")
    data = described.encode(dict(zip(fields, (first, second), strict=True)))
    frame = Frame(described.frame_id, bytes(data))
    message = codec.decode(frame)
    assert tuple(message) == (first, second)
    ours = codec.encode(node, message)
    assert (ours.id, ours.data) == (described.frame_id, bytes(data))


@given(error=u32, state=st.integers(0, 14), result=st.integers(0, 15), done=st.booleans(), node=st.integers(0, 7))
def test_the_heartbeat_is_what_the_dbc_says(error: int, state: int, result: int, done: bool, node: int) -> None:
    described = DBC.get_message_by_name(f"Axis{node}_Heartbeat")
    ours = codec.encode(node, messages.Heartbeat(error, state, result, int(done)))
    read = described.decode(ours.data, decode_choices=False)
    assert ours.id == described.frame_id
    assert (read["Axis_Error"], read["Axis_State"], read["Procedure_Result"]) == (error, state, result)
    assert read["Trajectory_Done_Flag"] == done


def test_every_error_and_state_has_the_dbcs_name() -> None:
    heartbeat = DBC.get_message_by_name("Axis0_Heartbeat")
    errors = heartbeat.get_signal_by_name("Axis_Error").choices
    assert {error.name: int(error) for error in messages.AxisError} == {
        str(name): value for value, name in errors.items() if value
    }
    states = heartbeat.get_signal_by_name("Axis_State").choices
    newer = {"HARMONIC_CALIBRATION", "HARMONIC_CALIBRATION_COMMUTATION"}  # than the DBC
    assert {s.name: int(s) for s in messages.AxisState if s.name not in newer}.items() <= {
        str(name): value for value, name in states.items()
    }.items()


def test_every_command_has_the_dbcs_name() -> None:
    described = {m.frame_id: m.name.removeprefix("Axis0_") for m in DBC.messages if m.name.startswith("Axis0_")}
    assert {number: name.removeprefix("Get_").replace("_", "").upper() for number, name in described.items()} == {
        int(command): command.name.replace("_", "") for command in messages.Command
    }


@pytest.mark.vcan
def test_it_drives_an_emulated_drive() -> None:
    async def drive() -> None:
        bus = can.Bus(interface="socketcan", channel=INTERFACE)
        master = ODriveCAN(3, bus)
        seen: list[Any] = []
        master.feedback_callback = lambda message, _: seen.append(message)
        await asyncio.wait_for(master.start(), PATIENCE)
        try:
            master.set_controller_mode("VELOCITY_CONTROL", "VEL_RAMP")

            async def start() -> None:
                master.clear_errors()
                await asyncio.wait_for(master.set_axis_state("CLOSED_LOOP_CONTROL"), PATIENCE)

            def watchdog_has_expired() -> bool:
                try:
                    master.check_errors()
                except DriveError as error:
                    return "WATCHDOG_TIMER_EXPIRED" in str(error)
                return False

            async def until(condition: Callable[[], bool], what: str, speed: float | None = None) -> None:
                deadline = time.monotonic() + PATIENCE
                while not condition():
                    assert time.monotonic() < deadline, f"waited for {what}; last {seen[-1:]}"
                    if speed is not None:
                        if watchdog_has_expired():
                            await start()  # this computer was too busy to send a setpoint in time
                        master.set_input_vel(speed)
                    await asyncio.sleep(0.05)

            def velocity() -> float:
                return float(seen[-1].data["Vel_Estimate"]) if seen else 0.0

            await start()
            await until(lambda: abs(velocity() - 20.0) < 0.5, "20 turns a second", 20.0)
            await until(lambda: abs(velocity() + 10.0) < 0.5, "10 turns a second back", -10.0)
            master.check_errors()
            answer = await master.get_bus_voltage_current()
            assert answer["Bus_Voltage"] == pytest.approx(24.0)

            await until(watchdog_has_expired, "the watchdog, as no setpoint comes")
            await until(lambda: abs(velocity()) < 0.1, "a motor at rest")
            assert master.axis_state == "IDLE"
            await start()
            await until(lambda: velocity() > 4.5, "5 turns a second", 5.0)
        finally:
            master.stop()
            await asyncio.sleep(0.1)
            bus.shutdown()

    with LiveDrives("odrive", [3], VCAN):
        asyncio.run(drive())
