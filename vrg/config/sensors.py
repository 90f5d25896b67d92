"""The settings of sensors in a match file: `[sensors.laser]`, and `[players.sensors.laser]` for one player's robot."""

from collections.abc import Mapping
from typing import Any

from vrg.config.files import MatchFile, PlayerEntry
from vrg.errors import ConfigError, Path, Problem
from vrg.hal.models import robot_model
from vrg.hal.models.settings import merged, setting_problems, with_settings
from vrg.hal.sensors.camera import Camera


def sensor_problems(settings: Mapping[str, Mapping[str, Any]], where: Path = ()) -> list[Problem]:
    """What is wrong with a table of settings, whatever robots they are for.

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
            alone are not told again.
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
