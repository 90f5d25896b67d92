"""Somebody else's master side of CiA 402: canopen's BaseNode402, with its own thread, drives an emulated drive."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from vrg.testing.can.live import PATIENCE, LiveDrives
from vrg.testing.can.vcan import INTERFACE, VCAN
from vrg_drives.cia402.codec import DEVICE_TYPE, SERIAL_NUMBER, Object
from vrg_drives.cia402.errors import RPDO_TIMEOUT
from vrg_drives.cia402.objects import ENCODER_COUNTS, object_dictionary

pytestmark = pytest.mark.vcan

NODE = 9
SPEED = 12
"""turn/s."""


class PatientNode(BaseNode402):
    """Its patience is for a machine that does nothing else."""

    TIMEOUT_SWITCH_OP_MODE = TIMEOUT_SWITCH_STATE_FINAL = TIMEOUT_SWITCH_STATE_SINGLE = TIMEOUT_CHECK_TPDO = PATIENCE


@pytest.fixture
def master() -> Iterator[Any]:
    with LiveDrives("cia402", [NODE], VCAN):
        network = canopen.Network()
        network.connect(interface="socketcan", channel=INTERFACE)
        node: Any = PatientNode(NODE, object_dictionary(NODE))
        network.add_node(node)
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        node.nmt.wait_for_heartbeat(PATIENCE)
        yield node
        network.disconnect()


def until(condition: Callable[[], object], act: Callable[[], object] = lambda: None) -> None:
    """Wait for it; `act` meanwhile."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it has not come about"
        act()
        time.sleep(0.02)


def set_up(master: Any) -> None:
    """Its own mapping, which is not VRG's: the mode and a measurement are in other places."""
    layout = (
        (master.rpdo[1], 0x200, (Object.CONTROLWORD, Object.MODE), 0),
        (master.rpdo[3], 0x400, (Object.TARGET_VELOCITY,), 200),
        (master.tpdo[1], 0x180, (Object.MODE_DISPLAY, Object.STATUSWORD), 20),
        (master.tpdo[4], 0x480, (Object.VELOCITY, Object.POSITION), 10),
    )
    for pdo, cob_id, objects, timer in layout:
        pdo.cob_id, pdo.enabled, pdo.trans_type, pdo.event_timer = cob_id | NODE, True, 255, timer
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.save()
    master.nmt.state = "PRE-OPERATIONAL"
    master.setup_402_state_machine()
    master.nmt.state = "OPERATIONAL"
    master.op_mode = "PROFILED VELOCITY"
    assert master.op_mode == "PROFILED VELOCITY"


def command(master: Any, velocity: float) -> None:
    """One setpoint, turn/s."""
    target = master.rpdo[3]
    target[Object.TARGET_VELOCITY].raw = round(velocity * ENCODER_COUNTS)
    target.transmit()


def keep_going(master: Any, velocity: float) -> None:
    """One setpoint; where this computer was too busy to send the one before in time, the drive is started again."""
    if master.state == "FAULT":
        master.reset_from_fault()
        command(master, 0.0)
        master.state = "OPERATION ENABLED"
    command(master, velocity)


def speed(master: Any) -> float:
    """turn/s, as its TPDO says."""
    value: int = master.tpdo_values[Object.VELOCITY]
    return value / ENCODER_COUNTS


def test_it_reads_who_the_drive_is(master: Any) -> None:
    assert master.sdo[Object.DEVICE_TYPE].raw == DEVICE_TYPE
    assert master.sdo[Object.NAME].raw == "VRG emulated drive"
    assert master.sdo[Object.IDENTITY][SERIAL_NUMBER].raw == 0x1000
    assert master.sdo[Object.VOLTAGE].raw == 24_000
    with pytest.raises(canopen.SdoAbortedError, match="read only"):
        master.sdo[Object.STATUSWORD].raw = 0


def test_it_drives_it_sees_the_fault_and_drives_on(master: Any) -> None:
    set_up(master)
    assert master.state == "SWITCH ON DISABLED"
    master.state = "OPERATION ENABLED"
    until(lambda: speed(master) > 0.9 * SPEED, lambda: keep_going(master, SPEED))
    assert master.tpdo_values[Object.POSITION] > 0
    until(lambda: speed(master) < -0.9 * SPEED, lambda: keep_going(master, -SPEED))
    assert master.state == "OPERATION ENABLED"

    until(lambda: master.state == "FAULT")
    until(lambda: [error.code for error in master.emcy.active] == [RPDO_TIMEOUT])
    assert master.sdo[Object.ERROR_CODE].raw == RPDO_TIMEOUT
    until(lambda: abs(speed(master)) < 0.1)

    command(master, 0.0)
    master.reset_from_fault()
    assert master.state == "OPERATION ENABLED"
    assert master.emcy.active == []
    until(lambda: speed(master) > 0.9 * SPEED, lambda: keep_going(master, SPEED))
    master.state = "SWITCH ON DISABLED"
    until(lambda: abs(speed(master)) < 0.1)


def test_a_quick_stop_ends_with_the_motor_off(master: Any) -> None:
    set_up(master)
    master.state = "OPERATION ENABLED"
    until(lambda: speed(master) > 0.9 * SPEED, lambda: keep_going(master, SPEED))
    master.controlword = 0x0002
    until(lambda: master.state == "SWITCH ON DISABLED", lambda: command(master, SPEED))
    assert abs(speed(master)) < 1.0
