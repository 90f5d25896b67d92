"""The law by which the axes of a robot follow commands, and its fit to what they did.

An axis acts on a command a dead time later. Its speed then approaches the commanded one with a time constant, as that
of a motor with a velocity controller does, but no faster than its acceleration allows, which is another one for
slowing down, where friction helps. In the simulation the time constant is 0, and both accelerations are the same unless
the model has two. This module uses no bus and no clock.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields, replace
from itertools import compress

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.stats import t as student

from vrg.hal.models import RobotModel

Floats = npt.NDArray[np.float64]

OUTLIER = 0.005
"""The error in m of a way between two readings above which it counts less in a fit, as of a robot that was pushed."""
TIMING, LIKENESS = 0.0015, 0.002
"""Standard deviations of what a fit errs by however long the motion is, s and as a share: times are known to some
milliseconds, as drives report every 10 ms, and no axis follows the equation exactly."""
MIN_ERROR = 0.0005
"""The least that this error is taken to be, m, once it is known how exact the readings are: then it is four times the
median error."""
BLOCK = 2.0
"""The length in s of the parts of a motion whose errors are taken to be independent of one another."""
REACHED = 0.98
"""The share of the highest commanded speed above which the top speed was not met: it may be any higher one."""
UNSEEN = 1e-6
"""The share of the largest effect of a parameter below which a motion tells nothing about it."""
_EPS = 1e-9


@dataclass(frozen=True, kw_only=True)
class Response:
    """The numbers by which an axis follows commands. Speeds are those of its wheels' rims.

    Args:
        delay: dead time, s. lag: time constant, s.
        acceleration: while it speeds up, m/s^2. braking: the deceleration while it slows down, m/s^2.
        top: its highest speed, m/s.
    """

    delay: float = 0.0
    lag: float = 0.0
    acceleration: float
    braking: float
    top: float

    @classmethod
    def of(cls, model: RobotModel) -> "Response":
        """The response of a robot in the simulation."""
        return cls(delay=model.delay, acceleration=model.a_max, braking=model.slowing or model.a_max, top=model.v_max)

    def advance(self, speed: float, target: float, dt: float) -> tuple[float, float]:
        """The speed of an axis after `dt` s of aiming for `target`, m/s, and its way, m; without dead time."""
        target, way = max(-self.top, min(self.top, target)), 0.0
        while dt > 0.0 and speed != target:
            gap, slowing = target - speed, speed * (target - speed) < 0.0
            rate = self.braking if slowing else self.acceleration
            steady = (abs(gap) - rate * self.lag) / rate
            reverses = slowing and speed * target < 0.0  # at rest another rate begins
            if steady <= _EPS and self.lag <= _EPS:
                speed = target
                continue
            if steady <= _EPS:
                time = min(dt, self.lag * math.log(gap / target)) if reverses else dt
                decay = math.exp(-time / self.lag)
                way += target * time - gap * self.lag * (1.0 - decay)
                speed = 0.0 if time < dt else target - gap * decay
                dt -= time
                if speed:
                    return speed, way
                continue
            reverses = reverses and abs(speed) / rate < steady
            time = min(dt, abs(speed) / rate if reverses else steady)
            change = math.copysign(rate * time, gap)
            way += (speed + change / 2.0) * time
            if time < dt and reverses:
                speed = 0.0
            elif time < dt and self.lag <= _EPS:
                speed = target
            else:
                speed += change
            dt -= time
        return speed, way + speed * dt


PARAMETERS = tuple(field.name for field in fields(Response))
_BOUNDS = {"delay": (0.0, 0.5), "lag": (0.001, 0.5), "acceleration": (0.02, 20.0), "braking": (0.02, 20.0)}


@dataclass(frozen=True)
class AxisRun:
    """The commands of one axis, and its motion, without a break.

    Args:
        commands: the match times of commands, s, rising, and the speeds of the rim from then on, m/s.
        times: when its way was read, s, rising. ways: then, m. speed: at the first of them, m/s.
    """

    commands: Sequence[tuple[float, float]]
    times: Sequence[float]
    ways: Sequence[float]
    speed: float = 0.0


def followed(response: Response, run: AxisRun) -> Floats:
    """The ways that the axis of a run would have made between its readings, m: shape (n - 1,)."""
    at = [time + response.delay for time, _ in run.commands]
    ways, speed, now = [], run.speed, run.times[0]
    index = bisect_right(at, now)
    for time in run.times[1:]:
        whole = 0.0
        while now < time:
            until = min(time, at[index]) if index < len(at) else time
            target = run.commands[index - 1][1] if index else 0.0
            speed, way = response.advance(speed, target, until - now)
            whole, now = whole + way, until
            while index < len(at) and at[index] <= now:
                index += 1
        ways.append(whole)
    return np.array(ways)


@dataclass(frozen=True)
class Fitted:
    """The outcome of a fit.

    Args:
        response: the one that explains the runs best.
        seen: the names of the parameters about which the runs tell something; the others are as they were before.
        covariance: of `seen`: shape (n, n). freedom: the degrees of freedom of its intervals.
    """

    response: Response
    seen: Sequence[str]
    covariance: Floats
    freedom: int

    def interval(self, **weights: float) -> tuple[float, float]:
        """The weighted sum of parameters, and half the width of its 95 % interval: infinite if one was not seen."""
        total = sum(weight * getattr(self.response, name) for name, weight in weights.items())
        if not weights.keys() <= set(self.seen):
            return total, math.inf
        row = np.array([weights.get(name, 0.0) for name in self.seen])
        deviation = math.sqrt(float(row @ self.covariance @ row))
        return total, deviation * float(student.ppf(0.975, self.freedom))


def fit(runs: Sequence[AxisRun], start: Response) -> Fitted:
    """The response that explains runs best, by least squares in which what is far off counts less.

    The intervals allow for errors that stay the same for up to BLOCK (the sandwich estimator with clusters: A. C.
    Cameron, D. L. Miller, A Practitioner's Guide to Cluster-Robust Inference, J. Human Resources 50(2), 2015).

    Args:
        runs: of the axes of one robot. start: where the search begins.

    Raises:
        ValueError: the runs are too short for it, or the robot was never driven in them.
    """
    measured = np.concatenate([np.diff(run.ways) for run in runs]) if runs else np.zeros(0)
    blocks = np.concatenate([np.array(run.times[1:]) // BLOCK for run in runs]).astype(int) if runs else np.zeros(0)
    freedom = len(np.unique(blocks)) - len(PARAMETERS)
    least = len(PARAMETERS) * BLOCK
    if freedom < 1:
        raise ValueError(f"expected more than {least:g} s of recorded motion, got {len(measured)} readings")
    fastest = max((abs(speed) for run in runs for _, speed in run.commands), default=0.0)
    if not fastest:
        raise ValueError("expected a robot that is commanded to move, got one that stands")

    def errors(values: Floats) -> Floats:
        ways: Floats = np.concatenate([followed(_response(values), run) for run in runs])
        return ways - measured

    low, high = np.array([_BOUNDS.get(name, (0.02, 3.0 * start.top)) for name in PARAMETERS]).T
    # A top speed above all commands has no effect, and would stay.
    begin = replace(start, top=min(start.top, 0.9 * fastest))
    values = np.clip(astuple(begin), low, high)
    for loss in ("soft_l1", "cauchy"):
        far = OUTLIER if loss == "soft_l1" else max(MIN_ERROR, 4.0 * float(np.median(np.abs(errors(values)))))
        values = least_squares(
            errors, values, bounds=(low, high), loss=loss, f_scale=far, x_scale=np.maximum(values, 0.05), diff_step=1e-3
        ).x
    J = np.column_stack([_slope(errors, values, n, high) for n in range(len(PARAMETERS))])
    effects = np.linalg.norm(J * np.maximum(values, 0.05), axis=0)
    seen = effects > UNSEEN * max(1e-12, float(effects.max()))
    top = PARAMETERS.index("top")
    seen[top] &= values[top] <= REACHED * fastest
    values = np.where(seen, values, astuple(start))
    J, off = J[:, seen], errors(values)
    squared = (off / far) ** 2
    slopes, pull = (1.0 - squared) / (1.0 + squared) ** 2, off / (1.0 + squared)
    bread = np.linalg.pinv((J.T * slopes) @ J)
    pulls = J * pull[:, None]
    sums = np.array([pulls[blocks == block].sum(axis=0) for block in np.unique(blocks)])
    covariance = bread @ (sums.T @ sums) @ bread * len(sums) / freedom
    # Where only one or two blocks show a parameter, their pulls add up to nothing: then it is no better known than by
    # independent errors.
    plain = np.diag(bread @ (J.T @ J) @ bread) * float(pull @ pull) / max(1, len(off) - len(values))
    wider = np.sqrt(np.maximum(1.0, plain / np.maximum(np.diag(covariance), 1e-30)))
    covariance = covariance * np.outer(wider, wider)
    besides = np.where(np.array(PARAMETERS) == "delay", TIMING, LIKENESS * values)
    covariance += np.diag(np.square(besides[seen]))
    return Fitted(_response(values), list(compress(PARAMETERS, seen)), covariance, freedom)


def _response(values: Floats) -> Response:
    return Response(**dict(zip(PARAMETERS, values.tolist(), strict=True)))


def _slope(errors: Callable[[Floats], Floats], values: Floats, n: int, high: Floats) -> Floats:
    """The derivative of the errors by the n-th value."""
    step = 1e-3 * max(0.05, float(values[n]))
    more, less = values.copy(), values.copy()
    more[n], less[n] = min(high[n], values[n] + step), max(0.0, values[n] - step)
    slope: Floats = (errors(more) - errors(less)) / (more[n] - less[n])
    return slope
