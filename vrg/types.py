"""Types that every package of VRG shares: poses, twists, tables, and the bounds of numbers.

Of VRG, this module imports only arithmetic.

Poses and twists are frozen structs, so that they travel on the bus without conversion. A struct does not check its
values when it is made; the bounds are checked when a message is decoded. Lengths are in metres, angles in radians, and
times in seconds; the description of a type is its unit, which the schemas of recordings have.
"""

import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, Final, NoReturn, TypeVar

from msgspec import Meta, Struct

from vrg.portable.scalars import atan2

K = TypeVar("K")
V = TypeVar("V")

Metres = Annotated[float, Meta(ge=-1e5, le=1e5, description="m")]
"""A coordinate in the map's frame, m."""
Length = Annotated[float, Meta(gt=0.0, le=1e5, description="m")]
"""A length above 0 m."""
Deviation = Annotated[float, Meta(ge=0.0, le=1e5)]
"""A standard deviation, or another size that may be 0."""
Radians = Annotated[float, Meta(ge=-1e4, le=1e4, description="rad")]
Speed = Annotated[float, Meta(ge=-100.0, le=100.0, description="m/s")]
"""A speed in m/s."""
AngularSpeed = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="rad/s")]
"""An angular speed in rad/s."""
Seconds = Annotated[float, Meta(ge=0.0, le=1e8, description="s")]
Count = Annotated[int, Meta(ge=0)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
Signed = Annotated[float, Meta(ge=-1.0, le=1.0)]
CONTROL = r"\x00-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff"
"""Signs that change a terminal or the direction of writing, line breaks too, or are no text, as a class of a regular
expression."""
Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=rf"^[^{CONTROL}]*\Z")]

Vector = tuple[float, float]
"""A point in m, or a velocity in m/s, in the map's frame: (x, y)."""


_CONTROL = re.compile(f"[{CONTROL}]")


def few(texts: Sequence[str], separator: str = ", ", width: int = 90) -> str:
    """Texts as a list of one line: as many as fit into a width, and how many more there are."""
    shown = list(texts)
    while len(shown) > 1 and len(separator.join(shown)) > width:
        shown.pop()
    return separator.join(shown) + (f" and {more} more" if (more := len(texts) - len(shown)) else "")


def printable(text: str, *, lines: bool = False) -> str:
    """The text with such signs as they are written in Python, such as `\\x1b`: it may come from anybody.

    Args:
        lines: True keeps line breaks.
    """
    if lines:
        return "\n".join(map(printable, text.split("\n")))
    return _CONTROL.sub(lambda sign: sign[0].encode("unicode_escape").decode(), text)


LEVEL: Final = 0.0
"""The height in m of what is on the ground, and the climb in m/s of what stays as high. A message leaves out a number
only if it is this very object: write `z or LEVEL`."""


class Pose(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, repr_omit_defaults=True, gc=False):
    """The position of a body's centre and its heading in the map's frame.

    Args:
        x, y: the position, m. theta: the heading, rad, counter-clockwise from +x.
        z: the height of its lowest point above the ground, m; 0 for what stands or drives on it.
    """

    x: Metres
    y: Metres
    theta: Radians
    z: Metres = LEVEL

    def __reduce__(self) -> tuple[type["Pose"], tuple[float, ...]]:
        """Copy and pickle it so that a height of 0 is again LEVEL."""
        return Pose, (self.x, self.y, self.theta, self.z) if self.z else (self.x, self.y, self.theta)


class Uncertainty(Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """How well a pose is known: variances and a covariance of its errors.

    Args:
        xx, xy, yy: the covariance of x and y, m^2. heading: the variance of the heading, rad^2.
    """

    xx: Annotated[float, Meta(ge=0.0, le=1e10)]
    xy: Annotated[float, Meta(ge=-1e10, le=1e10)]
    yy: Annotated[float, Meta(ge=0.0, le=1e10)]
    heading: Annotated[float, Meta(ge=0.0, le=1e10)]

    @property
    def ellipse(self) -> tuple[float, float, float]:
        """The ellipse of one standard deviation: its half axes, m, the longer first, and the direction of that, rad."""
        middle, spread = (self.xx + self.yy) / 2, math.hypot((self.xx - self.yy) / 2, self.xy)
        direction = atan2(2 * self.xy, self.xx - self.yy) / 2
        return math.sqrt(max(0.0, middle + spread)), math.sqrt(max(0.0, middle - spread)), direction


class Twist(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, repr_omit_defaults=True, gc=False):
    """A body's velocity in its own frame.

    Args:
        v: the speed ahead, m/s. w: the turn rate, rad/s, counter-clockwise, which is to the left.
        side: the speed to the left, m/s, of a robot that can drive sideways.
        climb: the speed upwards, m/s, of a robot that flies.
    """

    v: Speed
    w: AngularSpeed
    side: Speed = 0.0
    climb: Speed = LEVEL

    def __reduce__(self) -> tuple[type["Twist"], tuple[float, ...]]:
        """Copy and pickle it so that a climb of 0 is again LEVEL."""
        return Twist, (self.v, self.w, self.side, self.climb) if self.climb else (self.v, self.w, self.side)

    @property
    def speed(self) -> float:
        """The speed of the body over the ground, m/s: below 0 where it drives straight back."""
        return math.hypot(self.v, self.side) if self.side else self.v

    @property
    def is_finite(self) -> bool:
        """True if all numbers are finite."""
        return (
            math.isfinite(self.v) and math.isfinite(self.w) and math.isfinite(self.side) and math.isfinite(self.climb)
        )

    @property
    def quantised(self) -> "Twist":
        """The twist with numbers that are rounded as by `quantised`."""
        climb = quantised(self.climb) if self.climb else LEVEL
        return Twist(quantised(self.v), quantised(self.w), quantised(self.side), climb)


STILL = Twist(0.0, 0.0)
"""The twist of a body that stands still."""


def quantised(value: float, steps: float = 1e6) -> float:
    """Round a number that was computed elsewhere, so that it is the same if two libraries differ in its last bits.

    Args:
        value: any number. One that is not finite, or of 1e9 or more, is returned as it is.
        steps: how many steps there are in 1.
    """
    return round(value * steps) / steps if abs(value) < 1e9 else value


class FrozenDict(dict[K, V]):
    """A dict that refuses to be changed: many receivers share what a message holds."""

    __slots__ = ()

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("a message cannot be changed; change a copy of this table, dict(table)")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type["FrozenDict[K, V]"], tuple[dict[K, V]]]:
        """Copy and pickle it at once, as it cannot be filled afterwards."""
        return FrozenDict, (dict(self),)
