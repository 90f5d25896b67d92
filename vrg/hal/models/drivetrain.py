"""Drivetrains, by which motors move the body of a robot: the relation of a twist and the speeds of the axes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from vrg.portable.scalars import cos_sin, total
from vrg.types import Twist

Rates = tuple[float, float, float]
"""The speed of an axis for each unit of a twist's v, w and side: rad/m, 1 and rad/m."""
LIMIT_ROUNDING = 1.0 + 1e-12
"""The factor by which a limit may be exceeded, so that what was limited once is left as it is."""


@dataclass(frozen=True, kw_only=True)
class Wheel:
    """One wheel, in the frame of the body.

    Args:
        x, y: where it touches the ground, m. heading: the direction in which it rolls, rad.
        axis: the number of the axis that turns it; None for a castor, which nothing turns and which resists nothing.
        rollers: True for an omni wheel, which resists no motion across its heading.
    """

    x: float
    y: float
    heading: float = 0.0
    axis: int | None = None
    rollers: bool = False


@dataclass(frozen=True, kw_only=True)
class Drivetrain:
    """The drivetrain of a robot on wheels: motor axes, and the wheels that each of them turns.

    Every layer above it commands and measures twists; only a drivetrain knows of axes and their speeds.

    Args:
        axes: the names of the axes.
        wheels: the wheels, on which the body's weight rests evenly.
        wheel_radius: radius of a wheel, m. wheel_width: width of a wheel, m.
        rates: for each axis its speeds for 1 m/s ahead, for 1 rad/s, and for 1 m/s to the left. By default they follow
            from its wheels, which roll without any slip.
    """

    axes: tuple[str, ...]
    wheels: tuple[Wheel, ...]
    wheel_radius: float
    wheel_width: float
    rates: tuple[Rates, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.axes)
        if strange := [wheel.axis for wheel in self.wheels if wheel.axis is not None and not 0 <= wheel.axis < count]:
            raise ValueError(f"expected wheels of the axes 0 to {count - 1}, got one of {strange[0]}")
        if not self.rates:
            object.__setattr__(self, "rates", tuple(self._rates(axis) for axis in range(count)))
        if len(self.rates) != count:
            raise ValueError(f"expected rates of {count} axes, got those of {len(self.rates)}")
        _ = self.motions  # a drivetrain that has none is refused here

    @cached_property
    def motions(self) -> tuple[tuple[float, ...], ...]:
        """The inverse of `rates`: how much each axis adds to v, to w and to the speed to the left, one row for each."""
        # Least squares, as there may be more axes than the body has ways to move. Those of skid steer come out exact.
        columns = list(zip(*self.rates, strict=True))
        moves = [n for n in range(3) if any(columns[n])]
        square = [[total(p * q for p, q in zip(columns[a], columns[b], strict=True)) for b in moves] for a in moves]
        solved = dict(zip(moves, _inverse(square), strict=True))
        return tuple(
            tuple(
                total(share * rate[n] for share, n in zip(solved[row], moves, strict=True)) if row in solved else 0.0
                for rate in self.rates
            )
            for row in range(3)
        )

    @cached_property
    def holonomic(self) -> bool:
        """True if the body can also drive sideways. Its motors then speed up together, or it would turn meanwhile."""
        return any(side for _, _, side in self.rates)

    @property
    def effective_track(self) -> float:
        """The track in m of a unicycle that turns as this robot does: w = (v_right - v_left) / effective_track.

        For other drivetrains it is the track of a unicycle whose wheels turn as fast as these do on average.
        """
        return 2 * self.wheel_radius * total(abs(turn) for _, turn, _ in self.rates) / len(self.rates)

    def with_track(self, effective_track: float) -> Self:
        """Return the same drivetrain with another effective track, such as a measured one."""
        scale = effective_track / self.effective_track
        return replace(self, rates=tuple((ahead, turn * scale, side) for ahead, turn, side in self.rates))

    def speeds(self, twist: Twist) -> tuple[float, ...]:
        """The speeds of the axes in rad/s for a motion of the body."""
        v, w, side = twist.v, twist.w, twist.side
        return tuple([ahead * v + turn * w + across * side for ahead, turn, across in self.rates])

    def twist(self, speeds: Sequence[float]) -> Twist:
        """The motion of the body for speeds of the axes in rad/s: the inverse of `speeds`.

        For angles in rad it is the way in m and the turn in rad.
        """
        v, w, side = (total(share * speed for share, speed in zip(row, speeds, strict=True)) for row in self.motions)
        return Twist(v, w, side)

    def limited(self, twist: Twist, v_max: float) -> Twist:
        """Return the motion, slowed down so that no axis turns faster than any does at `v_max` m/s straight ahead.

        All parts of the twist are scaled by the same factor, so that the robot keeps its curve. What the body cannot
        do, such as to drive sideways, is left out.

        Args:
            twist: finite. v_max: m/s; below 0 it counts as 0.
        """
        if twist.climb or (twist.side and not self.holonomic):
            twist = Twist(twist.v, twist.w, twist.side if self.holonomic else 0.0)
        limit = self._fastest_rate * max(0.0, v_max)
        fastest = max(map(abs, self.speeds(twist)))
        if fastest <= limit * LIMIT_ROUNDING:
            return twist
        if not math.isfinite(fastest):
            # The speeds of the axes are beyond what a float holds, though the twist is not.
            largest = max(abs(twist.v), abs(twist.w), abs(twist.side))
            return self.limited(Twist(twist.v / largest, twist.w / largest, twist.side / largest), v_max)
        scale = limit / fastest
        return Twist(twist.v * scale, twist.w * scale, twist.side * scale)

    @cached_property
    def _fastest_rate(self) -> float:
        return max(abs(ahead) for ahead, _, _ in self.rates)

    def _rates(self, axis: int) -> Rates:
        """The mean of what the wheels of an axis must turn for each unit of the twist."""
        own = [(w, *cos_sin(w.heading)) for w in self.wheels if w.axis == axis]
        found = [(cos, w.x * sin - w.y * cos, sin) for w, cos, sin in own]
        if not found:
            raise ValueError(f"expected a wheel of each axis, found none of {self.axes[axis]!r}")
        means = (total(column) / len(found) for column in zip(*found, strict=True))
        # What is nearly 0 is 0: the body cannot move so.
        ahead, turn, across = (round(mean, 12) / self.wheel_radius for mean in means)
        return ahead, turn, across


@dataclass(frozen=True, kw_only=True)
class Multirotor(Drivetrain):
    """The drivetrain of a robot with rotors: it moves in any direction, and up and down.

    What it is commanded are velocities, which it reaches as a first-order system does, so its axes are velocities, too:
    ahead in m/s, to the left in m/s, and the turn rate. See `multirotor`.

    Args:
        climb: the greatest speed up and down, m/s. response: the time constant of its velocities, s.
        cruise: the height to which it takes off, m. ceiling: the greatest height, m.
        hover: the power that keeps it in the air, W.
        drift: the standard deviation of its drift in a world with noise, a velocity along x and along y, m/s.
    """

    climb: float
    response: float
    cruise: float
    ceiling: float
    hover: float
    drift: float

    def limited(self, twist: Twist, v_max: float) -> Twist:
        """Return the motion, slowed down to `v_max` over the ground and to `climb`; see `Drivetrain.limited`."""
        most = self.climb if v_max > 0.0 else 0.0
        climb = min(max(twist.climb, -most), most)
        flat = super().limited(Twist(twist.v, twist.w, twist.side), v_max)
        fastest = math.hypot(flat.v, flat.side)
        scale = max(0.0, v_max) / fastest if fastest > max(0.0, v_max) * LIMIT_ROUNDING else 1.0
        if scale == 1.0 and climb == twist.climb and flat.w == twist.w and (flat.v, flat.side) == (twist.v, twist.side):
            return twist
        return Twist(flat.v * scale, flat.w, flat.side * scale, climb)


def multirotor(
    *,
    v_max: float,
    w_max: float,
    climb: float,
    response: float,
    cruise: float,
    ceiling: float,
    hover: float,
    drift: float = 0.0,
) -> Multirotor:
    """The drivetrain of a robot with rotors.

    Args:
        v_max: its top speed over the ground, m/s. w_max: its top turn rate, rad/s. The others: see `Multirotor`.
    """
    return Multirotor(
        axes=("ahead", "left", "turn"), wheels=(), wheel_radius=1.0, wheel_width=0.0,
        rates=((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, v_max / w_max, 0.0)),
        climb=climb, response=response, cruise=cruise, ceiling=ceiling, hover=hover, drift=drift,
    )  # fmt: skip


def _inverse(matrix: Sequence[Sequence[float]]) -> list[list[float]]:
    """The inverse of a symmetric matrix whose diagonal is above 0, by Gauss-Jordan elimination.

    Raises:
        ValueError: it has none.
    """
    size = len(matrix)
    rows = [[*row, *(float(n == number) for n in range(size))] for number, row in enumerate(matrix)]
    for n, row in enumerate(rows):
        if abs(row[n]) <= 1e-12 * matrix[n][n]:
            raise ValueError("expected axes that can set each part of a twist alone, got some that oppose each other")
        row[:] = [value / row[n] for value in row]
        for other in rows[:n] + rows[n + 1 :]:
            other[:] = [value - other[n] * own for value, own in zip(other, row, strict=True)]
    return [row[size:] for row in rows]


def skid_steer(
    *, wheel_radius: float, wheel_width: float, wheelbase: float, track: float, effective_track: float
) -> Drivetrain:
    """The drivetrain of four wheels of which those of each side turn together. It turns as they skid.

    Args:
        wheel_radius: radius of a wheel, m. wheel_width: width of a wheel, m.
        wheelbase: distance between the axles of one side, m.
        track: distance between the centre lines of the left and right wheels, m.
        effective_track: the track in m that a unicycle model needs to predict the turn rate of the skidding body:
            w = (v_right - v_left) / effective_track.
    """
    x, y = wheelbase / 2, track / 2
    turn = effective_track / 2 / wheel_radius
    return Drivetrain(
        axes=("left", "right"),
        wheels=tuple(Wheel(x=at, y=side * y, axis=int(side < 0)) for side in (1, -1) for at in (x, -x)),
        wheel_radius=wheel_radius,
        wheel_width=wheel_width,
        rates=((1 / wheel_radius, -turn, 0.0), (1 / wheel_radius, turn, 0.0)),
    )
