"""The fusion centre: one node that estimates where robots and things are, from odometry and what sources have seen."""

import logging
import math
from collections import Counter
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from msgspec import structs

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix, MeasuredPose, Motion, OwnPlace
from vrg.bus.node import CLOCK_SKEW, Node, Tick
from vrg.bus.topics import Keys, name_in
from vrg.hal.location import FUSION
from vrg.hal.models import RobotModel
from vrg.hal.sensors.gps import GpsSpec, from_wgs84
from vrg.hal.sensors.ins import InsSpec
from vrg.localisation.estimator import Estimator, FixFate
from vrg.localisation.motion import motion_noise
from vrg.localisation.source import TRACKER
from vrg.localisation.thing import ThingEstimator
from vrg.types import Pose, Twist

log = logging.getLogger(__name__)

LEARNED = ("way", "turn", "bend")
"""The words for what an estimator learns of a robot's odometry."""
NEVER = 1e8
"""The age in s of a robot that no source has seen."""
MIN_DEVIATION = 0.001
"""The smallest standard deviation of what a robot measures of its own place, m and rad."""
PERIOD = 0.05
"""The match time in s between two ticks."""


class FusionCentre(Node):
    """The node of the fusion centre.

    Args:
        mailbox: its mailbox. keys: the keys of the match.
        robots: the model and the start of each robot that it locates, by name.
        origin: the latitude and longitude of the map's x = y = 0, rad, for GPS.
        physical: the names of the physical ones. things: those of the passive bodies that it locates.
    """

    kind = TRACKER

    def __init__(
        self,
        mailbox: Mailbox,
        keys: Keys,
        robots: Mapping[str, tuple[RobotModel, Pose]],
        origin: tuple[float, float] = (0.0, 0.0),
        physical: Collection[str] = (),
        things: Collection[str] = (),
    ) -> None:
        super().__init__(FUSION, mailbox, PERIOD)
        self._origin = origin
        self._models = {name: model for name, (model, _) in robots.items()}
        self._noise = {name: motion_noise(model, physical=name in physical) for name, (model, _) in robots.items()}
        self._estimators = {name: Estimator(start, self._noise[name]) for name, (_, start) in robots.items()}
        self._placed = mailbox.subscribe(keys.placed(), only=[keys.placed(name).key for name in robots])
        self._twists: dict[str, Twist] = {}
        self._heights: dict[str, float] = {}
        self._things = {name: ThingEstimator() for name in things}
        self._topics = {name: keys.robot_pose(name) for name in robots} | {n: keys.thing_pose(n) for n in things}
        self._motions = mailbox.subscribe(keys.motion(), only=[keys.motion(name).key for name in robots])
        self._fixes = mailbox.subscribe(keys.fixes())
        self._counts: dict[str, Counter[FixFate]] = {name: Counter() for name in (*robots, *things)}
        self._unknown: Counter[str] = Counter()

    def tick(self, tick: Tick) -> None:
        """Take in what robots and sources have measured, and publish where each is that has moved on in time."""
        for placed in self._placed.take():
            # An official enters where it was put; what its odometry errs by is learned again.
            name = name_in(placed.key)
            self._estimators[name] = Estimator(placed.body.pose, self._noise[name])
        moved = set()
        for motion in self._motions.take():
            name = name_in(motion.key)
            moved.add(name)
            self._move(name, motion.stamp, motion.body)
        for seen in self._fixes.take():
            for fix in seen.body.fixes:
                estimator = self._estimators.get(fix.robot)
                if fix.robot in self._things:
                    self._count(fix.robot, self._see(tick.time, seen.stamp, fix))
                elif estimator is None:
                    self._unknown[fix.robot] += 1
                elif (verdict := estimator.correct(seen.stamp, fix)) is not None:
                    self._count(fix.robot, verdict)
        for name in sorted(moved):
            if (estimate := self._estimators[name].estimate) is not None:
                height = self._heights.get(name)
                pose = MeasuredPose(
                    pose=structs.replace(estimate.pose, z=height) if height else estimate.pose,
                    twist=self._twists[name],
                    uncertainty=estimate.uncertainty,
                    unseen=min(estimate.age, NEVER),
                )
                self.mailbox.publish(self._topics[name], pose, stamp=estimate.time)

    def _move(self, name: str, time: float, motion: Motion) -> None:
        self._twists[name], self._heights[name] = motion.twist, motion.odometry.z
        for verdict in self._estimators[name].move(time, motion.odometry):
            self._count(name, verdict)
        for place in motion.own:
            if (fix := own_fix(name, self._models[name], place, self._origin)) is not None:
                self._estimators[name].correct(place.stamp, fix, own=True)

    def _see(self, now: float, stamp: float, fix: Fix) -> FixFate:
        """Publish where a thing was seen: at once, as there is no odometry to wait for."""
        if stamp > now + CLOCK_SKEW:
            return FixFate.EARLY
        if (measured := self._things[fix.robot].correct(stamp, fix)) is None:
            return FixFate.LATE
        self.mailbox.publish(self._topics[fix.robot], measured, stamp=stamp)
        return FixFate.USED

    def _count(self, name: str, verdict: FixFate) -> None:
        self._counts[name][verdict] += 1
        if verdict is FixFate.MOVED:
            log.warning("%s is not where its odometry places it: it was pushed or carried", name)
        elif verdict is FixFate.TURNED and self._counts[name][verdict] == 1:
            angle = self._estimators[name].turned or 0.0
            log.error(
                "%s does not drive where it heads by its fixes, which are turned by %.0f degrees: it is no longer "
                "located; is its tag or its body turned (see docs/localisation.md), or a motor's direction wrong?",
                name,
                math.degrees(angle),
            )

    def counted(self) -> dict[str, Any]:
        """The fates of the fixes of each robot and thing, the fixes of others, and what was learned.

        That is by how much the ways, the turns and the turn on a metre straight ahead (rad) of each robot are greater
        than its odometry measures, each with its standard deviation.
        """
        fates = {name: {verdict.value: n for verdict, n in counts.items()} for name, counts in self._counts.items()}
        learned = {}
        for name, estimator in self._estimators.items():
            errors, covariance = estimator.errors
            deviations = np.sqrt(np.diag(covariance)).tolist()
            learned[name] = dict(zip(LEARNED, zip(errors.tolist(), deviations, strict=True), strict=True))
        return {"fixes": fates, "unknown": dict(self._unknown), "learned": learned}


def own_fix(name: str, model: RobotModel, place: OwnPlace, origin: tuple[float, float]) -> Fix | None:
    """The fix that a sensor of the robot itself is worth; None if it has measured nothing.

    The error of a GPS receiver stays nearly the same from one reading to the next. Each is given so large a deviation
    that all within twice the time of its correlation are together worth one.

    Args:
        name: of the robot. model: with its sensors. place: what was measured.
        origin: the latitude and longitude of the map's x = y = 0, rad.
    """
    if place.earth is not None:
        gps = model.sensor(GpsSpec) or GpsSpec()
        x, y = from_wgs84(*place.earth, origin)
        same = max(1.0, 2.0 * gps.correlation * gps.rate)
        return Fix(name, Pose(x, y, 0.0), max(MIN_DEVIATION, gps.position_noise * math.sqrt(same)))
    if place.pose is None:
        return None
    ins = model.sensor(InsSpec) or InsSpec()
    return Fix(name, place.pose, max(MIN_DEVIATION, ins.position_noise), max(MIN_DEVIATION, ins.heading_noise))
