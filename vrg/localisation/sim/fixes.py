"""Fixes that are made of the true poses of robots, as a camera above the field might measure them."""

import math
from collections.abc import Mapping
from heapq import heappop, heappush
from itertools import count

from numpy.random import Generator

from vrg.bus.messages import Fix
from vrg.bus.node import TIME_TOLERANCE, due_index
from vrg.geometry import wrap
from vrg.localisation.sim.settings import SimSettings
from vrg.types import Pose


class SimulatedFixes:
    """The fixes of one simulated camera.

    Args:
        settings: how well it sees. rng: the source of all that is random.
    """

    def __init__(self, settings: SimSettings, rng: Generator) -> None:
        self._settings = settings
        self._rng = rng
        self._due = -1
        self._coming: list[tuple[float, int, float, tuple[Fix, ...]]] = []
        """The pictures whose fixes have not arrived: a heap of arrival time, number, time and fixes."""
        self._number = count()

    def capture(self, time: float, poses: Mapping[str, Pose]) -> None:
        """Take a picture of the robots, if one is due; to be called at least as often as pictures are taken.

        Args:
            time: s. poses: where the robots are.
        """
        due = due_index(time, 1.0 / self._settings.rate)
        if due == self._due or not poses:
            return
        self._due = due
        if any(begin <= time < end for begin, end in self._settings.dark):
            return
        s, rng, names = self._settings, self._rng, sorted(poses)
        shown = dict(zip(names, names, strict=True))
        if len(names) > 1 and rng.random() < s.swaps:
            one, other = rng.choice(len(names), 2, replace=False).tolist()
            shown |= {names[one]: names[other], names[other]: names[one]}
        fixes, heading = [], math.radians(s.heading)
        for name in names:
            (dx, dy, turn), lost = rng.standard_normal(3).tolist(), rng.random() < s.loss
            pose = poses[shown[name]]
            seen = Pose(pose.x + s.position * dx, pose.y + s.position * dy, wrap(pose.theta + heading * turn))
            if not lost:
                fixes.append(Fix(name, seen, s.position, heading))
        arrival = time + s.delay + s.jitter * rng.random()
        heappush(self._coming, (arrival, next(self._number), time, tuple(fixes)))

    def arrived(self, now: float) -> list[tuple[float, tuple[Fix, ...]]]:
        """The fixes of each picture that have arrived by now, with the time of the picture, s; each comes once."""
        found = []
        while self._coming and self._coming[0][0] <= now + TIME_TOLERANCE:
            *_, time, fixes = heappop(self._coming)
            found.append((time, fixes))
        return found
