"""The straight course of a robot at constant speed, fitted to sightings (thesis, eq. 4.2 and 4.3)."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vrg.agents.perception.scan import Floats
from vrg.bus.messages import Sighting
from vrg.types import Vector


@dataclass(frozen=True)
class Line:
    """A course x(t) = x + vx (t - time), y(t) = y + vy (t - time), with what is known of its error.

    The fit is the weighted least squares of both functions at once: each sighting counts by the inverse of its
    covariance. So vertical courses need no special case, and noisy sightings of several robots are fused as they
    deserve. The fit is kept as the normal equations `information` p = `vector` for p = (x, vx, y, vy), to which each
    sighting adds its part. So the order of sightings does not matter.

    Args:
        time: the match time s at which the course is at (x, y).
        information: shape (4, 4). vector: shape (4,). count: the number of sightings.
        first, last: the match times of the earliest and of the latest sighting, s.
    """

    time: float
    information: Floats
    vector: Floats
    count: int = 0
    first: float = np.inf
    last: float = -np.inf

    @classmethod
    def start(cls, time: float, speed: float | None) -> "Line":
        """A course without sightings.

        Args:
            speed: how fast such a robot usually is, m/s. It holds the velocity near 0 while sightings say little about
                it, as one more measurement of a velocity of 0 with this standard deviation. None adds nothing.
        """
        weight = 0.0 if speed is None else speed**-2
        return cls(time, np.diag([0.0, weight, 0.0, weight]), np.zeros(4))

    def seen(self, sighting: Sighting) -> "Line":
        """The course with one more sighting."""
        dt = sighting.time - self.time
        determinant = sighting.xx * sighting.yy - sighting.xy**2
        if determinant <= 0.0:
            raise ValueError(f"expected a covariance that is positive definite, got {sighting}")
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
        return Line(
            self.time,
            self.information + part,
            self.vector + np.array([u, u * dt, v, v * dt]),
            self.count + 1,
            min(self.first, sighting.time),
            max(self.last, sighting.time),
        )

    @cached_property
    def _solved(self) -> tuple[Floats, Floats]:
        """(x, vx, y, vy), shape (4,), and their covariance, shape (4, 4).

        Raises:
            ValueError: the sightings do not determine them.
        """
        # In units in which the diagonal is 1, so that seconds and metres do not decide whether it can be solved.
        scale = np.sqrt(np.diag(self.information))
        if not np.all(scale > 0.0):
            raise ValueError("expected sightings at two times, or a usual speed, got neither")
        normal = self.information / np.outer(scale, scale)
        if np.linalg.cond(normal) > 1e12:
            raise ValueError("expected sightings at two times, or a usual speed, got neither")
        inverse = np.linalg.inv(normal) / np.outer(scale, scale)
        return inverse @ self.vector, inverse

    @property
    def velocity(self) -> Vector:
        """The velocity (x, y), m/s."""
        parameters = self._solved[0]
        return float(parameters[1]), float(parameters[3])

    @property
    def velocity_covariance(self) -> Floats:
        """The covariance of the velocity: shape (2, 2), m^2/s^2."""
        return self._solved[1][np.ix_((1, 3), (1, 3))]

    def at(self, time: float) -> Vector:
        """The position at a match time, m."""
        x, vx, y, vy = self._solved[0]
        dt = time - self.time
        return float(x + vx * dt), float(y + vy * dt)

    def covariance_at(self, time: float) -> Floats:
        """The covariance of the position at a match time: shape (2, 2), m^2."""
        dt = time - self.time
        row = np.array([[1.0, dt, 0.0, 0.0], [0.0, 0.0, 1.0, dt]])
        return np.asarray(row @ self._solved[1] @ row.T)

    def surprise(self, sighting: Sighting) -> float:
        """The squared Mahalanobis distance of a sighting from the course.

        For sightings of this course it has the chi-square distribution with two degrees of freedom.
        """
        x, y = self.at(sighting.time)
        spread = self.covariance_at(sighting.time) + np.array([[sighting.xx, sighting.xy], [sighting.xy, sighting.yy]])
        (a, b), (_, c) = spread.tolist()
        dx, dy = sighting.x - x, sighting.y - y
        return float((c * dx * dx - 2 * b * dx * dy + a * dy * dy) / (a * c - b * b))

    def joined(self, other: "Line") -> "Line":
        """The course with the sightings of another course, too.

        Raises:
            ValueError: the two were not started at the same time.
        """
        if self.time != other.time:
            raise ValueError(f"expected a course that was started at {self.time} s, got one at {other.time} s")
        return Line(
            self.time,
            self.information + other.information,
            self.vector + other.vector,
            self.count + other.count,
            min(self.first, other.first),
            max(self.last, other.last),
        )


def fitted(sightings: Iterable[Sighting], *, time: float, speed: float | None = None) -> Line:
    """The course through sightings; see `Line`."""
    line = Line.start(time, speed)
    for sighting in sightings:
        line = line.seen(sighting)
    return line
