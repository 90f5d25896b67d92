"""Pursuit of one evader: Apollonius circles, pure pursuit, and the lion's move. All are functions of numbers.

Positions are in m, speeds in m/s, times in s. Both sides are points that can turn at once.
"""

import math
from typing import Final

from vrg.regions import Circle
from vrg.segments import nearest_on_segment
from vrg.types import Vector

_EQUAL: Final = 1e-9
"""Speeds whose ratio is nearer to 1 than this are equal."""


def reaches_first(point: Vector, pursuer: Vector, speed: float, evader: Vector, evader_speed: float) -> bool:
    """True if a pursuer that drives straight is at a point no later than an evader that drives straight there.

    Args:
        speed: the pursuer's. evader_speed: the evader's. Neither is negative.
    """
    return math.dist(point, pursuer) * evader_speed <= math.dist(point, evader) * speed


def apollonius(pursuer: Vector, speed: float, evader: Vector, evader_speed: float) -> Circle | None:
    """The circle of Apollonius: the points that both reach at the same time if they drive straight.

    With g = evader_speed / speed it has the centre (evader - g^2 pursuer) / (1 - g^2) and the radius
    g |evader - pursuer| / |1 - g^2| (Isaacs, "Differential Games", 1965, section 1.9). Inside of it the slower side is
    first: the evader for g < 1, the pursuer for g > 1.

    Returns:
        the circle; None for equal speeds, where the points are those of the perpendicular bisector, and None if one
        side stands still or both are at the same place, where there is no such circle.
    """
    distance = math.dist(pursuer, evader)
    if speed <= 0.0 or evader_speed <= 0.0 or distance == 0.0:
        return None
    square = (evader_speed / speed) ** 2
    rest = 1.0 - square
    if abs(rest) < _EQUAL:
        return None
    centre = ((evader[0] - square * pursuer[0]) / rest, (evader[1] - square * pursuer[1]) / rest)
    return Circle(*centre, math.sqrt(square) * distance / abs(rest))


def pure_pursuit_time(pursuer: Vector, speed: float, evader: Vector, velocity: Vector) -> float | None:
    """The time after which a pursuer that always heads for the evader has caught it, while the evader goes straight on.

    With the distance d and the angle a between the line of sight and the evader's velocity, d (speed + |velocity| cos
    a) falls at the constant rate speed^2 - |velocity|^2; this quotient is the time (Bouguer's problem, 1732; Nahin,
    "Chases and Escapes", 2007, chapter 1).

    Returns:
        the time in s; None if it is never caught: it is at least as fast, unless it comes straight towards the pursuer.
    """
    dx, dy = evader[0] - pursuer[0], evader[1] - pursuer[1]
    distance = math.hypot(dx, dy)
    if distance == 0.0:
        return 0.0
    fast = math.hypot(*velocity)
    along = (dx * velocity[0] + dy * velocity[1]) / distance
    if speed > fast * (1.0 + _EQUAL):
        return distance * (speed + along) / (speed**2 - fast**2)
    # Head on, they meet whatever their speeds are.
    comes_straight = fast > 0.0 and along <= -fast * (1.0 - 1e-12)
    return distance / (speed + fast) if comes_straight else None


def pure_pursuit_gap(distance: float, angle: float) -> float:
    """The distance in m that a pursuer which always heads for an equally fast evader reaches in the end.

    It is d (1 + cos a) / 2, because d (1 + cos a) does not change and a goes to 0; see `pure_pursuit_time`.

    Args:
        distance: at the beginning, m. angle: between the line of sight and the evader's course, rad.
    """
    return distance * (1.0 + math.cos(angle)) / 2


def lion_move(centre: Vector, lion: Vector, man: Vector, step: float) -> Vector:
    """The lion's next place when the man has gone to `man`: upon the segment from the centre to the man, far out.

    The lion begins on this segment, for which the centre may be its first place, and both go at most `step` in a move.
    Then it can always stay on the segment, and the square of its distance from the centre grows by at least step^2 with
    each move. So in an arena with no point further than R from the centre it has the man after (R / step)^2 moves
    (Sgall, "Solution of David Gale's lion and man problem", 2001).

    Args:
        centre: m. lion: where it is, m. man: where the man is now, m. step: how far the lion can go, m.

    Returns:
        the point that is nearest to the man among those of the segment that are within reach. Where none is within
        reach, because the lion was not on the segment, the point one step towards the nearest of them.
    """
    if math.dist(lion, man) <= step:
        return man
    nearest = nearest_on_segment(lion, centre, man)
    away = math.dist(lion, nearest)
    if away > step:
        share = step / away
        return lion[0] + (nearest[0] - lion[0]) * share, lion[1] + (nearest[1] - lion[1]) * share
    length = math.dist(centre, man)
    if length == 0.0:
        return nearest
    ahead = min(math.sqrt(step**2 - away**2), math.dist(nearest, man))
    return (
        nearest[0] + (man[0] - centre[0]) / length * ahead,
        nearest[1] + (man[1] - centre[1]) / length * ahead,
    )
