"""When a node is ticked, by the clock messages that its process hears."""

import logging

import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.node import Tick
from vrg.bus.pacing import FROZEN, STALL, Pacer


def clock(time: float) -> Received[m.Clock]:
    body = m.Clock(time=time, tick=round(time / 0.02), epoch=0, rate=1.0, estop=False)
    return Received("m/clock", time, body.tick, body, "world/1")


def test_a_clock_that_stops_is_a_warning_and_one_that_has_not_begun_is_none(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    pacer = Pacer(0.1, 0.0)
    assert pacer.tick() is None
    pacer.hear([], 2.0 * STALL, cut=False)
    assert pacer.tick() == Tick(0.0, live=False)
    pacer.hear([clock(5.0)], 3.0, cut=False)
    assert pacer.tick() == Tick(5.0)
    for look in range(1, 7):
        pacer.hear([], 3.0 + 0.1 * look, cut=False)
    assert pacer.tick() == Tick(5.0, live=False)
    assert [(record.levelname, record.message) for record in caplog.records] == [
        ("INFO", "waiting for the world's clock"),
        ("WARNING", "the world's clock has stopped at 5.00 s"),
    ]


def test_a_process_that_was_frozen_hears_that_time_had_stopped_before_it_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Ctrl-Z, or a closed lid: a referee halts a match with physical robots, and no player drives on unasked."""
    pacer = Pacer(0.1, 0.0)
    pacer.hear([clock(5.0)], 1.0, cut=False)
    assert pacer.tick() == Tick(5.0)
    pacer.hear([clock(5.1)], 1.0 + FROZEN + 0.1, cut=False)
    assert pacer.tick() == Tick(5.1, live=False, frozen=pytest.approx(FROZEN + 0.1))
    assert [record.message for record in caplog.records] == ["this process did not run for 1.1 s at 5.10 s"]
    pacer.hear([clock(5.2)], 2.2, cut=False)
    assert pacer.tick() == Tick(5.2)
    assert pacer.tick() is None
    pacer.hear([], 5.0, cut=False)
    assert pacer.tick() == Tick(5.2, live=False, frozen=pytest.approx(2.8)), "nor did the world meanwhile"
    pacer.hear([], 5.1, cut=False)
    assert pacer.tick() == Tick(5.2, live=False, frozen=pytest.approx(2.8)), "it may hear of the clock in a moment"
    pacer.hear([], 5.1 + STALL, cut=False)
    assert pacer.tick() == Tick(5.2, live=False), "now it is the world alone that does not"


def test_a_process_that_did_not_run_for_a_moment_blames_itself_and_not_the_clock(
    caplog: pytest.LogCaptureFixture,
) -> None:
    pacer = Pacer(0.1, 0.0)
    pacer.hear([clock(5.0)], 1.0, cut=False)
    pacer.hear([], 1.1, cut=False)
    pacer.hear([], 1.8, cut=False)
    assert pacer.tick() == Tick(5.0, live=False, frozen=pytest.approx(0.7))
    pacer.hear([], 1.9, cut=False)
    assert pacer.tick() == Tick(5.0, live=False, frozen=pytest.approx(0.7))
    pacer.hear([clock(5.1)], 2.0, cut=False)
    assert pacer.tick() == Tick(5.1)
    assert [record.message for record in caplog.records] == ["this process did not run for 0.7 s at 5.00 s"]
