"""The simulated disk of the journal: writing takes time, and a process may end before it is done."""

from collections.abc import Callable

import pytest

from vrg.hal.simulated_clock import SimulatedClock
from vrg_faults.disk import TAKES, Disk
from vrg_faults.plan import Streams


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


def job(done: list[int], number: int) -> Callable[[], None]:
    return lambda: done.append(number)


def test_jobs_are_done_later_one_after_the_other(clock: SimulatedClock) -> None:
    disk, done = Disk(clock, Streams(1)("disk")), list[int]()
    futures = [disk.do(job(done, number)) for number in range(3)]
    assert not done
    clock.sleep(3.0 * TAKES[1])
    assert done == [0, 1, 2]
    assert all(future.done() for future in futures)


def test_a_disk_that_stalls_goes_on_when_all_that_held_it_is_over(clock: SimulatedClock) -> None:
    disk, done = Disk(clock, Streams(1)("disk")), list[int]()
    disk.hold(True)
    disk.hold(True)
    disk.do(job(done, 0))
    disk.hold(False)
    clock.sleep(1.0)
    assert not done
    disk.hold(False)
    clock.sleep(1.0)
    assert done == [0]


def test_of_what_a_process_waits_for_when_it_ends_only_the_first_may_be_done(clock: SimulatedClock) -> None:
    counts = set()
    for seed in range(20):
        disk, done = Disk(clock, Streams(seed)("disk")), list[int]()
        for number in range(3):
            disk.do(job(done, number))
        disk.abandon()
        clock.sleep(1.0)
        assert done == list(range(len(done)))
        counts.add(len(done))
    assert counts == {0, 1, 2, 3}
