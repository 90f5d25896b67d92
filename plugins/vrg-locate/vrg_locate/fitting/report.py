"""The findings of a match about one robot: how it follows commands, and what its odometry errs by."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from vrg.hal.models import RobotModel
from vrg.hal.models.settings import motion_problems
from vrg.types import Pose
from vrg_locate.fitting.likeness import GROUPS, Errors, Likeness, likeness, spans_of
from vrg_locate.fitting.response import Fitted, Response, fit
from vrg_locate.fitting.runs import Commands, Motions, axis_runs

NORMAL = 1.96
"""The half width of a 95 % interval in standard deviations, where there are many readings."""
EXACT, EXACT_TIME = 0.1, 0.02
"""Half of the 95 % interval of a number that is taken into a file: as a share, and of a delay, s."""
Number = tuple[float, float]
"""A number, and half the width of its 95 % interval."""
GOOD_FIXES: Final = 0.95
"""The share of fixes that must be used for a calibration."""
LIKE: Final = 0.04
"""The distance in m to its simulation, with all that was found, above which a robot was disturbed."""
_PLAUSIBLE: Final = {"way": (0.2, 0.02), "turn": (0.25, 0.03), "bend": (0.3, 0.05)}
"""The most that odometry can be off before something else is wrong, and half the interval that it may have, as shares,
or rad/m."""
ROWS: Final = {
    "delay": ("delay, s", 1.0),
    "acceleration": ("acceleration, m/s^2", 1.0),
    "braking": ("braking, m/s^2", 1.0),
    "friction": ("friction, m/s^2", 1.0),
    "top": ("top speed, m/s", 1.0),
    "way": ("ways longer by, %", 100.0),
    "turn": ("turns longer by, %", 100.0),
    "bend": ("bend, degrees/m", math.degrees(1.0)),
}
"""The name of each number in the report, and the factor to its unit there."""


@dataclass(frozen=True)
class Findings:
    """The findings about one robot.

    Args:
        errors: of its odometry, by name, each with the half of its 95 % interval.
        fitted: how it follows commands, or the reason why that is not known.
        likeness: to its simulation; None if that cannot be compared.
    """

    errors: Mapping[str, Number]
    fitted: Fitted | str
    likeness: Likeness | None

    @property
    def numbers(self) -> dict[str, Number]:
        """All that was found, each with the half of its 95 % interval, which is infinite for what was not seen.

        By name: how it follows commands (see GROUPS), the friction, m/s^2, which helps it brake and hinders it from
        speeding up, and what its odometry errs by.
        """
        if isinstance(self.fitted, str):
            return dict(self.errors)
        found, seen = {}, self.fitted.seen
        for name, group in GROUPS.items():
            found[name] = self.fitted.interval(**dict.fromkeys([each for each in group if each in seen] or group, 1.0))
        return found | {"friction": self.fitted.interval(braking=0.5, acceleration=-0.5)} | dict(self.errors)

    def motion(self, model: RobotModel) -> dict[str, float]:
        """The settings of its motion, for a match file: those that are known to EXACT or better, and possible.

        Speeds are true ones, also where its odometry errs.

        Args:
            model: with the numbers of the match.
        """
        if isinstance(self.fitted, str):
            return {}
        seen, longer, found = self.fitted.seen, 1.0 + self.errors["way"][0], dict[str, float]()
        delay, half = self.numbers["delay"]
        if "delay" in seen and half <= EXACT_TIME:
            found["delay"] = delay
        for own, name in (("acceleration", "a_max"), ("braking", "slowing"), ("top", "v_max")):
            value, half = self.fitted.interval(**{own: 1.0})
            if half <= EXACT * value:
                found[name] = value * longer
        if "v_max" in found:
            found["v_max"] = min(found["v_max"], model.v_max)
        rounded = {name: float(f"{value:.3g}") for name, value in found.items()}
        return {name: value for name, value in rounded.items() if not motion_problems({name: value})}


def findings(
    model: RobotModel,
    commands: Commands,
    motions: Motions,
    poses: Sequence[tuple[float, Pose]],
    learned: Mapping[str, tuple[float, float]],
) -> Findings:
    """The findings of a match about a robot.

    Args:
        model: with the drivetrain by which its odometry was worked out.
        commands, motions, poses: what it was commanded, what its odometry measured, and where it was.
        learned: what the fusion centre has learned of its odometry, with standard deviations.
    """
    errors = {name: (mean, NORMAL * deviation) for name, (mean, deviation) in learned.items()}
    if not motions:
        return Findings(errors, "how it drove was not recorded: was the match played with --no-record?", None)
    start = replace(Response.of(model), lag=0.02)
    try:
        fitted = fit(axis_runs(model, commands, motions), start)
    except ValueError as error:
        return Findings(errors, str(error), None)
    if "lag" not in fitted.seen:
        fitted = replace(fitted, response=replace(fitted.response, lag=0.0))
    spans = spans_of(model, commands, motions, poses)
    means = Errors(**{name: mean for name, (mean, _) in errors.items()})
    return Findings(errors, fitted, likeness(spans, model, fitted, means) if spans else None)


def doubt_of(found: Findings, fates: dict[str, int]) -> str | None:
    """The reason why what was found of a robot is no calibration of it, in words; None if there is none.

    Args:
        fates: what became of its fixes.
    """
    taken, whole = used(fates), sum(fates.values())
    if taken < GOOD_FIXES * whole:
        why = "does the source see this robot, is nothing in its way, and are the directions of its motors right?"
        if fates.get("turned"):
            why = (
                "by them it does not drive where it heads: is its tag or its body turned (write `heading`, "
                'or `prints = "apriltag"` for tags of other programs), or are the directions of its motors wrong?'
            )
        return f"{whole - taken} of {whole} fixes were refused: {why}"
    if isinstance(found.fitted, str):
        return found.fitted
    if found.likeness is None:
        return "it has hardly moved"
    for name, (most, least) in _PLAUSIBLE.items():
        mean, half = found.errors[name]
        if abs(mean) > most or half > least:
            words, unit = ROWS[name]
            return (
                f"{words} {unit * mean:.3g} +- {unit * half:.2g}, expected at most {unit * most:.3g} "
                f"+- {unit * least:.2g}: are `ratio`, wheels, and directions of motors right, and has it driven enough?"
            )
    if found.likeness.after > LIKE:
        return (
            f"with all that was found it is still {100 * found.likeness.after:.1f} cm away from where it should be: "
            "was it disturbed, or is this computer too slow?"
        )
    return None


def used(fates: dict[str, int]) -> int:
    """The number of fixes that were used, by what became of each."""
    return fates.get("used", 0) + fates.get("moved", 0)
