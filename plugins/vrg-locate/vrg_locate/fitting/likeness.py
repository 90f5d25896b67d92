"""The difference between a robot and its simulation: where both are some seconds after the same start.

The simulated robot is that of the planar engine on free ground. It is given the commands that the robot was given, for
SPAN, again and again, each time from where the robot then was.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.geometry import along_arc, arc_between, compose, interpolate
from vrg.hal.models import RobotModel
from vrg.localisation.motion import corrected
from vrg.types import Pose, Twist
from vrg_locate.fitting.response import AxisRun, Fitted, Response, followed
from vrg_locate.fitting.runs import Commands, Motions, asked_speeds, runs_of, unbroken

Floats = npt.NDArray[np.float64]

SPAN = 3.0
"""The time in s from a start to where both are compared."""
MOVED = 0.2
"""The least way in m, and the least turn in rad, of a robot in a span that is compared."""
GROUPS: Final = {"delay": ("delay", "lag"), "acceleration": ("acceleration",), "braking": ("braking",), "top": ("top",)}
"""The parameters of a response, as they are named for people: a time constant delays, too."""


@dataclass(frozen=True)
class Errors:
    """The errors of the odometry of a robot: see `vrg.localisation.motion.MotionNoise`."""

    way: float = 0.0
    turn: float = 0.0
    bend: float = 0.0


@dataclass(frozen=True)
class Span:
    """Some seconds of a robot's motion.

    Args:
        runs: what its axes were commanded and did. start, end: where it was, in the map's frame.
    """

    runs: Sequence[AxisRun]
    start: Pose
    end: Pose


@dataclass(frozen=True)
class Likeness:
    """The distance of a simulated robot from the physical one after SPAN.

    Args:
        spans: how often both were compared.
        before, after: the root mean square of the distance, m, by the model's numbers, and by those that were found.
        without: the same, m, by parameter, if all but that one are as they were found.
    """

    spans: int
    before: float
    after: float
    without: dict[str, float]


def spans_of(
    model: RobotModel, commands: Commands, motions: Motions, poses: Sequence[tuple[float, Pose]]
) -> list[Span]:
    """The parts of a match in which a robot moved, each SPAN long.

    Args:
        model, commands, motions: as for `axis_runs`. poses: where it was, with match times, s, rising.
    """
    asked = asked_speeds(model, commands)
    at = [time for time, _ in asked]
    found = []
    for part in unbroken(motions, 2.0 * model.v_max):
        times = [time for time, _, _ in part]
        first = 0
        while first < len(part) and times[-1] >= times[first] + SPAN:
            last = bisect_left(times, times[first] + SPAN)
            start, end = _at(poses, times[first]), _at(poses, times[last])
            if start is not None and end is not None and _moves(start, end):
                begin = max(0, bisect_right(at, times[first] - 1.0) - 1)
                until = bisect_left(at, times[last])
                found.append(Span(runs_of(model, asked[begin:until], part[first : last + 1]), start, end))
            first = last
    return found


def apart(spans: Sequence[Span], model: RobotModel, response: Response, errors: Errors) -> Floats:
    """The distances in m between where the robot was and where a simulated one is at the end of each span."""
    found = []
    for span in spans:
        pose = span.start
        angles = np.array([followed(response, run) for run in span.runs]).T / model.drivetrain.wheel_radius
        for turned in angles.tolist():
            way = along_arc(Pose(0.0, 0.0, 0.0), model.drivetrain.twist(turned), 1.0)
            pose = compose(pose, corrected(way, errors.way, errors.turn, errors.bend))
        found.append(math.dist((pose.x, pose.y), (span.end.x, span.end.y)))
    return np.array(found)


def likeness(spans: Sequence[Span], model: RobotModel, fitted: Fitted, errors: Errors) -> Likeness:
    """Compare a robot with its simulation, and with one that has the numbers that were found.

    Args:
        errors: what its odometry was found to err by.

    Raises:
        ValueError: there is nothing to compare.
    """
    if not spans:
        raise ValueError(f"expected a robot that moves for {SPAN:g} s")

    def off(response: Response, errors: Errors) -> float:
        return math.sqrt(float(np.mean(apart(spans, model, response, errors) ** 2)))

    plain, own = Response.of(model), fitted.response
    without = {
        name: off(replace(own, **{each: getattr(plain, each) for each in group}), errors)
        for name, group in GROUPS.items()
    }
    without |= {name: off(own, replace(errors, **{name: 0.0})) for name in ("way", "turn", "bend")}
    return Likeness(len(spans), off(plain, Errors()), off(own, errors), without)


def _at(poses: Sequence[tuple[float, Pose]], time: float) -> Pose | None:
    """The pose of the robot; None where it is not known closely."""
    after = bisect_left(poses, time, key=lambda entry: entry[0])
    if after == len(poses) or (after == 0 and poses[0][0] > time):
        return None
    if poses[after][0] == time or after == 0:
        return poses[after][1]
    (before, one), (then, other) = poses[after - 1], poses[after]
    return interpolate(one, other, (time - before) / (then - before)) if then - before < 0.5 else None


def _moves(start: Pose, end: Pose) -> bool:
    by: Twist = arc_between(start, end)
    return math.hypot(by.v, by.side) > MOVED or abs(by.w) > MOVED
