"""How often windows draw."""

import pytest

from vrg.bus.node import Tick, due_index
from vrg.ui.pace import Pace

FRAME = 1 / 30
CLOCK = 0.02
"""The match time in s between two ticks of the world."""


def frames(seconds: float, rate: float) -> int:
    """The number of frames in so many seconds of real time, of a window whose node has the period of a frame."""
    pace, last, drawn = Pace(FRAME), -1, 0
    for number in range(round(seconds * rate / CLOCK)):
        time = number * CLOCK
        if due_index(time, FRAME) > last:
            last = due_index(time, FRAME)
            drawn += pace.due(Tick(time), rate)
    return drawn


@pytest.mark.parametrize("rate", [1.0, 2.0, 5.0])
def test_thirty_frames_a_second_also_by_a_clock_of_fifty_steps(rate: float) -> None:
    assert frames(10.0, rate) == pytest.approx(300, abs=2)


def test_without_a_clock_it_is_always_time_to_draw() -> None:
    pace = Pace(FRAME)
    assert [pace.due(Tick(1.0, live=False), 1.0) for _ in range(3)] == [True] * 3


def test_a_world_that_begins_anew_is_drawn_at_once() -> None:
    pace = Pace(FRAME)
    assert pace.due(Tick(9.0), 1.0)
    assert pace.due(Tick(1.0), 1.0)
