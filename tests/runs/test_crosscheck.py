"""A recording is compared with what the referee saw, instant by instant."""

import numpy as np

from vrg.coordinator.evidence import Exhibit, Looked, TickEvidence
from vrg.coordinator.rulebook import Observation
from vrg.recording.reader import RobotPoses
from vrg.runs.crosscheck import cross_check
from vrg.types import Pose

TIMES = np.arange(100) * 0.02
"""A recording of 2 s. The referee looks at each fifth instant."""


def track(name: str, x: float = 1.0) -> RobotPoses:
    still = np.zeros(len(TIMES))
    words = [""] * len(TIMES)
    return RobotPoses(name, False, TIMES, still + x, still, still, words, words, still.astype(int), still == 0.0)


def seen(time: float, **xs: float) -> Exhibit:
    field = Observation({name: Pose(x, 0.0, 0.0) for name, x in xs.items()}, time=time)
    return Exhibit(TickEvidence(after=0, time=time, field=field, entries=[Looked(0.1, [])]), "", genuine=True)


def test_a_recording_of_what_the_referee_saw_agrees() -> None:
    looks = [seen(0.1 * i, ann=1.0, bob=2.0) for i in range(25)]
    assert cross_check([track("ann"), track("bob", 2.0)], looks) == ([], 2 * 20)


def test_who_is_recorded_elsewhere_is_named_once() -> None:
    looks = [seen(0.1 * i, ann=1.0, bob=2.0 if i < 15 else 2.5) for i in range(20)]
    (found,), compared = cross_check([track("ann"), track("bob", 2.0)], looks)
    assert (compared, found.time) == (40, 1.5)
    assert "bob 0.500 m from where the referee saw it, and at 4 further instants" in found.what


def test_when_the_world_steps_back_what_was_seen_again_counts() -> None:
    looks = [seen(0.1 * i, ann=9.0 if i > 4 else 1.0) for i in range(10)]
    looks += [seen(0.1 * i, ann=1.0) for i in range(5, 10)]
    assert cross_check([track("ann")], looks) == ([], 7)


def test_instants_to_which_the_world_stepped_back_during_a_halt_are_not_compared() -> None:
    """The referee notes the first of them alone, as it judges nothing while play is halted."""
    looks = [seen(0.1 * i, ann=9.0 if i > 4 else 1.0) for i in range(10)]
    assert len(cross_check([track("ann")], looks)[0]) == 1
    assert cross_check([track("ann")], [*looks, seen(0.7, ann=1.0)]) == ([], 5)
