"""What an emulated ODrive keeps and forgets, and how it approaches a position."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.hal.can.odrive.test_drive import NODE, SERIAL, Bench
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisState
from vrg.hal.can.workshop.odrive.inputs import Filter, InputMode, Trajectory

WATCHDOG = 1


def watchdog(bench: Bench) -> float:
    """What its first endpoint says."""
    (answer,) = bench.tell(messages.RxSdo(0, WATCHDOG), node=bench.drive.node)
    assert isinstance(answer, messages.TxSdo)
    return float(struct.unpack("<f", struct.pack("<I", answer.value))[0])


def change(bench: Bench) -> None:
    """Another id, watchdog and limits."""
    bench.tell(messages.RxSdo(1, WATCHDOG, struct.unpack("<I", struct.pack("<f", 0.5))[0]))
    bench.tell(messages.SetLimits(7.0, 3.0))
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)


def test_what_was_not_saved_is_forgotten(bench: Bench) -> None:
    before = watchdog(bench)
    change(bench)
    assert watchdog(bench) == 0.5
    bench.tell(messages.Reboot(0), node=9)
    bench.run(1.0)
    assert (bench.drive.node, watchdog(bench)) == (NODE, before)
    assert bench.drive.motor.velocity_limit == bench.drive.options.motor.velocity_limit


def test_what_was_saved_is_kept(bench: Bench) -> None:
    change(bench)
    bench.tell(messages.Reboot(1), node=9)
    bench.run(1.0)
    assert (bench.drive.node, watchdog(bench)) == (9, 0.5)
    assert (bench.drive.motor.velocity_limit, bench.drive.motor.current_limit) == (7.0, 3.0)


def test_what_is_erased_is_as_from_the_box(bench: Bench) -> None:
    bench.tell(messages.Reboot(2))
    bench.run(1.0)
    assert bench.drive.node == codec.BROADCAST, "it has no id"
    assert bench.run(1.0) == []


def test_one_whose_id_another_drive_is_given_waits_for_a_new_one(bench: Bench) -> None:
    bench.tell(messages.Address(NODE, SERIAL + 1), node=codec.BROADCAST)
    assert bench.drive.node == codec.BROADCAST
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)
    assert bench.drive.node == 9


def test_nobody_takes_the_id_of_one_that_drives(bench: Bench) -> None:
    bench.close_loop()
    bench.tell(messages.Address(NODE, SERIAL + 1), node=codec.BROADCAST)
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)
    assert bench.drive.node == NODE


@pytest.mark.parametrize("mode", [InputMode.POS_FILTER, InputMode.TRAP_TRAJ])
def test_a_position_is_approached_gently(bench: Bench, mode: InputMode) -> None:
    bench.tell(messages.SetControllerMode(messages.ControlMode.POSITION, mode))
    bench.tell(messages.SetAxisState(AxisState.CLOSED_LOOP_CONTROL))
    fastest = 0.0
    for tick in range(200):
        bench.tell(messages.SetInputPos(20.0))
        bench.run(0.05)
        fastest = max(fastest, abs(bench.drive.motor.velocity))
        if mode is InputMode.TRAP_TRAJ and tick == 10:
            assert bench.heartbeat.done == 0
    assert bench.drive.motor.position == pytest.approx(20.0, abs=0.05)
    assert fastest < 17.0, "as it is, 20 turns away would be 120 turn/s"
    assert bench.heartbeat.done == 1


@given(st.floats(-50, 50), st.lists(st.floats(0.001, 0.5), min_size=1, max_size=50))
def test_a_filter_comes_near_and_never_beyond(aim: float, steps: list[float]) -> None:
    filtered = Filter(2.0)
    for dt in steps:
        before = abs(aim - filtered.position)
        position = filtered.follow(aim, dt)
        assert abs(aim - position) <= before + 1e-9
        assert min(0.0, aim) - 1e-9 <= position <= max(0.0, aim) + 1e-9


@given(st.floats(-50, 50))
def test_a_trajectory_keeps_its_limits_and_arrives(aim: float) -> None:
    way = Trajectory(10.0, 20.0, 20.0)
    before, speed = 0.0, 0.0
    for _ in range(2000):
        position = way.follow(aim, 0.005)
        assert abs(position - before) <= 10.0 * 0.005 + 1e-9
        assert abs(way.velocity) - abs(speed) <= 20.0 * 0.005 + 1e-9
        before, speed = position, way.velocity
    assert position == aim
    assert way.done


@pytest.fixture
def bench() -> Bench:
    return Bench()
