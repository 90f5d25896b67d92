"""Who hangs is judged by the others: a machine that stalls is nobody's fault."""

import pytest

from vrg.launch.pulses import HUNG, Pulses

NAMES = ("world", "ann", "bob")


def beating(pulses: Pulses, names: tuple[str, ...], start: float, seconds: float) -> float:
    """Everybody of these beats twice a second for a while; when that ends."""
    for step in range(int(seconds * 2)):
        pulses.record(names, start + step / 2)
    return start + seconds


@pytest.fixture
def pulses() -> Pulses:
    """Everybody has beaten for 5 s."""
    pulses = Pulses(0.0)
    beating(pulses, NAMES, 0.0, 5.0)
    assert pulses.hung() == []
    return pulses


def test_who_falls_silent_while_others_beat_hangs(pulses: Pulses) -> None:
    now = beating(pulses, ("world", "bob"), 5.0, HUNG)
    assert pulses.hung() == []
    beating(pulses, ("world", "bob"), now, 1.0)
    assert pulses.hung() == ["ann"]


def test_a_stall_that_hit_everybody_is_no_hang_of_anybody(pulses: Pulses) -> None:
    """After a minute one of them comes back first, and the others a moment later."""
    assert pulses.silence(65.0) > 60.0
    pulses.record(["world"], 65.0)
    assert pulses.hung() == []
    now = beating(pulses, ("world",), 65.5, 1.0)
    assert pulses.hung() == []
    beating(pulses, NAMES, now, 5.0)
    assert pulses.hung() == []


def test_who_does_not_come_back_from_a_stall_hangs_after_all(pulses: Pulses) -> None:
    beating(pulses, ("world", "bob"), 65.0, HUNG + 1.0)
    assert pulses.hung() == ["ann"]


def test_who_was_never_felt_or_is_started_anew_is_not_missed(pulses: Pulses) -> None:
    pulses.forget("ann")
    beating(pulses, ("world", "bob"), 5.0, 60.0)
    assert pulses.hung() == []
