"""The simulations of the sensors with which a robot in the air looks down."""

import math
from collections.abc import Sequence

from vrg.hal.sensors.downward import Altimeter, AltimeterSpec, Overview, OverviewSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, Noise, SensorSimulation, Surroundings
from vrg.portable.scalars import cos_sin


class AltimeterSimulation(SensorSimulation[AltimeterSpec]):
    """Simulates range finders that look down: at the ground, a robot or a low wall. They see no balls and boxes."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[AltimeterSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        names = [f"{m.robot} {m.spec.name}" for m in mounted]
        self._noise = Noise(lambda: surroundings.seed, "altimeter", 1, names)
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}

    def measure(self, mounted: Mounted[AltimeterSpec], now: Instant) -> Altimeter:
        """The distance from the lowest point of a robot."""
        row, spec = mounted.row, mounted.spec
        x, y, _ = now.poses[row].tolist()
        height, below = _height(now, row), 0.0
        for other, model in enumerate(now.models):
            top = _height(now, other) + model.height
            if other != row and top <= height and _is_over(now, x, y, other):
                below = max(below, top)
        for top, region in self.surroundings.map_.low:
            if below < top <= height and region.contains(x, y):
                below = top
        distance = height - below
        if self.surroundings.noise:
            distance += spec.noise * float(self._noise.at(now.tick)[self._index[mounted.robot, spec.name], 0])
        return Altimeter(distance=min(max(0.0, distance), spec.range_max))


class OverviewSimulation(SensorSimulation[OverviewSpec]):
    """Simulates cameras that look down: they find each robot whose middle is in their picture, and lower than they."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[OverviewSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        names = [f"{m.robot} {m.spec.name}" for m in mounted]
        # One for each robot that may be seen, so that none changes that of another one.
        self._noises = [
            Noise(lambda: surroundings.seed, f"overview of {row}", 2, names) for row in range(len(now.models))
        ]
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}

    def measure(self, mounted: Mounted[OverviewSpec], now: Instant) -> Overview:
        """The places of the robots that a camera finds."""
        row, spec, found = mounted.row, mounted.spec, []
        x, y, theta = now.poses[row].tolist()
        cos, sin = cos_sin(theta)
        height = _height(now, row)
        own = self._index[mounted.robot, spec.name]
        for other, (ox, oy, _) in enumerate(now.poses.tolist()):
            up = height - _height(now, other)
            if other == row or up <= now.models[other].height:
                continue
            dx, dy = ox - x, oy - y
            if math.hypot(dx, dy) <= spec.reach(up):
                place = dx * cos + dy * sin, dy * cos - dx * sin
                if self.surroundings.noise:
                    ahead, left = (spec.deviation(up, place) * self._noises[other].at(now.tick)[own]).tolist()
                    place = place[0] + ahead, place[1] + left
                found.append(place)
        return Overview(places=tuple(found))


def _height(now: Instant, row: int) -> float:
    return float(now.heights[row]) if len(now.heights) else 0.0


def _is_over(now: Instant, x: float, y: float, row: int) -> bool:
    """True if a place is within the outline of a robot."""
    ox, oy, theta = now.poses[row].tolist()
    cos, sin = cos_sin(theta)
    dx, dy = x - ox, y - oy
    length, width = now.models[row].size
    return bool(abs(dx * cos + dy * sin) <= length / 2 and abs(dy * cos - dx * sin) <= width / 2)
