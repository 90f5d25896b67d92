"""Simulated time: what is due happens in its order, work goes on beside, and nothing is left behind."""

import math
import queue
import threading

import pytest

from vrg.hal.simulated_clock import SimulatedClock


def test_who_sleeps_lets_everything_happen_that_is_due() -> None:
    clock, seen = SimulatedClock(), list[tuple[str, float]]()
    for time, name in ((0.3, "c"), (0.1, "a"), (0.1, "b"), (0.9, "late")):
        clock.at(time, lambda name=name: seen.append((name, clock.now())))  # type: ignore[misc]
    clock.sleep(0.5)
    assert seen == [("a", 0.1), ("b", 0.1), ("c", 0.3)]
    assert clock.now() == 0.5


def test_a_condition_is_met_at_the_very_moment() -> None:
    clock, done = SimulatedClock(), list[int]()
    clock.at(0.2, lambda: done.append(1))
    assert clock.wait(lambda: done, 1.0)
    assert clock.now() == 0.2
    assert not clock.wait(lambda: len(done) > 1, 1.0)
    assert clock.now() == 1.2


def test_an_item_is_waited_for() -> None:
    clock, items = SimulatedClock(), queue.Queue[int]()
    clock.at(0.2, lambda: items.put(7))
    assert clock.take(items, 1.0) == 7
    with pytest.raises(queue.Empty):
        clock.take(items, 1.0)
    assert clock.now() == 1.2


def test_work_goes_on_beside_its_caller_one_at_a_time() -> None:
    clock, seen = SimulatedClock(), list[str]()

    def work() -> None:
        for number in range(3):
            seen.append(f"work {number} at {clock.now():g}")
            clock.sleep(0.1)

    task = clock.spawn(work, "work")
    assert not seen
    assert task.is_alive()
    clock.sleep(0.15)
    seen.append(f"caller at {clock.now():g}")
    task.join()
    assert not task.is_alive()
    assert seen == ["work 0 at 0", "work 1 at 0.1", "caller at 0.15", "work 2 at 0.2"]


def test_what_work_raises_is_raised_where_time_passes() -> None:
    clock = SimulatedClock()

    def work() -> None:
        clock.sleep(0.1)
        raise ValueError("broken")

    task = clock.spawn(work, "work")
    with pytest.raises(ValueError, match="broken"):
        clock.sleep(1.0)
    assert not task.is_alive()


def test_no_thread_is_left_of_work_that_waits_for_ever() -> None:
    clock, before = SimulatedClock(), threading.active_count()

    def work() -> None:
        try:
            clock.sleep(1e9)
        finally:
            clock.sleep(1.0)  # also what clears up may want to wait

    tasks = [clock.spawn(work, "work") for _ in range(3)]
    clock.sleep(1.0)
    never = clock.spawn(work, "never begun")
    clock.close()
    assert not any(task.is_alive() for task in [*tasks, never])
    for thread in threading.enumerate():
        if thread.name == "work":
            thread.join(10.0)
    assert threading.active_count() == before


def test_all_work_is_ended_whatever_one_raises_meanwhile() -> None:
    clock, before = SimulatedClock(), threading.active_count()

    def work() -> None:
        try:
            clock.sleep(1e9)
        finally:
            raise ValueError("broken")

    for _ in range(3):
        clock.spawn(work, "work")
    clock.sleep(1.0)
    with pytest.raises(ValueError, match="broken"):
        clock.close()
    assert threading.active_count() == before


def test_a_wait_that_nothing_can_end_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="nothing is left to happen"):
        SimulatedClock().wait(lambda: False, math.inf)
