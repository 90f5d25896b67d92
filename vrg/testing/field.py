"""A field whose players are drawn by a random source: where they are put and where they drive, so that much happens."""

import math
import random
from collections.abc import Mapping
from typing import Any, Final

from vrg.bus.messages import Thing
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.regions import Rectangle, surrounding
from vrg.types import Pose, Vector

STRIDE: Final = 0.15
"""The distance in m that a player drives between two looks: 1.5 m/s."""
MARGIN: Final = 2.0
"""The distance in m to which players drive outside the zones."""


class Field:
    """Where the players are, and places where something may happen.

    Args:
        book: the rule book, whose zones are such places. ready: where the players are first. rng: what draws.

    Attributes:
        poses: the pose of each player. things: the passive bodies, by name.
    """

    def __init__(self, book: RuleBook[Any], ready: Observation, rng: random.Random) -> None:
        self._book, self._rng = book, rng
        self.poses = dict(ready.poses)
        self.things = dict(ready.things)
        self._goals: dict[str, Vector] = {}
        boxes = [zone.region.bounds for zone in book.zones(book.initial())]
        boxes += [(pose.x, pose.y, pose.x, pose.y) for pose in ready.poses.values()]
        x_min, y_min, x_max, y_max = surrounding(boxes or [(0.0, 0.0, 0.0, 0.0)])
        self._all = Rectangle(x_min - MARGIN, y_min - MARGIN, x_max + MARGIN, y_max + MARGIN)

    def put(self, places: Mapping[str, Pose]) -> None:
        """Put players and passive bodies somewhere, as the world does."""
        self.poses |= {name: pose for name, pose in places.items() if name in self.poses}
        self.things |= {name: Thing(name, pose) for name, pose in places.items() if name in self.things}

    def anywhere(self) -> Vector:
        """Any place in the zones or near them."""
        return (
            self._rng.uniform(self._all.x_min, self._all.x_max),
            self._rng.uniform(self._all.y_min, self._all.y_max),
        )

    def spot(self, state: Any) -> Vector:
        """A place where something may happen: in a zone, at a thing of the game, or at a player; sometimes any."""
        rng, zones = self._rng, self._book.zones(state)
        spots: list[Vector] = [(pose.x, pose.y) for pose in self.poses.values()]
        spots += [(thing.x, thing.y) for thing in state.objects]
        spots += [zone.region.middle for zone in zones]
        if zones and rng.random() < 0.5:
            one, two = rng.choices(rng.choice(zones).region.outline(), k=2)
            share = rng.random()
            return one[0] + share * (two[0] - one[0]), one[1] + share * (two[1] - one[1])
        return rng.choice(spots) if rng.random() < 0.8 else self.anywhere()

    def scatter(self, state: Any) -> None:
        """Put everybody anywhere, or all around one place, in pairs that are equally far from it."""
        rng, zones = self._rng, self._book.zones(state)
        around, near = rng.random() < 0.6, rng.choice((0.25, 0.75))
        x, y = rng.choice(zones).region.middle if zones and rng.random() < 0.5 else self.spot(state)
        for number, name in enumerate(rng.sample(sorted(self.poses), len(self.poses))):
            far = near + 0.5 * (number // 4)
            dx, dy = ((far, 0.0), (-far, 0.0), (0.0, far), (0.0, -far))[number % 4]
            place = (x + dx, y + dy) if around else self.anywhere()
            self.poses[name] = Pose(*place, rng.uniform(-math.pi, math.pi))

    def drive(self, state: Any) -> frozenset[str]:
        """Let a look's time pass; who has driven."""
        rng, moved = self._rng, set()
        for name, pose in self.poses.items():
            if name not in self._goals or rng.random() < 0.02:
                self._goals[name] = self.spot(state)
            x, y = self._goals[name]
            far = math.dist((pose.x, pose.y), (x, y))
            if rng.random() < 0.1:
                continue
            if far < STRIDE:
                del self._goals[name]
                continue
            share = STRIDE / far
            theta = math.atan2(y - pose.y, x - pose.x)
            self.poses[name] = Pose(pose.x + share * (x - pose.x), pose.y + share * (y - pose.y), theta)
            moved.add(name)
        for name, thing in self.things.items():
            x, y = self.spot(state) if rng.random() < 0.02 else (thing.pose.x, thing.pose.y)
            way = rng.choice((0.0, 0.0, 2 * STRIDE))
            self.things[name] = Thing(name, Pose(x + rng.uniform(-way, way), y + rng.uniform(-way, way), 0.0))
        return frozenset(moved)
