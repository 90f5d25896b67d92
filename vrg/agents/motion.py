"""How fast the others move, from where they were seen."""

from collections.abc import Mapping

from vrg.types import Vector

SMOOTHING = 0.5
"""Weight of the newest difference."""


class VelocityEstimator:
    """Smoothed differences of positions, in m/s."""

    def __init__(self) -> None:
        self._stamp: float | None = None
        self._positions: dict[str, Vector] = {}
        self.velocities: dict[str, Vector] = {}

    def update(self, stamp: float, positions: Mapping[str, Vector]) -> None:
        """Take a new sighting of everybody; one with an old stamp changes nothing.

        Args:
            stamp: s, of the sighting.
        """
        if self._stamp is not None and stamp <= self._stamp:
            if stamp < self._stamp - 1.0:
                self._stamp = None  # time has stepped back: a world taken up again
            return
        dt = stamp - self._stamp if self._stamp is not None else 0.0
        for name, position in positions.items():
            before = self._positions.get(name)
            if before is None or dt <= 0:
                self.velocities[name] = (0.0, 0.0)
                continue
            old = self.velocities[name]
            new = (position[0] - before[0]) / dt, (position[1] - before[1]) / dt
            self.velocities[name] = (
                old[0] + SMOOTHING * (new[0] - old[0]),
                old[1] + SMOOTHING * (new[1] - old[1]),
            )
        self._stamp, self._positions = stamp, dict(positions)


class TopSpeed:
    """How fast one's own robot really goes, which nobody tells: the mean speed while it goes about as fast as it can.

    The greatest single measurement would be too high, by as much as the measurements are noisy. So the speed is smoothed,
    and the measurements are averaged that were taken while the smoothed speed was near its peak.

    Args:
        prior: m/s, believed until it has had time to speed up.
    """

    SETTLING = 3.0
    """s on the move after which the measured top speed is believed."""
    NEAR = 0.93
    """The part of the peak from which on a speed counts as about as fast as the robot can go."""
    SMOOTHING_TIME = 0.5
    """s."""

    def __init__(self, prior: float) -> None:
        self._prior = prior
        self._moving = 0.0
        self._last: float | None = None
        self._smooth = self._peak = 0.0
        self._sum = self._count = 0.0

    def update(self, time: float, v: float) -> None:
        """Take the robot's speed (m/s) at a match time (s)."""
        dt = 0.0 if self._last is None else max(0.0, time - self._last)
        self._last = time
        speed = abs(v)
        if speed > 0.3 * self._prior:
            self._moving += dt
        self._smooth += (speed - self._smooth) * min(1.0, dt / self.SMOOTHING_TIME)
        if self._smooth * self.NEAR > self._peak:
            # What was averaged before was not yet the top speed.
            self._sum = self._count = 0.0
        self._peak = max(self._peak, self._smooth)
        if self._smooth > self.NEAR * self._peak:
            self._sum += speed * dt
            self._count += dt

    @property
    def value(self) -> float:
        """m/s."""
        if self._moving < self.SETTLING or self._count < 1.0:
            return self._prior
        return self._sum / self._count
