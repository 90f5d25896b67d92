"""Settings of robots: a robot model that moves otherwise, or whose sensors have other numbers, than its data sheet has.

A match file gives the settings of sensors by the kind of the sensor and the field of its spec. Every field that is a
number can be set; the field's annotation gives its bounds.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, get_args, get_origin, get_type_hints

from msgspec import Meta

from vrg.errors import ConfigError, Problem
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors import SENSORS
from vrg.hal.sensors.spec import SensorSpec
from vrg.registry import expected_one_of

SensorSettings = Mapping[str, Mapping[str, float]]
"""The numbers of sensors: by the kind of the sensor, then by the name of the field."""

MOTION: Final = {
    "v_max": (0.01, 20.0),
    "w_max": (0.01, 50.0),
    "a_max": (0.01, 100.0),
    "slowing": (0.01, 100.0),
    "brake": (0.01, 100.0),
    "delay": (0.0, 0.5),
    "track": (0.01, 10.0),
}
"""The numbers of how a robot moves: the fields of its model that can be set, and the effective track; their bounds."""
_BOUNDS: Final = (("gt", "above"), ("ge", "of at least"), ("lt", "below"), ("le", "at most"))


def setting_problems(settings: Mapping[str, Mapping[str, Any]]) -> list[Problem]:
    """The problems of settings, for any robots. The path of a problem is (kind, field)."""
    problems = []
    for kind, table in settings.items():
        if kind not in SENSORS:
            problems.append(Problem(SENSORS.expected(kind), (kind,)))
            continue
        try:
            fields = settable_fields(SENSORS.get(kind))
        except ConfigError as error:
            problems += [Problem(problem.text, (kind,)) for problem in error.problems]
            continue
        except NameError as error:
            # A sensor of another package may have annotations that only a type checker can read.
            problems.append(Problem(f"its fields cannot be read, so they cannot be set: {error}", (kind,)))
            continue
        for name, value in table.items():
            wrong = _wrong(value, fields[name]) if name in fields else expected_one_of(sorted(fields), name)
            if wrong is not None:
                problems.append(Problem(wrong, (kind, name)))
    return problems


def with_settings(model: RobotModel, settings: SensorSettings) -> RobotModel:
    """Return the model with other numbers in the specs of its sensors.

    Settings of a kind of sensor hold for all sensors of that kind. Those of a kind that the model lacks are ignored.

    Raises:
        ConfigError: an unknown kind or field, or a value that is no number, is out of its bounds, or does not fit to
            the other fields of the sensor. The path of each problem begins with the kind.
    """
    if not settings:
        return model
    problems = setting_problems(settings)
    if problems:
        raise ConfigError(problems)
    specs = [_changed(spec, settings.get(spec.kind, {}), problems) for spec in model.sensors]
    if problems:
        raise ConfigError(problems)
    return dataclasses.replace(model, sensors=tuple(specs))


def motion_problems(motion: Mapping[str, Any]) -> list[Problem]:
    """The problems of the numbers by which a robot moves. The path of a problem is (name,)."""
    problems = []
    for name, value in motion.items():
        if name not in MOTION:
            problems.append(Problem(expected_one_of(list(MOTION), name), (name,)))
        elif wrong := _wrong(value, Annotated[float, Meta(ge=MOTION[name][0], le=MOTION[name][1])]):
            problems.append(Problem(wrong, (name,)))
    return problems


def with_motion(model: RobotModel, motion: Mapping[str, float]) -> RobotModel:
    """Return the model with other numbers of how it moves, by the names of MOTION.

    Raises:
        ConfigError: a name is unknown, or a number out of its bounds.
    """
    if problems := motion_problems(motion):
        raise ConfigError(problems)
    own: dict[str, Any] = {name: float(value) for name, value in motion.items()}
    track = own.pop("track", None)
    drivetrain = model.drivetrain if track is None else model.drivetrain.with_track(track)
    return dataclasses.replace(model, drivetrain=drivetrain, **own) if motion else model


def merged(settings: SensorSettings, over: SensorSettings) -> dict[str, dict[str, float]]:
    """All settings of both; where both set a field of a kind, the second holds. The order is that of the alphabet."""
    kinds = sorted({*settings, *over})
    return {kind: dict(sorted({**settings.get(kind, {}), **over.get(kind, {})}.items())) for kind in kinds}


def settable_fields(spec: type[SensorSpec]) -> dict[str, Any]:
    """The fields of a spec that are numbers: the type of each, with its bounds, by its name."""
    hints = get_type_hints(spec, include_extras=True)
    types = {field.name: hints[field.name] for field in dataclasses.fields(spec)}
    return {name: hint for name, hint in types.items() if _number_type(hint) in (int, float)}


def _changed(spec: SensorSpec, table: Mapping[str, float], problems: list[Problem]) -> SensorSpec:
    fields = settable_fields(type(spec)) if table else {}
    try:
        return dataclasses.replace(spec, **{name: _number_type(fields[name])(value) for name, value in table.items()})
    except (ValueError, OverflowError) as error:
        problems.append(Problem(str(error), (spec.kind,)))
        return spec


def _number_type(hint: Any) -> Any:
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def _wrong(value: object, hint: Any) -> str | None:
    """The expected value and the value that came, in words; None for a good one."""
    whole = _number_type(hint) is int
    expected = "a whole number" if whole else "a number"
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        return f"expected {expected}, got {value!r}"
    metas = [meta for meta in get_args(hint)[1:] if isinstance(meta, Meta)]
    bounds = [(how, words, getattr(meta, how)) for meta in metas for how, words in _BOUNDS]
    bounds = [(how, words, bound) for how, words, bound in bounds if bound is not None]
    if (isinstance(value, int) or math.isfinite(value)) and all(_holds(how, value, bound) for how, _, bound in bounds):
        return None
    words = " and ".join(f"{words} {bound:.10g}" for _, words, bound in bounds)
    return f"expected {expected} {words}".rstrip() + f", got {value!r}"


def _holds(how: str, value: float, bound: float) -> bool:
    return {"gt": value > bound, "ge": value >= bound, "lt": value < bound, "le": value <= bound}[how]
