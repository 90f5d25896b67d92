"""The estimate of one robot's pose: its odometry, corrected by fixes that may come late.

An extended Kalman filter (S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, section 3.3) over six numbers:
the pose, and three errors of odometry that stay the same (J. Borenstein, L. Feng, Measurement and Correction of
Systematic Odometry Errors in Mobile Robots, IEEE Trans. Robotics and Automation 12(6), 1996): of the way, of the turn,
and the turn of a robot that is to drive straight ahead.

A camera is late. A fix counts at the time at which it was captured: the filter goes back to that time, and comes
forward again over all that it has heard since. This module uses no bus and no clock.
"""

import enum
import math
from bisect import bisect_right, insort
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
import numpy.typing as npt
from msgspec import structs

from vrg.bus.messages import LOST, Fix
from vrg.geometry import compose, interpolate, inverse, wrap
from vrg.localisation.motion import SLIP_TIME, MotionNoise, corrected, driven
from vrg.portable.arrays import inverted, product
from vrg.portable.scalars import atan2, cos_sin, square
from vrg.types import Pose, Uncertainty

Floats = npt.NDArray[np.float64]

WINDOW = 1.0
"""The time in s that the filter can go back. A fix that comes later than that is refused."""
AHEAD = 0.2
"""The time in s by which a fix may be ahead of the newest odometry; one further ahead is of another clock."""
WAITING = 256
"""The number of fixes that wait for the odometry of their times."""
AGREEING = 5
"""The number of refused fixes in a row, all of one place, after which the robot is taken to be there."""
RESTART = 0.2
"""The standard deviation of a robot's pose, m and rad, where its odometry has started again: it may have rolled on."""
JUMP = 0.3
"""The way in m by which an estimate may jump to such a place, as after a push; a robot that jumps further is lost."""
TURNED = math.pi / 4
"""The angle in rad by which fixes are turned against the way that a robot drives, from which on its tag is: no robot
slips so, and one that is pushed does not follow its wheels."""
_LEAST_WAY = 0.1
"""The way in m over which such an angle is measured."""
_APART = _LEAST_WAY / (AGREEING - 2)
"""The way in m between the fixes by which it is measured: so they span that way on a curve, and however many come."""
_GATES = {2: 13.82, 3: 16.27}
"""The squared Mahalanobis distance above which a fix is of something else, by the number of coordinates that are
measured: the 0.999 quantile of the chi-squared distribution."""


class FixFate(enum.StrEnum):
    """The fate of a fix.

    USED and MOVED were used; with MOVED the robot is elsewhere than its odometry has it. FAR is too far from where the
    robot is taken to be, LATE was captured too long ago, and EARLY in the future, as the clocks differ. TURNED has a
    heading that does not fit to how the robot drives.
    """

    USED = "used"
    MOVED = "moved"
    FAR = "far"
    LATE = "late"
    EARLY = "early"
    TURNED = "turned"


@dataclass(frozen=True, slots=True)
class Estimate:
    """The pose of a robot, as estimated.

    Args:
        time: s. pose: in the map's frame. covariance: of x, y and heading: shape (3, 3), m and rad.
        age: the time since the robot was last seen from outside, s; infinite if it never was.
    """

    time: float
    pose: Pose
    covariance: Floats
    age: float

    @property
    def uncertainty(self) -> Uncertainty:
        """The covariance as it travels on the bus."""
        xx, xy, yy, heading = self.covariance[(0, 0, 1, 2), (0, 1, 1, 2)].tolist()
        return Uncertainty(xx, xy, yy, heading)


@dataclass(frozen=True, slots=True)
class _State:
    """The knowledge of a time: the odometry, the six numbers, their covariance, and the fix that they include."""

    time: float
    odometry: Pose
    mean: Floats
    covariance: Floats
    fix: Fix | None = None


class Estimator:
    """The estimator of one robot.

    Args:
        start: where the robot is taken to be at first. noise: how far its odometry errs.
        position, heading: standard deviations of `start`, m and rad.
    """

    def __init__(self, start: Pose, noise: MotionNoise, *, position: float = 0.5, heading: float = 0.3) -> None:
        self._noise = noise
        self._mean = np.array([start.x, start.y, start.theta, 0.0, 0.0, 0.0])
        self._prior = np.diag(np.square([position, position, heading, noise.longer, noise.wider, noise.bend]))
        self._states: list[_State] = []
        self._waiting: list[tuple[float, Fix, bool]] = []
        self._refused: deque[tuple[Fix, Pose]] = deque(maxlen=AGREEING)
        """The last fixes in a row that were refused, with the odometry of their times."""
        self._along: deque[tuple[Fix, Pose]] = deque(maxlen=AGREEING)
        """The last fixes on the way of the robot, with the odometry of their times."""
        self.turned: float | None = None
        """The angle in rad by which the headings of fixes are turned against the way that the robot drives; None while
        they are not known to be. The robot is located no more then: it would drive the wrong way."""
        self._common = 0.0, 0.0
        """That of the last fix that was used; the filter, whose errors average out, knows nothing of it."""
        self._seen = -math.inf
        self._lost_until = -math.inf

    @property
    def estimate(self) -> Estimate | None:
        """The estimate at the time of the newest odometry; None before the first one."""
        if not self._states:
            return None
        last = self._states[-1]
        x, y, theta = last.mean[:3].tolist()
        age = math.inf if last.time < self._lost_until else max(0.0, last.time - self._seen)
        position, heading = self._common
        covariance = last.covariance[:3, :3] + np.diag(np.square([position, position, heading]))
        return Estimate(last.time, Pose(x, y, wrap(theta)), covariance, age)

    @property
    def errors(self) -> tuple[Floats, Floats]:
        """The errors of the odometry, and their covariance of shape (3, 3).

        They are the shares by which the way and the turn are longer than measured, and the turn to the left on a metre
        straight ahead, rad/m.
        """
        if not self._states:
            return self._mean[3:].copy(), self._prior[3:, 3:].copy()
        last = self._states[-1]
        return last.mean[3:].copy(), last.covariance[3:, 3:].copy()

    def move(self, time: float, odometry: Pose) -> list[FixFate]:
        """Take in the pose that odometry has at a time, s; one that is not newer than the last changes nothing.

        Returns:
            what became of the fixes that have waited for it.
        """
        if not self._states:
            self._states.append(_State(time, odometry, self._mean, self._prior))
        elif time > self._states[-1].time:
            self._states.append(self._moved(self._states[-1], time, odometry))
            del self._states[: max(0, bisect_right(self._states, time - WINDOW, key=_time_of) - 1)]
        ready = bisect_right(self._waiting, self._states[-1].time, key=itemgetter(0))
        fixes, self._waiting = self._waiting[:ready], self._waiting[ready:]
        verdicts = [(self._correct(captured, fix, own), own) for captured, fix, own in fixes]
        return [verdict for verdict, own in verdicts if not own]

    def correct(self, time: float, fix: Fix, *, own: bool = False) -> FixFate | None:
        """Take in a fix.

        Args:
            time: when it was captured, s.
            own: True for what a sensor of the robot itself measures. It improves the estimate, but it has not seen the
                robot from outside, and does not show that the robot was carried.

        Returns:
            what became of it, or None if it waits for the odometry of its time.
        """
        if self._states and time <= self._states[-1].time:
            return self._correct(time, fix, own)
        if self._states and time > self._states[-1].time + AHEAD:
            return FixFate.EARLY
        insort(self._waiting, (time, fix, own), key=itemgetter(0))
        del self._waiting[:-WAITING]
        return None

    def _correct(self, time: float, fix: Fix, own: bool) -> FixFate:
        index = bisect_right(self._states, time, key=_time_of)
        if index == 0:
            return FixFate.LATE
        before = self._states[index - 1]
        odometry = before.odometry
        after = self._states[index] if index < len(self._states) else None
        if after is not None and self._driven(before, after.time, after.odometry) is not None:
            odometry = interpolate(odometry, after.odometry, (time - before.time) / (after.time - before.time))
        if self.turned is not None and not own:
            return FixFate.TURNED
        state = self._moved(before, time, odometry)
        if not own and fix.heading is not None and (not self._along or _far(self._along[-1][1], odometry) >= _APART):
            self._along.append((fix, odometry))
        found, distance = _updated(state, fix)
        if not distance <= _gate(fix):
            return FixFate.FAR if own else self._refuse(fix, state, index)
        if not own and fix.heading is not None:
            self._refused.clear()
        self._take(found, index, own=own)
        return FixFate.USED

    def _take(self, state: _State, index: int, *, own: bool = False) -> None:
        """Put in the state of a fix, and come forward again over all that was heard since."""
        if not own and state.fix is not None:
            self._seen, self._common = max(self._seen, state.time), state.fix.common
        self._states.insert(index, state)
        for i in range(index + 1, len(self._states)):
            old = self._states[i]
            new = self._moved(self._states[i - 1], old.time, old.odometry)
            if old.fix is not None:
                found, distance = _updated(new, old.fix)
                new = found if distance <= _gate(old.fix) else new  # what is known by now may speak against it
            self._states[i] = new

    def _refuse(self, fix: Fix, state: _State, index: int) -> FixFate:
        """Refuse a fix, unless several in a row agree on where the robot is: then it has been pushed or carried."""
        if fix.heading is None:
            return FixFate.FAR
        self._refused.append((fix, state.odometry))
        if len(self._refused) < AGREEING:
            return FixFate.FAR
        self.turned = _turn(self._along)
        if self.turned is not None:
            return FixFate.TURNED
        if not all(_agree(*other, fix, state.odometry) for other in self._refused):
            return FixFate.FAR
        self._refused.clear()
        if math.dist((fix.pose.x, fix.pose.y), state.mean[:2]) > JUMP:
            self._lost_until = state.time + LOST
        mean, covariance = state.mean.copy(), np.zeros((6, 6))
        mean[:3] = fix.pose.x, fix.pose.y, fix.pose.theta
        covariance[:3, :3] = _covariance(fix)
        covariance[3:, 3:] = state.covariance[3:, 3:]
        del self._states[:index]
        self._take(_State(state.time, state.odometry, mean, covariance, fix), 0)
        return FixFate.MOVED

    def _driven(self, state: _State, time: float, odometry: Pose) -> Pose | None:
        """The way since a state by the odometry, in the frame of the robot then; None if the odometry began again."""
        return driven(state.odometry, odometry, time - state.time, self._noise.fastest)

    def _moved(self, state: _State, time: float, odometry: Pose) -> _State:
        """The state at a later time, by the odometry then."""
        noise, dt, by = self._noise, time - state.time, self._driven(state, time, odometry)
        if by is None:
            covariance = state.covariance + np.diag([*[RESTART * RESTART] * 3, 0.0, 0.0, 0.0])
            return _State(time, odometry, state.mean, covariance)
        (longer, wider, bend), theta = state.mean[3:].tolist(), float(state.mean[2])
        (cos, sin), way = cos_sin(theta), corrected(by, longer, wider, bend)
        moved = cos * way.x - sin * way.y, sin * way.x + cos * way.y
        mean = state.mean.copy()
        mean[:3] += *moved, way.theta
        F = np.eye(6)
        F[0, 2], F[1, 2] = -moved[1], moved[0]
        F[0, 3], F[1, 3] = moved[0] / (1.0 + longer), moved[1] / (1.0 + longer)
        F[0, 5], F[1, 5] = -moved[1] * by.x / 2.0, moved[0] * by.x / 2.0
        F[2, 4], F[2, 5] = by.theta, by.x
        # The slip of one moment and that of the next are independent, so much of it cancels out over a longer time.
        length, kept = math.hypot(by.x, by.y), min(1.0, SLIP_TIME / dt) if dt else 0.0
        along, aside, rest = (
            kept * square(noise.along * length),
            kept * square(noise.aside * length),
            square(noise.rest) * dt,
        )
        covariance = product(product(F, state.covariance), F.T)
        covariance[0, 0] += cos * cos * along + sin * sin * aside + rest
        covariance[1, 1] += sin * sin * along + cos * cos * aside + rest
        covariance[0, 1] += cos * sin * (along - aside)
        covariance[1, 0] = covariance[0, 1]
        turned = square(noise.turn * length) + square(noise.spin * by.theta)
        covariance[2, 2] += kept * turned + square(noise.rest_turn) * dt
        return _State(time, odometry, mean, covariance)


def _time_of(state: _State) -> float:
    return state.time


def _gate(fix: Fix) -> float:
    return _GATES[2 if fix.heading is None else 3]


_EXACT = 1e-6
"""The deviation that an exact fix counts with, m or rad, so that a covariance has an inverse."""


def _covariance(fix: Fix) -> Floats:
    """The covariance of x, y and the heading, if it has one: shape (3, 3) or (2, 2), m and rad."""
    deviations = [fix.position] * 2 + ([] if fix.heading is None else [fix.heading])
    return np.diag([square(max(deviation, _EXACT)) for deviation in deviations])


def _updated(state: _State, fix: Fix) -> tuple[_State, float]:
    """The state with what a fix of the same time tells, and the squared Mahalanobis distance of the fix."""
    R = _covariance(fix)
    n, P = len(R), state.covariance
    way = np.array([fix.pose.x, fix.pose.y, fix.pose.theta])[:n] - state.mean[:n]
    if n == 3:
        way[2] = wrap(float(way[2]))
    known = inverted(P[:n, :n] + R)
    K = product(P[:, :n], known)
    # The form that stays positive definite (Joseph): (I - K H) P (I - K H)' + K R K'.
    A = np.eye(6)
    A[:, :n] -= K
    covariance = product(product(A, P), A.T) + product(product(K, R), K.T)
    found = _State(state.time, state.odometry, state.mean + product(K, way), covariance, fix)
    return found, float(product(way[None], product(known, way))[0])


def _far(one: Pose, other: Pose) -> float:
    return math.dist((one.x, one.y), (other.x, other.y))


def _agree(one: Fix, its_odometry: Pose, other: Fix, odometry: Pose) -> bool:
    """True if two fixes are of one robot that has moved from one to the other as its odometry has."""
    there = compose(one.pose, compose(inverse(its_odometry), odometry))
    far = math.hypot(there.x - other.pose.x, there.y - other.pose.y) / math.hypot(one.position, other.position)
    turned = wrap(there.theta - other.pose.theta) / math.hypot(one.heading or 0.0, other.heading or 0.0)
    return square(far) + square(turned) < _GATES[3]


def _turn(seen: Sequence[tuple[Fix, Pose]]) -> float | None:
    """The angle by which fixes are turned against the way by the odometry of their times, rad.

    None if they fit to that way, or do not even then, or it is short, or the angle is less than TURNED.
    """
    if all(_agree(*other, *seen[-1]) for other in seen):
        return None
    (first, start), (last, end) = seen[0], seen[-1]
    way, went = compose(inverse(first.pose), last.pose), compose(inverse(start), end)
    angle = wrap(atan2(went.y, went.x) - atan2(way.y, way.x))
    if _far(start, end) < _LEAST_WAY or abs(angle) < TURNED:
        return None
    back = Pose(0.0, 0.0, -angle)
    righted = [(structs.replace(fix, pose=compose(fix.pose, back)), odometry) for fix, odometry in seen]
    return angle if all(_agree(*other, *righted[-1]) for other in righted) else None
