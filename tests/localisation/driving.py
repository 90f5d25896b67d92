"""Robots that drive in the planar world, and the estimators that locate them by odometry and a simulated camera."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from vrg.geometry import wrap
from vrg.hal.models import robot_model
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sim.config import RobotSetup, WorldConfig
from vrg.hal.sim.world import World
from vrg.localisation.estimator import Estimator, FixFate
from vrg.localisation.motion import motion_noise
from vrg.localisation.sim import SimSettings, SimulatedFixes
from vrg.types import Pose, Twist

APART = 40.0
"""m between the starts of two robots, so that none meets another."""
FIRST = 2.0
"""The match time in s before which errors are not counted: the robot must be found first."""
DECISION = 0.1
"""s between two odometry readings that the estimator gets, as from a player's device."""


class Drive:
    """One drive of several robots, each with random motions of up to 0.7 m/s.

    Args:
        seed: of motions, odometry and camera. camera: its settings; None for none. seconds: the match time.

    Attributes:
        errors: estimate minus truth, shape (robots, times, 3), m and rad.
        nees: the normalised errors squared, shape (robots, times).
        fixes, refused: the number of fixes, and of those that were not used.
        estimators: by the robot's name.
    """

    def __init__(self, seed: int, camera: Mapping[str, Any] | None, seconds: float, robots: int) -> None:
        names = [f"r{number}" for number in range(robots)]
        setups = tuple(
            RobotSetup(name=name, model="P2AT", pose=Pose(APART * (number % 5 - 2), APART * (number // 5 - 2), 0.0))
            for number, name in enumerate(names)
        )
        world = World(WorldConfig(map="open", engine="planar", seed=seed, lasers=False, robots=setups))
        rng = np.random.default_rng(seed)
        seen = None if camera is None else SimulatedFixes(SimSettings(**camera), rng)
        noise = motion_noise(robot_model("P2AT"))
        self.estimators = {s.name: Estimator(s.pose, noise, position=0.02, heading=0.02) for s in setups}
        self.fixes = self.refused = 0
        wanted: dict[str, Twist] = {}
        self._errors: list[list[list[float]]] = []
        self._nees: list[list[float]] = []
        try:
            for tick in range(1, round(seconds / world.config.tick) + 1):
                if tick % 50 == 1:  # another motion each second
                    wanted = {name: Twist(rng.uniform(-0.2, 0.7), rng.uniform(-0.8, 0.8)) for name in names}
                for name, twist in wanted.items():
                    world.drive(name, twist, armed=True)
                world.step()
                if seen is not None:
                    seen.capture(world.time, {name: world.pose(name) for name in names})
                odometry = {name: body.pose for name, _, body in world.sense() if isinstance(body, Odometry)}
                if tick % round(DECISION / world.config.tick):
                    continue
                for name, pose in odometry.items():
                    self._count(self.estimators[name].move(world.time, pose))
                for time, fixes in [] if seen is None else seen.arrived(world.time):
                    verdicts = [self.estimators[fix.robot].correct(time, fix) for fix in fixes]
                    self._count([verdict for verdict in verdicts if verdict is not None])
                if world.time >= FIRST:
                    self._compare(world)
        finally:
            world.close()
        self.errors = np.array(self._errors).transpose(1, 0, 2)
        self.nees = np.array(self._nees).T

    def _count(self, verdicts: list[FixFate]) -> None:
        self.fixes += len(verdicts)
        self.refused += sum(verdict is not FixFate.USED for verdict in verdicts)

    def _compare(self, world: World) -> None:
        errors, nees = [], []
        for name, estimator in self.estimators.items():
            estimate, truth = estimator.estimate, world.pose(name)
            assert estimate is not None
            pose = estimate.pose
            error = [pose.x - truth.x, pose.y - truth.y, wrap(pose.theta - truth.theta)]
            assert all(map(math.isfinite, error))
            errors.append(error)
            nees.append(float(np.array(error) @ np.linalg.solve(estimate.covariance, error)))
        self._errors.append(errors)
        self._nees.append(nees)
