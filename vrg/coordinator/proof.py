"""Why a call was made: the numbers that decided it, as a rule book computes them after the match. Pure."""

import enum
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from vrg.bus.messages import Call
from vrg.coordinator.rulebook import Observation
from vrg.geometry import SIGMAS
from vrg.portable.scalars import square
from vrg.regions import Region
from vrg.types import Pose, Uncertainty, Vector

ROUNDING = 1e-6
"""The difference up to which a number and a limit count as equal: an instant between looks is found only so well."""


class Relation(enum.StrEnum):
    """The relation of a number to a limit."""

    AT_MOST = "at most"
    AT_LEAST = "at least"
    MORE_THAN = "more than"


@dataclass(frozen=True)
class Measure:
    """A number that decided a call, and the limit that the rules set.

    Args:
        what: what was measured, in words, such as `distance between the outlines of ann and bob`.
        value, limit: in `unit`. relation: how the value must be to the limit for the call to be right. The value of a
            call that is wrong must be on the other side of the limit: a distance from a region that is at least 0
            proves nothing, and `Region.signed_distance` does.
        ends: where it was measured, from and to, m; None for what is no distance on the field.
        deviation: the standard deviation of the value, in `unit`, by that of the poses; None where that is not known.
    """

    what: str
    value: float
    relation: Relation
    limit: float
    unit: str = "m"
    ends: tuple[Vector, Vector] | None = None
    deviation: float | None = None

    def __str__(self) -> str:
        words = f"{self.what}: {self.short} ({self.relation} {_number(self.limit)}{self._unit})"
        if self.deviation is None:
            return words
        known = f"known to {_number(SIGMAS * self.deviation)}{self._unit}"
        return f"{words}, {known}{', so that it may be on the other side of the limit' if self.doubtful else ''}"

    @property
    def doubtful(self) -> bool:
        """True if the value is nearer to its limit than it is known."""
        return self.deviation is not None and abs(self.value - self.limit) < SIGMAS * self.deviation

    @property
    def holds(self) -> bool:
        """True if the number is as the rules want it, as far as numbers can be distinguished."""
        if self.relation is Relation.AT_MOST:
            return self.value <= self.limit + ROUNDING
        return self.value >= self.limit - ROUNDING

    @property
    def short(self) -> str:
        """The value alone."""
        return f"{_number(self.value)}{self._unit}"

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""


def with_deviation(measure: Measure, bodies: Iterable[tuple[Pose, float, Uncertainty]]) -> Measure:
    """The measure with the deviation of its value, if one of its ends is on a body whose pose is uncertain.

    Args:
        bodies: the poses of the players of the call, the radius of the circle around each robot, m, and how well its
            pose is known.
    """
    if measure.ends is None:
        return measure
    (x, y), (to_x, to_y) = measure.ends
    length, variance, found = math.hypot(to_x - x, to_y - y), 0.0, False
    for pose, radius, known in bodies:
        if min(math.dist((pose.x, pose.y), end) for end in measure.ends) > radius + ROUNDING:
            continue
        found = True
        if length > ROUNDING:
            u, v = (to_x - x) / length, (to_y - y) / length
            variance += u * u * known.xx + 2 * u * v * known.xy + v * v * known.yy
        else:  # they touch: whichever direction is the least known
            variance += square(known.ellipse[0])
    return replace(measure, deviation=math.sqrt(max(0.0, variance))) if found else measure


def outside(what: str, region: Region, pose: Pose) -> Measure:
    """The measure by which a centre is outside a region; inside it its value is negative."""
    value = region.signed_distance(pose.x, pose.y)
    return Measure(what, value, Relation.MORE_THAN, 0, ends=((pose.x, pose.y), region.nearest(pose.x, pose.y)))


@dataclass(frozen=True)
class Case:
    """A call and the instants between which it was made.

    Args:
        state: the rule book's state before. before, now: the field at the two looks.
    """

    call: Call
    state: Any
    before: Observation
    now: Observation


Prover = Callable[[Any, Case], Sequence[Measure]]
"""A function of a rule book and a case that returns the numbers that decided it; none where no number did."""


def _number(value: float) -> str:
    """A number with two decimals; small ones have three, and whole ones none."""
    if value == round(value):
        return f"{value:.0f}"
    return f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.3f}"
