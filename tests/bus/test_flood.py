"""When a key counts as flooded, and for how long."""

import threading
from collections.abc import Callable

from vrg.bus.flood import MAX_MESSAGE_RATE, RATE_WINDOW, FlowMeter


def admitted(meter: FlowMeter, key: str, number: int, now: float) -> int:
    return sum(meter.admits(key, now) for _ in range(number))


def test_as_many_messages_as_the_limit_are_no_flood() -> None:
    meter = FlowMeter()
    for second in range(5):
        assert admitted(meter, "a", MAX_MESSAGE_RATE, 10.0 + second) == MAX_MESSAGE_RATE
    assert meter.flooded(14.5) == frozenset()


def test_beyond_the_limit_a_key_is_named_at_once_and_refused_while_the_flood_lasts_and_others_do_not_suffer() -> None:
    meter = FlowMeter()
    assert admitted(meter, "a", MAX_MESSAGE_RATE + 5, 10.0) == MAX_MESSAGE_RATE
    assert meter.flooded(10.0) == {"a"}
    assert admitted(meter, "b", 50, 10.5) == 50
    for second in range(1, 5):
        assert admitted(meter, "a", MAX_MESSAGE_RATE + 1, 10.0 + second) == 0
    assert meter.flooded(14.9) == {"a"}


def test_a_window_with_fewer_ends_it() -> None:
    meter = FlowMeter()
    admitted(meter, "a", MAX_MESSAGE_RATE + 1, 10.0)
    assert admitted(meter, "a", 10, 11.0) == 0
    assert admitted(meter, "a", 10, 12.0) == 10
    assert meter.flooded(12.0) == frozenset()


def test_it_ends_without_any_message_too() -> None:
    meter = FlowMeter()
    admitted(meter, "a", MAX_MESSAGE_RATE + 1, 10.0)
    assert meter.flooded(10.0 + 2 * RATE_WINDOW) == frozenset()
    assert meter.admits("a", 20.0)


class Interrupted(float):
    """A time at which another thread comes in between when it is compared for the second time."""

    meanwhile: Callable[[], None]
    looks = 0

    def __sub__(self, other: float) -> float:
        self.looks += 1
        passed = float(self) - other
        if self.looks == 2:
            self.meanwhile()
        return passed


def test_two_threads_that_begin_a_window_together_lose_no_flood() -> None:
    meter = FlowMeter()
    admitted(meter, "a", MAX_MESSAGE_RATE + 1, 10.0)
    other = threading.Thread(target=lambda: meter.admits("b", 11.0))

    def meanwhile() -> None:
        other.start()
        other.join(0.2)  # it waits for the first one

    now = Interrupted(11.0)
    now.meanwhile = meanwhile
    meter.admits("b", now)
    other.join()
    assert not meter.admits("a", 11.0)
