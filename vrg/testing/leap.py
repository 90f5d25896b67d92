"""Long ways between two looks of the referee: what many looks find on such a way, two must find."""

import itertools
import random
from dataclasses import replace
from typing import Any, Final

from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.geometry import interpolate
from vrg.testing.field import Field
from vrg.types import Pose

PERIOD: Final = 0.1
"""The time between two looks, s."""
PARTS: Final = 30
"""The looks by which the way of a leap is judged to compare."""


def leap(book: RuleBook[Any], ready: Observation, seed: int, by_looks: frozenset[str] = frozenset()) -> None:
    """Let one player drive a long way between two looks: whatever many looks find on it must be found by these two.

    Args:
        ready, seed: as for `trial`. by_looks: the rules that need not be found between looks.

    Raises:
        AssertionError: nothing was found.
    """
    rng = random.Random(seed)
    field = Field(book, ready, rng)
    if seed % 2:
        field.scatter(book.initial())
    before = replace(ready, poses=dict(field.poses), time=PERIOD, moving=frozenset())
    begun = book.judge(book.initial(), before, before, PERIOD)
    if begun.round_over:
        return
    name = rng.choice(sorted(field.poses))
    start, (x, y) = field.poses[name], field.spot(begun.state)
    # It drives through an interesting place, and on.
    far = 1.0 + rng.uniform(0.2, 1.5)
    end = Pose(start.x + (x - start.x) * far, start.y + (y - start.y) * far, start.theta)

    def at(fraction: float) -> Observation:
        poses = {**before.poses, name: interpolate(start, end, fraction)}
        return replace(before, poses=poses, time=PERIOD * (1.0 + fraction), moving=frozenset((name,)))

    whole = book.judge(begun.state, before, at(1.0), 2 * PERIOD)
    if whole.calls or whole.round_over or book.score(whole.state) != book.score(begun.state):
        return
    state = begun.state
    for one, two in itertools.pairwise(i / PARTS for i in range(PARTS + 1)):
        part = book.judge(state, at(one), at(two), PERIOD * (1.0 + two))
        found = [call for call in part.calls if call.rule not in by_looks]
        if found or (part.round_over and not part.calls):
            what = f"{found[0].rule}: {found[0].text}" if found else "the end of the round"
            way = f"from ({start.x:.2f}, {start.y:.2f}) to ({end.x:.2f}, {end.y:.2f})"
            raise AssertionError(
                f"{name} drives {way} between two looks, but nothing is called; with {PARTS} looks on the same way it "
                f"is {what}. Judge the whole way between the looks, with regions' `inside` and `exit_fraction` and "
                "vrg.segments.in_disc; or name the rule in `by_looks` of the test if no robot can drive so fast. To "
                f"repeat it: vrg.testing.leap.leap(book, ready, seed={seed})"
            )
        state = part.state
