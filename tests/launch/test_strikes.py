"""How often a player may fail."""

from vrg.launch.strikes import FAILURES, HANGS, STRIKE_WINDOW, Strikes


def test_so_many_failures_within_a_while_and_no_more() -> None:
    strikes = Strikes()
    assert [strikes.failure(float(i)) for i in range(FAILURES + 1)] == [True] * FAILURES + [False]


def test_failures_that_are_long_ago_do_not_count() -> None:
    strikes = Strikes()
    assert all(strikes.failure(i * (STRIKE_WINDOW / FAILURES + 0.1)) for i in range(10 * FAILURES))


def test_a_hang_counts_more_than_a_failure() -> None:
    strikes = Strikes()
    assert [strikes.hang(float(i)) for i in range(HANGS + 1)] == [True] * HANGS + [False]
    assert strikes.failure(5.0)
