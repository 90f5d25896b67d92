"""The lion's move in the pursuit of a man. Both are points that can turn at once."""

import math

from vrg.portable.scalars import square
from vrg.segments import nearest_on_segment
from vrg.types import Vector


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
    ahead = min(math.sqrt(square(step) - square(away)), math.dist(nearest, man))
    return (
        nearest[0] + (man[0] - centre[0]) / length * ahead,
        nearest[1] + (man[1] - centre[1]) / length * ahead,
    )
