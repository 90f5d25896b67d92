"""What an emulated ODrive keeps and forgets."""

import struct

import pytest

from tests.hal.can.odrive.test_drive import NODE, SERIAL, Bench
from vrg.hal.can.odrive import codec, messages

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


@pytest.fixture
def bench() -> Bench:
    return Bench()
