"""Checks of the machines, the radio, the sensors and the zones of a match file, and the values that follow from
them."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

from msgspec import structs
from pydantic import ValidationError

from vrg.bus.messages import LARGE_ZONES
from vrg.config.files import HERE, PLACED, Machine, MatchFile, PlayerEntry, RadioTable
from vrg.coordinator.rulebook import RuleBook
from vrg.errors import ConfigError, Path, Problem
from vrg.hal.backends import BACKENDS
from vrg.hal.location import FUSION
from vrg.hal.models import robot_model
from vrg.hal.models.settings import merged, setting_problems, with_settings
from vrg.hal.sensors.camera import Camera
from vrg.hal.sim.config import WorldConfig
from vrg.hal.sim.map import Map, load_map
from vrg.localisation.source import SOURCES, read_source
from vrg.names import is_name
from vrg.regions import Polygon, touch
from vrg.registry import did_you_mean, expected_one_of
from vrg.tables import problems_in


def machine_problems(file: MatchFile, companions: Collection[str]) -> list[Problem]:
    """The problems with the placement of processes.

    Args:
        companions: the names of the companions of the players' robots.
    """
    known = list(dict.fromkeys([HERE, *file.machines]))
    found = [problem for name in file.machines for problem in _table_problems(file, name)]
    others = [*PLACED, *companions, *([FUSION, *file.localisation] if file.localisation else [])]
    for process, machine in file.place.items():
        if process not in others:
            text = expected_one_of(others, process)
            if process in [player.name for player in file.players]:
                text = f"write `machine = {machine!r}` into the table of the player {process} instead of this"
            found.append(Problem(text, ("place", process)))
        if machine not in known:
            found.append(Problem(expected_one_of(known, machine), ("place", process)))
    return found


def _table_problems(file: MatchFile, name: str) -> list[Problem]:
    """The problems with the table of one machine."""
    table, where = file.machines[name], ("machines", name)
    found = []
    if name == HERE and table.host:
        found.append(Problem("this is the machine where the match is launched: leave it out", (*where, "host")))
    if name == HERE and table.router:
        found.append(Problem("a further router is on another machine: leave it out", (*where, "router")))
    if name != HERE and not table.host:
        found.append(Problem("expected a host for ssh, such as robot@lab2.local, found none", where))
    if table.via is not None:
        routers = [other for other, at in file.machines.items() if at.router and other != name]
        if table.via not in routers:
            known = ", ".join(routers) or "there is none"
            text = f"expected a machine with `router = true` ({known}), got {table.via!r}"
            found.append(Problem(text, (*where, "via")))
        elif file.place.get("router", HERE) == name:
            found.append(Problem("the router of the match runs there: leave it out", (*where, "via")))
        elif table.router:
            found.append(Problem("a machine with a router of its own uses that: leave it out", (*where, "via")))
    return found


def machines_of(file: MatchFile, companions: Mapping[str, str]) -> tuple[dict[str, Machine], dict[str, str]]:
    """The machines that a match uses besides the one where it is launched, and where its processes run.

    Args:
        companions: the machine of each companion, where [place] names no other.

    Returns:
        the machines by name, and the machine of each process by the process' name; what is missing runs where the match
        is launched.
    """
    place = {**{player.name: player.machine for player in file.players}, **companions, **file.place}
    place = {process: machine for process, machine in place.items() if machine != HERE}
    used = {HERE, *place.values()}
    used |= {via for name in used if name in file.machines and (via := file.machines[name].via)}
    main = place.get("router", HERE)
    machines = {
        name: structs.replace(table, router=table.router and name != main, via=None if table.via == main else table.via)
        for name, table in file.machines.items()
        if name in used
    }
    return machines, place


def body_problems(file: MatchFile) -> list[Problem]:
    """The passive bodies that have no form, or more than one."""
    found = []
    for number, body in enumerate(file.bodies):
        given = [name for name in ("radius", "size", "corners") if getattr(body, name) is not None]
        if len(given) != 1:
            text = f"expected one of radius, size and corners, got {' and '.join(given) or 'none'}"
            found.append(Problem(f"{body.name}: {text}", ("bodies", number)))
    return found


def localisation_problems(file: MatchFile, base: FilePath) -> list[Problem]:
    """The problems with the sources of fixes, and with the players that need them.

    Args:
        base: the folder that relative paths in the file start from.
    """
    found, kinds = [], []
    taken = {*PLACED, FUSION, *(player.name for player in file.players)}
    for name, table in file.localisation.items():
        where: Path = ("localisation", name)
        if name in taken or not is_name(name):
            found.append(Problem(f"expected a name that no other process of this match has, got {name!r}", where))
        try:
            kind, settings = read_source(table)
            kinds.append(kind)
            found += [Problem(text, where) for text in kind.problems(settings, base)]
        except ConfigError as error:
            found += [Problem(problem.text, (*where, "source")) for problem in error.problems]
        except ValidationError as error:
            found += problems_in(error, SOURCES.get(table["source"]).settings, where)
    fused = [(number, player) for number, player in enumerate(file.players) if player.localisation == FUSION]
    tracked = [number for number, body in enumerate(file.bodies) if body.localisation == FUSION]
    if file.localisation and not (fused or tracked):
        text = 'it locates no player: write `localisation = "fusion"` into the table of one'
        found.append(Problem(text, ("localisation", next(iter(file.localisation)))))
    for number, player in fused:
        where = ("players", number, "localisation")
        if not file.localisation:
            text = 'expected a source of fixes: write a table such as [localisation.overhead], with `source = "sim"`'
            found.append(Problem(text, where))
        elif kinds and not any(kind.sees_physical for kind in kinds) and _is_real(file, player.backend):
            text = "expected a source that sees real robots: those of [localisation.*] see virtual and emulated ones"
            found.append(Problem(text, where))
    blind = len(kinds) == len(file.localisation) and not any(kind.sees_physical for kind in kinds)
    for number in tracked if blind else ():
        text = "expected a source that sees real things, such as `ssl`: `sim` sees none, and so needs no `localisation`"
        found.append(Problem(f"{file.bodies[number].name}: {text}", ("bodies", number, "localisation")))
    return found


def _is_real(file: MatchFile, backend: str) -> bool:
    """True if robots of a backend are physical ones that nothing emulates."""
    kind = BACKENDS.get(backend)
    if not kind.physical or kind.settings is None:
        return kind.physical
    try:
        return kind.settings.model_validate(file.backends.get(backend, {})).emulation is None
    except ValidationError:
        return False  # the table of the backend has mistakes, which are reported


def radio_problems(radio: RadioTable, names: Collection[str] | None) -> list[Problem]:
    """The links that are not between two players of the match, or that are named twice.

    Args:
        names: the names of the players; None where not all are known, because some of their tables have mistakes.
    """
    problems: list[Problem] = []
    seen: set[frozenset[str]] = set()
    for number, link in enumerate(radio.links):
        where = ("radio", "links", number, "between")
        for name in link.between:
            if names is not None and name not in names:
                guess = did_you_mean(name, names)
                problems.append(Problem(f"expected a player of this match, got {name!r}{guess}", where))
        pair = frozenset(link.between)
        if len(pair) == 1:
            problems.append(Problem(f"expected two players, got {link.between[0]!r} twice", where))
        elif pair in seen:
            problems.append(Problem(f"the link between {' and '.join(link.between)} is here already", where))
        seen.add(pair)
    return problems


def sensor_problems(settings: Mapping[str, Mapping[str, Any]], where: Path = ()) -> list[Problem]:
    """The problems with a table of settings, for any robots.

    Args:
        where: the place in the file of the table that holds the table `sensors`.
    """
    return [Problem(problem.text, (*where, "sensors", *problem.path)) for problem in setting_problems(settings)]


def sensors_of(file: MatchFile, entry: PlayerEntry, where: Path) -> dict[str, dict[str, float]]:
    """The settings for the sensors of one player's robot: those of the match, and the player's own in their place.

    Args:
        where: the place of the player's table in the file.

    Returns:
        the settings for the kinds of sensors that the robot has.

    Raises:
        ConfigError: the player's own settings are wrong, are for a sensor that its robot lacks, or do not fit to the
            other fields of the sensor; or it wants pictures and has no camera. Mistakes in the settings of the match
            alone are not reported again.
    """
    model = robot_model(entry.model)
    kinds = {spec.kind for spec in model.sensors}
    problems = sensor_problems(entry.sensors, where)
    wrong = {problem.path for problem in problems}
    for kind in entry.sensors:
        if kind not in kinds and (*where, "sensors", kind) not in wrong:
            text = f"expected a sensor that the robot {model.name} has ({', '.join(sorted(kinds))}), got {kind!r}"
            problems.append(Problem(text, (*where, "sensors", kind)))
    if entry.camera and Camera.kind not in kinds:
        problems.append(Problem(f"expected false, as the robot {model.name} has no camera", (*where, "camera")))
    if problems:
        raise ConfigError(problems)
    if setting_problems(file.sensors):
        return {}
    settings = {kind: table for kind, table in merged(file.sensors, entry.sensors).items() if kind in kinds}
    try:
        with_settings(model, settings)
    except ConfigError as error:
        raise ConfigError([_located(problem, entry, where) for problem in error.problems]) from None
    return settings


def _located(problem: Problem, entry: PlayerEntry, where: Path) -> Problem:
    """The problem at the table that has caused it: the player's own if there is one, otherwise that of the match."""
    own = problem.path[0] in entry.sensors
    return Problem(problem.text, (*(where if own else ()), "sensors", *problem.path))


def zone_problems(book: RuleBook[Any], world: WorldConfig) -> list[Problem]:
    """The zones, except for large ones, that are not free of walls or that reach out of the map's bounds."""
    map_ = load_map(world.map)
    found = []
    for zone in book.zones(book.initial()):
        if zone.kind in LARGE_ZONES or _is_free(map_, zone.region.outline()):
            continue
        x_min, y_min, x_max, y_max = zone.region.bounds
        text = (
            f"the {zone.name} zone, x {x_min:g} to {x_max:g}, y {y_min:g} to {y_max:g}, "
            f"must be free of walls and obstacles and inside the bounds of map {map_.name!r}"
        )
        found.append(Problem(text, ("rules",)))
    return found


def _is_free(map_: Map, outline: Sequence[tuple[float, float]]) -> bool:
    region = Polygon(tuple(outline))
    inside = all(map_.bounds.contains(x, y) for x, y in outline)
    # A zone may touch a wall, so the obstacles are made a little smaller.
    return inside and not any(touch(region, obstacle.shrunk(1e-6)) for obstacle in map_.obstacles)
