"""Helpers for tests of engines."""

import math
from dataclasses import dataclass
from itertools import combinations

from vrg.hal.models import MODELS, robot_model
from vrg.hal.sim.engines.engine import Engine, bumpers
from vrg.hal.sim.shapes import Box, box_gap, circle_gap
from vrg.types import STILL, Pose, Twist

DT = 0.02
ENGINE_NAMES = ("planar", "pybullet", "mujoco")
ON_WHEELS = [name for name in MODELS.names() if robot_model(name).flies is None]
"""The names of the robot models that an engine moves itself: `AirEngine` moves all others."""


def run(engine: Engine, seconds: float) -> None:
    for _ in range(round(seconds / DT)):
        engine.step(DT)


def forward(engine: Engine, name: str, v: float, w: float = 0.0) -> None:
    """Command a body velocity, m/s and rad/s."""
    engine.command(name, Twist(v, w))


def drive(engine: Engine, name: str, v: float, w: float = 0.0, *, seconds: float) -> None:
    """Command a body velocity, and let time pass."""
    forward(engine, name, v, w)
    run(engine, seconds)


def carry(engine: Engine, name: str, v: float, seconds: float) -> None:
    """Let a kinematic body drive straight ahead at v m/s, then stand."""
    for _ in range(round(seconds / DT)):
        x, y, theta = engine.poses[engine.row(name)].tolist()
        engine.move(name, Pose(x + v * DT * math.cos(theta), y + v * DT * math.sin(theta), theta), Twist(v, 0.0))
        engine.step(DT)
    engine.move(name, body_of(engine, name).pose, STILL)


@dataclass(frozen=True, slots=True)
class Body:
    """The state of one robot's body: the angles are those that its axes have turned, rad, and there is one value of
    touch for each bumper."""

    pose: Pose
    twist: Twist
    angles: tuple[float, ...]
    touch: tuple[bool, ...]


def body_of(engine: Engine, name: str) -> Body:
    row = engine.row(name)
    touch = tuple(bool(engine.touch[row] >> n & 1) for n in range(bumpers(engine.models[row])))
    pose, twist = Pose(*engine.poses[row].tolist()), Twist(*engine.velocities[row].tolist())
    return Body(pose, twist, engine.angles_of(row), touch)


def footprint(engine: Engine, row: int) -> Box:
    x, y, heading = engine.poses[row].tolist()
    return Box(x, y, heading, engine.models[row].length, engine.models[row].width)


def deepest_overlap(engine: Engine) -> float:
    """m by which any two bodies that are not kinematic, or one and a wall, overlap; 0 if none do."""
    bodies = [footprint(engine, row) for row in range(len(engine.names)) if not engine.kinematic[row]]
    gaps = [box_gap(a, b).distance for a, b in combinations(bodies, 2)]
    gaps += [box_gap(a, wall).distance for a in bodies for wall in engine.map.boxes]
    gaps += [circle_gap(a, disc).distance for a in bodies for disc in engine.map.circles]
    return max(0.0, -min(gaps, default=0.0))
