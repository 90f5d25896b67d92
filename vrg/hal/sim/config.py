"""What a world is made of, and whether it can be."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import TypeVar

from vrg.bus.messages import Pose
from vrg.bus.topics import check_name
from vrg.errors import ConfigError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.sim.engine import ENGINES
from vrg.hal.sim.map import Map, load_map
from vrg.hal.sim.shapes import body_box, boxes_touch

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class RobotSetup:
    """A robot at the start.

    Args:
        model: a name in vrg.hal.models.MODELS.
        physical: it is a robot of flesh and steel: the world shows it where it is measured, and moves it nowhere.
    """

    name: str
    model: str
    pose: Pose
    physical: bool = False


@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """A world.

    Args:
        map: a map's name, or the path of its file. engine: `pybullet` or `planar`.
        tick: s of match time between steps. seed: of all noise.
        rate: match seconds per real second; 0 = as fast as it can.
        lasers: False saves the scans where no player looks at them. noise: False = perfect sensors.
        robots: those that are there from the start.
    """

    map: str = "courtyard"
    engine: str = "pybullet"
    tick: float = 0.02
    seed: int = 0
    rate: float = 1.0
    lasers: bool = True
    noise: bool = True
    robots: tuple[RobotSetup, ...] = ()


def fingerprint(config: WorldConfig) -> str:
    """Tells worlds of different set-ups apart, whatever rate they run at."""
    setup = (config.map, config.engine, config.tick, config.seed, config.noise, config.robots)
    return hashlib.sha256(repr(setup).encode()).hexdigest()[:16]


def check_setup(config: WorldConfig) -> list[str]:
    """What keeps this world from being built, one line each; empty if nothing does. Builds nothing."""
    problems = []
    if not 0.001 <= config.tick <= 0.1:
        problems.append(f"tick: expected 0.001 to 0.1 s, got {config.tick}")
    if not 0.0 <= config.rate <= 1e4:
        problems.append(f"rate: expected 0 to 10000, got {config.rate}")
    if config.seed < 0:
        problems.append(f"seed: expected 0 or more, got {config.seed}")
    if config.engine not in ENGINES:
        problems.append(f"engine: expected one of {', '.join(ENGINES)}, got {config.engine!r}")
    map_ = _attempt(problems, load_map, config.map)
    placed: list[tuple[RobotSetup, RobotModel]] = []
    names: set[str] = set()
    for robot in config.robots:
        _attempt(problems, check_name, robot.name, "robot")
        if robot.name in names:
            problems.append(f"robot {robot.name}: expected a name of its own, got one that is taken")
        names.add(robot.name)
        model = _attempt(problems, robot_model, robot.model)
        if model is not None:
            placed.append((robot, model))
            if map_ is not None:
                problems += place_problems(map_, robot.name, model, robot.pose)
    for (a, model_a), (b, model_b) in combinations(placed, 2):
        if overlap(model_a, a.pose, model_b, b.pose):
            problems.append(f"robots {a.name} and {b.name}: expected room between them, but they overlap")
    return problems


def place_problems(map_: Map, name: str, model: RobotModel, pose: Pose) -> list[str]:
    """Why the map has no room for a robot at a pose, at most one line."""
    if map_.footprint_clear(pose, model.length, model.width):
        return []
    b = map_.bounds
    at = f"({pose.x:g}, {pose.y:g})"
    if not (b.x_min <= pose.x <= b.x_max and b.y_min <= pose.y <= b.y_max):
        area = f"x {b.x_min:g}..{b.x_max:g}, y {b.y_min:g}..{b.y_max:g}"
        return [f"robot {name}: expected a pose inside map {map_.name} ({area}), got {at}"]
    return [f"robot {name}: expected a free place, but {at} is in a wall or obstacle of map {map_.name}"]


def overlap(model_a: RobotModel, a: Pose, model_b: RobotModel, b: Pose) -> bool:
    """Whether two robots' footprints overlap."""
    return boxes_touch(body_box(a, model_a.length, model_a.width), body_box(b, model_b.length, model_b.width))


def _attempt(problems: list[str], action: Callable[..., T], *args: str) -> T | None:
    """The action's result, or None with its problems added to the list."""
    try:
        return action(*args)
    except ConfigError as error:
        problems += error.problems
        return None
