"""An emulated CiA 402 drive as a node of its network: what it keeps, remembers, tells, and does when it is cut off."""

import pytest

from tests.hal.can.cia402.wire import NODE, Wire
from vrg.hal.can.cia402.codec import SAVE, DriveState, Function, Nmt, NmtCommand, Object
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.cia402.states import AbortOption, ErrorBehaviour
from vrg.hal.can.workshop.faults import FaultKind

MASTER = 100


def emergencies(wire: Wire) -> list[int]:
    return [int.from_bytes(f.data[:2], "little") for f in wire.heard if f.id == Function.EMCY | NODE]


def nmt(wire: Wire, command: NmtCommand) -> None:
    wire.inject(Frame(Function.NMT, bytes([command, NODE])))


@pytest.mark.parametrize(
    "index",
    [0x1010, 0x1016, 0x1029, 0x6007],
)
def test_it_has_the_objects_of_the_standards(index: int) -> None:
    assert Wire().meet().ask(index).unsigned is not None


def test_a_stopped_node_sends_no_emergency() -> None:
    wire = Wire().running()
    wire.heard.clear()
    nmt(wire, NmtCommand.STOP)
    wire.fault(FaultKind.ERROR)
    wire.advance(0.5)
    assert emergencies(wire) == []
    assert wire.drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


def test_what_is_saved_is_there_after_a_start_and_nothing_else() -> None:
    wire = Wire().meet()
    wire.write(Object.ACCELERATION, 0, 1234, 4)
    assert wire.write(Object.STORE, 1, 1, 4) == 0x0800_0020, "the word is missing"
    assert wire.write(Object.STORE, 1, SAVE, 4) == 0
    wire.write(Object.DECELERATION, 0, 4321, 4)
    nmt(wire, NmtCommand.RESET_NODE)
    wire.advance(1.0)
    assert wire.ask(Object.ACCELERATION).unsigned == 1234
    assert wire.ask(Object.DECELERATION).unsigned != 4321


@pytest.mark.parametrize(
    ("option", "state"),
    [
        (AbortOption.NOTHING, DriveState.OPERATION_ENABLED),
        (AbortOption.FAULT, DriveState.FAULT),
    ],
)
def test_what_it_does_when_the_network_leaves_it(option: AbortOption, state: DriveState) -> None:
    wire = Wire().running()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, option, 2)
    nmt(wire, NmtCommand.PRE_OPERATIONAL)
    assert wire.drive.state is state


@pytest.mark.parametrize(
    ("behaviour", "network"),
    [
        (ErrorBehaviour.PRE_OPERATIONAL, Nmt.PRE_OPERATIONAL),
        (ErrorBehaviour.NO_CHANGE, Nmt.OPERATIONAL),
        (ErrorBehaviour.STOPPED, Nmt.STOPPED),
    ],
)
def test_a_master_that_falls_silent_is_noticed(behaviour: ErrorBehaviour, network: Nmt) -> None:
    wire = Wire().running()
    wire.write(Object.ERROR_BEHAVIOUR, 1, behaviour, 1)
    wire.write(Object.CONSUMER_HEARTBEAT, 1, MASTER << 16 | 300, 4)
    wire.drive_on(8.0, 1.0)
    assert wire.drive._nmt == Nmt.OPERATIONAL, "it begins with the first heartbeat"
    for _ in range(5):
        wire.inject(Frame(Function.HEARTBEAT | MASTER, bytes([Nmt.OPERATIONAL])))
        wire.drive_on(8.0, 0.2)
    assert 0x8130 not in emergencies(wire)
    wire.drive_on(8.0, 0.3)
    assert (0x8130 in emergencies(wire)) == (network is not Nmt.STOPPED)
    assert wire.drive._nmt == network
    assert wire.drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


@pytest.mark.parametrize("state", [NmtCommand.PRE_OPERATIONAL])
def test_a_drive_that_goes_on_when_it_is_cut_off_is_switched_off_all_the_same(state: NmtCommand) -> None:
    wire = Wire().running()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, AbortOption.NOTHING, 2)
    nmt(wire, state)
    wire.advance(0.3)
    assert wire.motor_speed > 5.0
    assert wire.axis.on
    wire.axis.idle()
    wire.advance(0.5)
    assert abs(wire.motor_speed) < 0.1
    assert wire.axis.on is False


def test_the_set_up_lets_no_drive_go_on_without_a_network() -> None:
    wire = Wire().meet()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, AbortOption.NOTHING, 2)
    wire.axis.prepare()
    assert wire.ask(Object.ABORT_CONNECTION_OPTION).unsigned == AbortOption.FAULT
