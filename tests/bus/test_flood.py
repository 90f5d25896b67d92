"""When a key counts as flooded, and for how long."""

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
