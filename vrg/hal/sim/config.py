"""The set-up of a world, and the checks that tell whether a world can be built from it."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING

from vrg.errors import ConfigError, Path, Problem
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.models.settings import SensorSettings, with_motion, with_settings
from vrg.names import check_name
from vrg.types import Pose, Vector

if TYPE_CHECKING:
    from vrg.hal.sim.map import Map


@dataclass(frozen=True, kw_only=True)
class RobotSetup:
    """A robot at the start of the match.

    Args:
        model: the name of a robot model.
        pose: the robot's pose at the start, in the map's frame.
        physical: True for a physical robot. The world shows it where it is measured, and never moves it.
        sensors, motion: the numbers of its sensors, and of how it moves, that are not those of the model.
        camera: True takes pictures of its camera all the time, not only while a program asks for them.
    """

    name: str
    model: str
    pose: Pose
    physical: bool = False
    sensors: SensorSettings = field(default_factory=dict)
    motion: Mapping[str, float] = field(default_factory=dict)
    camera: bool = False

    @property
    def description(self) -> RobotModel:
        """The description of the robot, with the settings of its sensors.

        Raises:
            ConfigError: there is no such model, or the settings are wrong.
        """
        return with_motion(with_settings(robot_model(self.model), self.sensors), self.motion)


@dataclass(frozen=True, kw_only=True)
class BodySetup:
    """A passive body at the start of the match, such as a ball or a box.

    Args:
        kind: what it is, in the game's own word.
        pose: that of its centre of mass at the start, in the map's frame.
        radius: of a disc, which rolls, m; 0 for an outline, which slides.
        corners: of a convex outline, counter-clockwise about its centre of mass, m; none of a disc.
        mass: kg. height: m; a range finder that is higher sees nothing of it.
        friction: the floor slows it by this times gravity, as it rolls or slides.
        restitution: the part of its approach speed with which it bounces off walls, robots and others.
        tracked: True for a real one, which is where it was seen: nothing in the world moves it.
    """

    name: str
    kind: str
    pose: Pose
    radius: float = 0.0
    corners: tuple[Vector, ...] = ()
    mass: float
    height: float
    friction: float
    restitution: float
    tracked: bool = False


@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """The set-up of a world.

    Args:
        map: a map's name, or the path of its file. engine: the name of a physics engine.
        tick: the match time between steps, s. seed: the seed of all noise.
        rate: match seconds per real second; 0 means as fast as possible, which only a match in one process can be.
        lasers: False omits all range finders, to save time where no player looks at them. noise: False means perfect
            sensors, of which no reading drops out.
        robots: the robots that are in the world from the start. bodies: the passive bodies.
    """

    map: str = "courtyard"
    engine: str = "planar"
    tick: float = 0.02
    seed: int = 0
    rate: float = 1.0
    lasers: bool = True
    noise: bool = True
    robots: tuple[RobotSetup, ...] = ()
    bodies: tuple[BodySetup, ...] = ()


def fingerprint(config: WorldConfig) -> str:
    """A text that tells apart worlds of different set-ups. The rate, `lasers` and `camera` do not count."""
    robots = [replace(robot, camera=False) for robot in config.robots]
    setup = (config.map, config.engine, config.tick, config.seed, config.noise, robots, config.bodies)
    return hashlib.sha256(repr(setup).encode()).hexdigest()[:16]


def check_setup(config: WorldConfig) -> list[Problem]:
    """The reasons why this world cannot be built; empty if it can. Nothing is built.

    The path of a problem with a robot is `("players", name)`, as each robot is a player's.
    """
    from vrg.hal.sim.engines import ENGINES  # noqa: PLC0415 - a process that only passes a set-up on needs no numpy

    problems = []
    if not 0.001 <= config.tick <= 0.1:
        problems.append(Problem(f"expected 0.001 to 0.1 s, got {config.tick}", ("tick",)))
    if not 0.0 <= config.rate <= 1e4:
        problems.append(Problem(f"expected 0 to 10000, got {config.rate}", ("rate",)))
    if config.seed < 0:
        problems.append(Problem(f"expected 0 or more, got {config.seed}", ("seed",)))
    if config.engine not in ENGINES:
        problems.append(Problem(ENGINES.expected(config.engine), ("engine",)))
    map_ = _map(config.map, problems)
    placed: list[tuple[RobotSetup, RobotModel]] = []
    names: set[str] = set()
    for robot in config.robots:
        where: Path = ("players", robot.name)
        try:
            check_name(robot.name, "robot")
            model = robot.description
        except ConfigError as error:
            problems += [Problem(problem.text, where) for problem in error.problems]
            continue
        if robot.name in names:
            problems.append(Problem("expected a name of its own, got one that is taken", (*where, "name")))
        names.add(robot.name)
        placed.append((robot, model))
        why = None if map_ is None else place_problems(map_, robot.name, model, robot.pose)
        if why is not None:
            problems.append(Problem(why, where))
    for (a, model_a), (b, model_b) in combinations(placed, 2):
        if overlap(model_a, a.pose, model_b, b.pose):
            problems.append(
                Problem(f"expected room between {a.name} and {b.name}, but they overlap", ("players", a.name))
            )
    return [*problems, *_body_problems(config, map_, placed, names)]


def _body_problems(
    config: WorldConfig, map_: "Map | None", robots: list[tuple[RobotSetup, RobotModel]], names: set[str]
) -> list[Problem]:
    """The reasons why the passive bodies cannot be there. The path of a problem is `("bodies", number)`."""
    from vrg.hal.sim.contact import contacts, form_of, placed, rectangle  # noqa: PLC0415 - as above

    there = [
        (robot.name, placed(rectangle(model.length, model.width), robot.pose.x, robot.pose.y, robot.pose.theta))
        for robot, model in robots
    ]
    if map_ is not None:
        walls = [(rectangle(b.length, b.width), b.x, b.y, b.heading) for b in map_.boxes]
        there += [("a wall", placed(*wall)) for wall in walls]
        there += [("an obstacle", placed(form_of(c.radius, ()), c.x, c.y, 0.0)) for c in map_.circles]
    problems = []
    for number, body in enumerate(config.bodies):
        where: Path = ("bodies", number)
        if not (body.radius or body.corners):
            continue  # the check of the match file says so
        if body.name in names:
            problems.append(Problem(f"expected a name of its own, but {body.name} is taken", (*where, "name")))
        names.add(body.name)
        own = placed(form_of(body.radius, body.corners), body.pose.x, body.pose.y, body.pose.theta)
        if map_ is not None and not all(map_.bounds.contains(x, y) for x, y in own.corners or [(own.x, own.y)]):
            problems.append(Problem(f"expected {body.name} inside map {map_.name}", where))
        elif other := next((name for name, at in there if contacts(own, at)), None):
            problems.append(Problem(f"expected a free place for {body.name}, but it overlaps {other}", where))
        there.append((body.name, own))
    return problems


def _map(name: str, problems: list[Problem]) -> "Map | None":
    from vrg.hal.sim.map import load_map  # noqa: PLC0415 - as above

    try:
        return load_map(name)
    except ConfigError as error:
        problems += [p if p.file else Problem(p.text.removeprefix("map: "), ("map",)) for p in error.problems]
        return None


def place_problems(map_: "Map", name: str, model: RobotModel, pose: Pose) -> str | None:
    """The reason why the map has no room for a robot at a pose, or None if it has."""
    if map_.footprint_clear(pose, model.length, model.width):
        return None
    at = f"({pose.x:g}, {pose.y:g})"
    if not map_.bounds.contains(pose.x, pose.y):
        x_min, y_min, x_max, y_max = map_.bounds.bounds
        area = f"x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}"
        return f"expected a pose inside map {map_.name} ({area}), got {at}"
    return f"expected a free place, but {at} is in a wall or obstacle of map {map_.name}"


def overlap(model_a: RobotModel, a: Pose, model_b: RobotModel, b: Pose) -> bool:
    """True if two robots' footprints overlap."""
    from vrg.hal.sim.shapes import body_box, boxes_touch  # noqa: PLC0415 - as above

    return boxes_touch(body_box(a, model_a.length, model_a.width), body_box(b, model_b.length, model_b.width))
