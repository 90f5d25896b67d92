"""How much is used of what comes: measurements of bodies, and pictures."""

import numpy as np
import pytest

from vrg_locate.stream import Pace


def used(
    rate: float, *bodies: str, came: float = 30.0, looks: float = 100.0, seconds: float = 20.0
) -> dict[str, float]:
    """The measurements of each body that are used in a second, if they come evenly one after the other.

    Args:
        came: how many come in a second of each. looks: how often the library looks; most of its frames are empty.
    """
    pace, taken, shown = Pace(rate), dict.fromkeys(bodies, 0), dict.fromkeys(bodies, 0)
    for look in range(round(seconds * looks)):
        now = 1000.0 + look / looks
        frame = [body for number, body in enumerate(bodies) if shown[body] < came * look / looks - number / len(bodies)]
        for body in frame:
            shown[body] += 1
            taken[body] += pace.takes(body, now)
        if not frame:
            pace.takes(None, now)
    return {body: count / seconds for body, count in taken.items()}


@pytest.mark.parametrize(("rate", "expected"), [(500.0, 30.0), (50.0, 30.0), (30.0, 30.0), (10.0, 10.0), (1.0, 1.0)])
@pytest.mark.parametrize("bodies", [("ann",), ("ann", "bob"), ("ann", "bob", "eve")])
def test_of_each_body_as_many_are_used_as_come_or_as_are_wanted(
    rate: float, expected: float, bodies: tuple[str, ...]
) -> None:
    for body, count in used(rate, *bodies).items():
        assert count == pytest.approx(expected, rel=0.05, abs=0.06), body


def test_frames_that_do_not_come_quite_evenly_are_used_as_often_as_is_wanted() -> None:
    pace = Pace(50.0)
    times = [number / 100.0 + (0.004 if number % 3 else 0.0) for number in range(2000)]
    assert sum(pace.takes("ann", time) for time in times) == pytest.approx(1000, abs=10)


@pytest.mark.parametrize(("rate", "expected"), [(15.0, 15), (10.0, 10), (60.0, 30)])
def test_no_more_pictures_are_looked_at_than_wanted(rate: float, expected: int) -> None:
    pace, rng = Pace(rate), np.random.default_rng(1)
    assert sum(pace.takes(None, n / 30 + rng.uniform(0, 0.01)) for n in range(300)) == pytest.approx(
        10 * expected, abs=8
    )
