"""The straight course of a robot at constant speed, fitted to sightings (thesis, eq. 4.2 and 4.3)."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vrg.agents.perception.scan import Floats
from vrg.bus.messages import Sighting
from vrg.types import Vector

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


@dataclass(frozen=True, eq=False)
class TrackedLine:
    """A course x(t) = x + vx (t - time), y(t) = y + vy (t - time), with what is known of its error.

    The fit is the weighted least squares of both functions at once: each sighting counts by the inverse of its
    covariance. So vertical courses need no special case, and noisy sightings of several robots are fused as they
    deserve. The fit is kept as the normal equations `information` p = `vector` for p = (x, vx, y, vy), to which each
    sighting adds its part. So the order of sightings does not matter.

    Args:
        time: the match time s at which the course is at (x, y).
        information: shape (4, 4). vector: shape (4,). Both are of the sightings alone.
        weight: how much is known of the velocity without them; see `start`, s^2/m^2.
        count: the number of sightings. first, last: the match times of the earliest and of the latest one, s.
    """

    time: float
    information: Floats
    vector: Floats
    weight: float = 0.0
    count: int = 0
    first: float = np.inf
    last: float = -np.inf

    @classmethod
    def start(cls, time: float, speed: float | None) -> "TrackedLine":
        """A course without sightings.

        Args:
            speed: how fast such a robot usually is, m/s, above 0. It holds the velocity near 0 while sightings say
                little about it, as one more measurement of a velocity of 0 with this standard deviation. None adds
                nothing.
        """
        return cls(time, np.zeros((4, 4)), np.zeros(4), 0.0 if speed is None else speed**-2)

    def seen(self, sighting: Sighting) -> "TrackedLine":
        """The course with one more sighting."""
        dt = sighting.time - self.time
        determinant = sighting.xx * sighting.yy - sighting.xy**2
        a, b, c = sighting.yy / determinant, -sighting.xy / determinant, sighting.xx / determinant
        dt2 = dt * dt
        part = np.array(
            [
                [a, a * dt, b, b * dt],
                [a * dt, a * dt2, b * dt, b * dt2],
                [b, b * dt, c, c * dt],
                [b * dt, b * dt2, c * dt, c * dt2],
            ]
        )
        u, v = a * sighting.x + b * sighting.y, b * sighting.x + c * sighting.y
        return replace(
            self,
            information=self.information + part,
            vector=self.vector + np.array([u, u * dt, v, v * dt]),
            count=self.count + 1,
            first=min(self.first, sighting.time),
            last=max(self.last, sighting.time),
        )

    @cached_property
    def _solved(self) -> "_Solution":
        """The course as numbers, counted from the middle of its sightings, where its errors are smallest.

        Raises:
            ValueError: the sightings do not determine it.
        """
        weights = self.information[0, 0] + self.information[2, 2]
        middle = self.time
        if weights > 0.0:
            middle += float(self.information[0, 1] + self.information[2, 3]) / float(weights)
        information, vector = self._counted_from(middle)
        information[1, 1] += self.weight
        information[3, 3] += self.weight
        # In units in which the diagonal is 1, so that seconds and metres do not decide whether it can be solved.
        scale = np.sqrt(np.maximum(information.diagonal(), 0.0))
        if not scale.all():
            raise ValueError(_UNDETERMINED)
        units = scale[:, None] * scale
        try:
            inverse = np.linalg.inv(information / units)
        except np.linalg.LinAlgError:
            raise ValueError(_UNDETERMINED) from None
        if not 0.0 < inverse.diagonal().max() < _MOST_INFLATED:
            raise ValueError(_UNDETERMINED)
        inverse /= units
        return _Solution(middle, (inverse @ vector).tolist(), inverse.tolist())

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
        information, vector = self._counted_from(time)
        return replace(self, time=time, information=information, vector=vector)

    def _counted_from(self, time: float) -> tuple[Floats, Floats]:
        """The normal equations with `time` as the time at which it is at (x, y), in arrays of their own."""
        dt = self.time - time
        turn = np.array([[1.0, dt, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, dt], [0.0, 0.0, 0.0, 1.0]])
        return turn.T @ self.information @ turn, turn.T @ self.vector

    def shifted(self, pause: float) -> "TrackedLine":
        """The same course, all of it `pause` s later."""
        return replace(self, time=self.time + pause, first=self.first + pause, last=self.last + pause)

    def joined(self, other: "TrackedLine") -> "TrackedLine":
        """The course with the sightings of another course, too. What it knew without sightings stays as it was."""
        other = other.counted_from(self.time)
        return replace(
            self,
            information=self.information + other.information,
            vector=self.vector + other.vector,
            count=self.count + other.count,
            first=min(self.first, other.first),
            last=max(self.last, other.last),
        )


def squared_distance(way: Vector, covariance: tuple[float, float, float]) -> float:
    """The squared Mahalanobis length of a way, by the covariance (xx, xy, yy)."""
    (dx, dy), (xx, xy, yy) = way, covariance
    return (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)


def fitted(sightings: Iterable[Sighting], *, time: float, speed: float | None = None) -> TrackedLine:
    """The course through sightings; see `TrackedLine`."""
    line = TrackedLine.start(time, speed)
    for sighting in sightings:
        line = line.seen(sighting)
    return line
