"""When a key counts as flooded, and for how long."""

from vrg.bus.flood import LIMIT, WINDOW, FlowMeter


def admitted(meter: FlowMeter, key: str, number: int, now: float) -> int:
    return sum(meter.admits(key, now) for _ in range(number))


def test_as_many_messages_as_the_limit_are_no_flood() -> None:
    meter = FlowMeter()
    for second in range(5):
        assert admitted(meter, "a", LIMIT, 10.0 + second) == LIMIT
    assert meter.flooded(14.5) == frozenset()


def test_what_is_beyond_the_limit_is_refused_and_its_key_is_named_at_once() -> None:
    meter = FlowMeter()
    assert admitted(meter, "a", LIMIT + 5, 10.0) == LIMIT
    assert meter.flooded(10.0) == {"a"}


def test_nothing_passes_while_a_flood_lasts() -> None:
    meter = FlowMeter()
    admitted(meter, "a", LIMIT + 1, 10.0)
    for second in range(1, 5):
        assert admitted(meter, "a", LIMIT + 1, 10.0 + second) == 0
    assert meter.flooded(14.9) == {"a"}


def test_a_window_with_fewer_ends_it() -> None:
    meter = FlowMeter()
    admitted(meter, "a", LIMIT + 1, 10.0)
    assert admitted(meter, "a", 10, 11.0) == 0
    assert admitted(meter, "a", 10, 12.0) == 10
    assert meter.flooded(12.0) == frozenset()


def test_it_ends_without_any_message_too() -> None:
    meter = FlowMeter()
    admitted(meter, "a", LIMIT + 1, 10.0)
    assert meter.flooded(10.0 + 2 * WINDOW) == frozenset()
    assert meter.admits("a", 20.0)


def test_other_keys_do_not_suffer() -> None:
    meter = FlowMeter()
    admitted(meter, "a", 3 * LIMIT, 10.0)
    assert admitted(meter, "b", 50, 10.5) == 50
    assert meter.flooded(10.5) == {"a"}
