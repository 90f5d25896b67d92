"""Fixes that are made of the true poses of robots, as a camera above the field might measure them."""

import math
from collections.abc import Mapping
from heapq import heappop, heappush
from itertools import count

from numpy.random import Generator

from vrg.bus.node import due_index
from vrg.geometry import wrap
from vrg.localisation.estimator import Fix
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
        self._coming: list[tuple[float, int, str, Fix]] = []
        """Those that have not arrived: a heap of arrival time, number, robot and fix."""
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
        s, rng, names = self._settings, self._rng, sorted(poses)
        shown = dict(zip(names, names, strict=True))
        if len(names) > 1 and rng.random() < s.swaps:
            one, other = rng.choice(len(names), 2, replace=False).tolist()
            shown |= {names[one]: names[other], names[other]: names[one]}
        for name in names:
            dx, dy, turn = rng.standard_normal(3).tolist()
            arrival = time + s.delay + s.jitter * rng.random()
            if rng.random() < s.loss:
                continue
            pose, heading = poses[shown[name]], math.radians(s.heading)
            seen = Pose(pose.x + s.position * dx, pose.y + s.position * dy, wrap(pose.theta + heading * turn))
            heappush(self._coming, (arrival, next(self._number), name, Fix(time, seen, s.position, heading)))

    def arrived(self, now: float) -> list[tuple[str, Fix]]:
        """The fixes that have arrived by now, each with the name of its robot; each is returned once."""
        found = []
        while self._coming and self._coming[0][0] <= now:
            *_, name, fix = heappop(self._coming)
            found.append((name, fix))
        return found
