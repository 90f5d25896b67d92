"""The straight course of a robot at constant speed, fitted to sightings (thesis, eq. 4.2 and 4.3)."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import mul

import numpy as np

from vrg.agents.perception.scan import Floats
from vrg.bus.messages import Sighting
from vrg.portable.scalars import inverse, square, total
from vrg.types import Vector

SAME_ERROR = 0.3
"""The time in s in which the errors of one source's sightings are the same: measured, as in `benchmarks/team.py`."""
COMMON = 0.5
"""The share of the covariance of one source's sightings that is an offset of all of them: measured, too."""
_POSITION = (0, 2)
"""The places of x and y among the parameters."""
_MOST_INFLATED = 1e12
"""The greatest factor by which the other parameters may increase the variance of one, if they count as determined."""
_UNDETERMINED = "expected sightings at two times, or a usual speed, got neither"


@dataclass(frozen=True, eq=False)
class _Solution:
    """A solved course. The numbers are Python's own, which are faster one by one.

    Args:
        time: the match time at which it is at (x, y), s.
        parameters: (x, vx, y, vy), m and m/s. covariance: theirs, in four rows.
    """

    time: float
    parameters: list[float]
    covariance: list[list[float]]


def _count_from(information: list[list[float]], vector: list[float], by: float) -> None:
    """Let normal equations count from a time that is `by` s earlier, in place; see `_Part.counted_from`."""
    for row in information:
        row[1] += by * row[0]
        row[3] += by * row[2]
    for place, rate in ((0, 1), (2, 3)):
        information[rate] = [p + by * q for p, q in zip(information[rate], information[place], strict=True)]
        vector[rate] += by * vector[place]


@dataclass(frozen=True, eq=False)
class _Part:
    """The sightings of a course that have one source.

    Args:
        information: shape (4, 4). vector: shape (4,). The normal equations of these sightings alone, as if their errors
            were independent; see `TrackedLine`.
        count: their number. first, last: the match times of the earliest and of the latest one, s.
    """

    information: Floats
    vector: Floats
    count: int
    first: float
    last: float

    def with_(self, other: "_Part") -> "_Part":
        """The sightings of both, which count from the same time."""
        return _Part(
            self.information + other.information,
            self.vector + other.vector,
            self.count + other.count,
            min(self.first, other.first),
            max(self.last, other.last),
        )

    def counted_from(self, by: float) -> "_Part":
        """The same if the course counts from a time that is `by` s earlier."""
        # The position then is x + by vx: a velocity counts as it does, and by times as its position does, too.
        information, vector = self.information.copy(), self.vector.copy()
        information[:, 1::2] += by * information[:, ::2]
        information[1::2] += by * information[::2]
        vector[1::2] += by * vector[::2]
        return replace(self, information=information, vector=vector)

    def plain(self) -> tuple[list[list[float]], list[float]]:
        """The normal equations as Python's own numbers, which are faster one by one."""
        return self.information.tolist(), self.vector.tolist()

    def honest(self) -> tuple[list[list[float]], list[float]]:
        """What these sightings tell if a part of their errors is the same in all; see `TrackedLine`."""
        worth = min(float(self.count), 1.0 + (self.last - self.first) / SAME_ERROR)
        share = worth / self.count
        rows, values = self.plain()
        information, vector = [[share * each for each in row] for row in rows], [share * each for each in values]
        # The offset is two more unknowns, with the covariance COMMON R, that are eliminated here. In the normal
        # equations they have the rows of the position, because the source sees only the sum of both.
        x, y = _POSITION
        of_x, of_y = information[x], information[y]
        known, own = worth * COMMON / (worth * COMMON + 1.0 - COMMON), 1.0 - COMMON
        (a, b), (_, d) = inverse([[of_x[x], of_x[y]], [of_y[x], of_y[y]]])
        gains = [
            (known * p * a + known * q * b, known * p * b + known * q * d) for p, q in zip(of_x, of_y, strict=True)
        ]
        left = [
            [(each - (g * p + h * q)) / own for each, p, q in zip(row, of_x, of_y, strict=True)]
            for row, (g, h) in zip(information, gains, strict=True)
        ]
        places = vector[x], vector[y]
        rest = [(each - (g * places[0] + h * places[1])) / own for each, (g, h) in zip(vector, gains, strict=True)]
        return left, rest


@dataclass(frozen=True, eq=False)
class TrackedLine:
    """A course x(t) = x + vx (t - time), y(t) = y + vy (t - time), with what is known of its error.

    The fit is the weighted least squares of both functions at once: each sighting counts by the inverse of its
    covariance. So vertical courses need no special case, and noisy sightings of several robots are fused as they
    deserve. The fit is kept as the normal equations `information` p = `vector` for p = (x, vx, y, vy), to which each
    sighting adds its part. So neither the order of sightings matters nor how late they come.

    What one source sees is off to about the same side for a while: its own pose is, and it sees the same side of the
    body. If this were neglected, a hundred sightings would look ten times as good as one. So of the sightings of one
    source only one in each SAME_ERROR counts in full (G. V. Bayley, J. M. Hammersley, The "Effective" Number of
    Independent Observations in an Autocorrelated Time Series, J. Royal Statistical Society Suppl. 8(2), 1946), and the
    share COMMON of their covariance is an offset that stays, which is considered as S. F. Schmidt does (Application of
    State-Space Methods to Navigation Problems, Advances in Control Systems 3, 1966). Two sources have different
    offsets, so they know more together than one that looks twice as often.

    Args:
        time: the match time s at which the course is at (x, y).
        weight: how much is known of the velocity without sightings; see `start`, s^2/m^2.
        parts: the sightings by their source; those of the source None have independent errors.
    """

    time: float
    weight: float = 0.0
    parts: Mapping[str | None, _Part] = field(default_factory=dict)

    @classmethod
    def start(cls, time: float, speed: float | None) -> "TrackedLine":
        """A course without sightings.

        Args:
            speed: how fast such a robot usually is, m/s, above 0. It holds the velocity near 0 while sightings say
                little about it, as one more measurement of a velocity of 0 with this standard deviation. None adds
                nothing.
        """
        return cls(time, 0.0 if speed is None else 1.0 / square(speed))

    @cached_property
    def count(self) -> int:
        """The number of sightings."""
        return sum(part.count for part in self.parts.values())

    @cached_property
    def first(self) -> float:
        """The match time of the earliest sighting, s; infinite without any."""
        return min((part.first for part in self.parts.values()), default=math.inf)

    @cached_property
    def last(self) -> float:
        """The match time of the latest sighting, s; minus infinity without any."""
        return max((part.last for part in self.parts.values()), default=-math.inf)

    def seen(self, sighting: Sighting, source: str | None = None) -> "TrackedLine":
        """The course with one more sighting.

        Args:
            source: who has seen it, such as the name of a player; None if its error is independent of all others.
        """
        dt = sighting.time - self.time
        determinant = sighting.xx * sighting.yy - square(sighting.xy)
        a, b, c = sighting.yy / determinant, -sighting.xy / determinant, sighting.xx / determinant
        dt2 = dt * dt
        information = np.array(
            [
                [a, a * dt, b, b * dt],
                [a * dt, a * dt2, b * dt, b * dt2],
                [b, b * dt, c, c * dt],
                [b * dt, b * dt2, c * dt, c * dt2],
            ]
        )
        u, v = a * sighting.x + b * sighting.y, b * sighting.x + c * sighting.y
        part = _Part(information, np.array([u, u * dt, v, v * dt]), 1, sighting.time, sighting.time)
        return self._with({source: part})

    def _with(self, parts: Mapping[str | None, _Part]) -> "TrackedLine":
        """The course with more sightings, which count from the same time."""
        both = dict(self.parts)
        for source, part in parts.items():
            both[source] = both[source].with_(part) if source in both else part
        return replace(self, parts=both)

    @cached_property
    def _solved(self) -> "_Solution":
        """The course as numbers, counted from the middle of its sightings, where its errors are smallest.

        Raises:
            ValueError: the sightings do not determine it.
        """
        information, vector = [[0.0] * 4 for _ in range(4)], [0.0] * 4
        for source, part in self.parts.items():
            rows, values = part.plain() if source is None else part.honest()
            information = [[p + q for p, q in zip(*both, strict=True)] for both in zip(information, rows, strict=True)]
            vector = [p + q for p, q in zip(vector, values, strict=True)]
        weights = information[0][0] + information[2][2]
        by = -(information[0][1] + information[2][3]) / weights if weights > 0.0 else 0.0
        _count_from(information, vector, by)
        information[1][1] += self.weight
        information[3][3] += self.weight
        # In units in which the diagonal is 1, so that seconds and metres do not decide whether it can be solved.
        scale = [math.sqrt(max(information[n][n], 0.0)) for n in range(4)]
        if not all(scale):
            raise ValueError(_UNDETERMINED)
        try:
            solved = inverse([[information[i][j] / (scale[i] * scale[j]) for j in range(4)] for i in range(4)])
        except ValueError:
            raise ValueError(_UNDETERMINED) from None
        if not 0.0 < max(solved[n][n] for n in range(4)) < _MOST_INFLATED:
            raise ValueError(_UNDETERMINED)
        covariance = [[solved[i][j] / (scale[i] * scale[j]) for j in range(4)] for i in range(4)]
        return _Solution(self.time - by, [total(map(mul, row, vector)) for row in covariance], covariance)

    @property
    def velocity(self) -> Vector:
        """The velocity (x, y), m/s."""
        _, vx, _, vy = self._solved.parameters
        return vx, vy

    @property
    def velocity_covariance(self) -> Floats:
        """The covariance of the velocity: shape (2, 2), m^2/s^2."""
        return np.array(self._solved.covariance)[1::2, 1::2]

    def at(self, time: float) -> Vector:
        """The position at a match time, m."""
        x, vx, y, vy = self._solved.parameters
        dt = time - self._solved.time
        return x + vx * dt, y + vy * dt

    def covariance_at(self, time: float) -> tuple[float, float, float]:
        """The covariance of the position at a match time: (xx, xy, yy), m^2."""
        dt = time - self._solved.time
        (a, b, c, d), (_, e, f, g), (_, _, h, k), (_, _, _, m) = self._solved.covariance
        return a + dt * (2 * b + dt * e), c + dt * (d + f + dt * g), h + dt * (2 * k + dt * m)

    def surprise(self, sighting: Sighting) -> float:
        """The squared Mahalanobis distance of a sighting from the course.

        For sightings of this course it has the chi-square distribution with two degrees of freedom.
        """
        x, y = self.at(sighting.time)
        xx, xy, yy = self.covariance_at(sighting.time)
        spread = (xx + sighting.xx, xy + sighting.xy, yy + sighting.yy)
        return squared_distance((sighting.x - x, sighting.y - y), spread)

    def counted_from(self, time: float) -> "TrackedLine":
        """The same course, with `time` as the time at which it is at (x, y)."""
        by = self.time - time
        return replace(self, time=time, parts={who: part.counted_from(by) for who, part in self.parts.items()})

    def shifted(self, pause: float) -> "TrackedLine":
        """The same course, all of it `pause` s later."""
        later = {who: replace(p, first=p.first + pause, last=p.last + pause) for who, p in self.parts.items()}
        return replace(self, time=self.time + pause, parts=later)

    def joined(self, other: "TrackedLine") -> "TrackedLine":
        """The course with the sightings of another course, too. What it knew without sightings stays as it was."""
        return self._with(other.counted_from(self.time).parts)


def squared_distance(way: Vector, covariance: tuple[float, float, float]) -> float:
    """The squared Mahalanobis length of a way, by the covariance (xx, xy, yy)."""
    (dx, dy), (xx, xy, yy) = way, covariance
    return (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)


def fitted(
    sightings: Iterable[Sighting], *, time: float, speed: float | None = None, source: str | None = None
) -> TrackedLine:
    """The course through sightings of one source; see `TrackedLine`."""
    line = TrackedLine.start(time, speed)
    for sighting in sightings:
        line = line.seen(sighting, source)
    return line
