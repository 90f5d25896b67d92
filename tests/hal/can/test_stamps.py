"""How long frames have waited to be read, by stamps of a clock that somebody may set."""

import pytest

from vrg.hal.can.bus import Stamps

DAY = 1.8e9
"""The time of day when the monotonic clock was 0, s."""


@pytest.fixture
def stamps() -> Stamps:
    """After a while in which nobody has set the clock."""
    stamps = Stamps()
    for tick in range(100):
        now = 0.1 * tick
        stamps.age(DAY + now, DAY + now, now)
    return stamps


def test_a_frame_is_as_old_as_it_has_waited(stamps: Stamps) -> None:
    assert stamps.age(DAY + 9.2, DAY + 10.0, 10.0) == pytest.approx(0.8, abs=1e-6)
    assert stamps.age(DAY + 10.0, DAY + 10.0, 10.0) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("step", [0.5, 3600.0, -0.5, -3600.0])
def test_a_clock_that_is_set_makes_no_frame_old(stamps: Stamps, step: float) -> None:
    """Neither one that was stamped before, nor those that follow."""
    assert stamps.age(DAY + 9.99, DAY + step + 10.0, 10.0) < 0.02
    for tick in range(1, 50):
        now = 10.0 + 0.1 * tick
        assert stamps.age(DAY + step + now, DAY + step + now, now) < 0.02


@pytest.mark.parametrize("step", [0.5, -0.5])
def test_a_second_after_that_a_freeze_is_noticed_again(stamps: Stamps, step: float) -> None:
    stamps.age(DAY + step + 10.0, DAY + step + 10.0, 10.0)
    stamps.age(DAY + step + 11.5, DAY + step + 11.5, 11.5)
    assert stamps.age(DAY + step + 12.0, DAY + step + 12.8, 12.8) == pytest.approx(0.8, abs=1e-6)


def test_a_freeze_alone_is_no_clock_that_is_set(stamps: Stamps) -> None:
    assert stamps.age(DAY + 10.0, DAY + 13.0, 13.0) == pytest.approx(3.0, abs=1e-6)
