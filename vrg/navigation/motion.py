"""Estimates of speeds: those of all players from where they were seen, and the top speed of one's own robot."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from vrg.shared import shared
from vrg.types import FrozenDict, Vector

SMOOTHING = 0.5
"""The weight of the newest difference, 0 to 1."""


@dataclass(frozen=True, slots=True)
class _Motion:
    """The last known places of all players (m), their times (s), and their velocities (m/s)."""

    stamp: float | None
    positions: Mapping[str, Vector]
    velocities: Mapping[str, Vector]


_UNSEEN: Final = _Motion(None, {}, {})


class VelocityEstimator:
    """Estimates velocities as smoothed differences of positions."""

    def __init__(self) -> None:
        self._motion = _UNSEEN

    @property
    def velocities(self) -> Mapping[str, Vector]:
        """The newest estimate for every name, in m/s."""
        return self._motion.velocities

    def update(self, stamp: float, positions: Mapping[str, Vector]) -> None:
        """Take in new positions. Positions with an old stamp change nothing.

        Args:
            stamp: the match time of the positions, s.
            positions: each player's position by name, m. They may not be changed afterwards.
        """
        self._motion = _moved(self._motion, stamp, positions)


@shared
def _moved(before: _Motion, stamp: float, positions: Mapping[str, Vector]) -> _Motion:
    """The motion after new positions were seen."""
    if before.stamp is not None and stamp <= before.stamp:
        if stamp < before.stamp - 1.0:
            # Time has stepped back: the world was restarted from a snapshot.
            return replace(before, stamp=None)
        return before
    dt = stamp - before.stamp if before.stamp is not None else 0.0
    velocities: dict[str, Vector] = {}  # of those that are seen now
    for name, (x, y) in positions.items():
        last = before.positions.get(name)
        if last is None or dt <= 0:
            velocities[name] = (0.0, 0.0)
            continue
        vx, vy = before.velocities[name]
        velocities[name] = (vx + SMOOTHING * ((x - last[0]) / dt - vx), vy + SMOOTHING * ((y - last[1]) / dt - vy))
    return _Motion(stamp, positions, FrozenDict(velocities))


class TopSpeed:
    """Estimates the top speed of one's own robot, which is not published: its mean speed while it is near the peak.

    The greatest single measurement would be too high, because measurements are noisy. So the speed is smoothed, and
    the result is the mean of the measurements that were taken while the smoothed speed was near its peak.

    Args:
        prior: the value that is used until the robot has had time to speed up, m/s.
    """

    SETTLING = 3.0
    """The time in s that the robot must have moved before the measured top speed is used."""
    NEAR = 0.93
    """The fraction of the peak above which a smoothed speed counts as near the peak."""
    SMOOTHING_TIME = 0.5
    """The time constant of the smoothing, s."""

    def __init__(self, prior: float) -> None:
        self._prior = prior
        self._moving = 0.0
        self._last: float | None = None
        self._smooth = self._peak = 0.0
        self._sum = self._count = 0.0

    def update(self, time: float, v: float) -> None:
        """Take in the robot's speed (m/s) at a match time (s)."""
        dt = 0.0 if self._last is None else max(0.0, time - self._last)
        self._last = time
        speed = abs(v)
        if speed > 0.3 * self._prior:
            self._moving += dt
        self._smooth += (speed - self._smooth) * min(1.0, dt / self.SMOOTHING_TIME)
        if self._smooth * self.NEAR > self._peak:
            # The measurements that were averaged so far were not yet near the top speed.
            self._sum = self._count = 0.0
        self._peak = max(self._peak, self._smooth)
        if self._smooth > self.NEAR * self._peak:
            self._sum += speed * dt
            self._count += dt

    @property
    def value(self) -> float:
        """The estimate of the top speed, m/s."""
        if self._moving < self.SETTLING or self._count < 1.0:
            return self._prior
        return self._sum / self._count
