"""Places words beside what they belong to, so that they cover neither each other nor a robot. It draws nothing.

Windows, the page (static/labels.js) and plots place words so. Lengths are in pixels, or in points of a plot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from vrg.regions import Bounds
from vrg.segments import nearest_on_segment
from vrg.types import Vector

_SIDES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""The sides on which words may stand, in the order of preference; y is down in a window."""
_STEPS: Final = (0.0, 1.2, 2.4, 3.6)
"""The distances of words from their circle, in heights of their box. Far away a line leads there."""
_PLACES: Final = range(len(_STEPS) * len(_SIDES))
"""The numbers of the places, the nearest first."""
_CLEARLY: Final = 4.0
"""The distance by which words without a line must be nearer to their own circle than to any other."""
_COVERED: Final = 600.0
"""The cost of covering something, besides the area that is covered."""
_DOUBTFUL: Final = 400.0
"""The cost of being taken for the words of another circle."""
_LONG: Final = 40.0
"""The cost of standing a step further away."""
_LOYAL: Final = 35.0
"""The worth of staying in the same place: less than a step, so that words come back."""
_PATIENT: Final = 390.0
"""By how much a place that is not good must be worse than another before it is left; less than what is doubtful."""
_GAP: Final = 4.0
"""Between words and their circle."""
_CROWD: Final = 8
"""From how many circles on words may be shortened."""

Circle = tuple[Vector, float]
"""A centre and a radius."""


@dataclass(frozen=True)
class Wanted:
    """Words to place.

    Args:
        key: tells them from others, also in the next picture. size: the width and the height of their box.
        about: what they belong to.
    """

    key: str
    size: Vector
    about: Circle


@dataclass
class Placer:
    """Places words. Each stay on their side as long as that place is free, so that they do not flicker."""

    _last: dict[str, int] = field(default_factory=dict)
    _close: bool = False

    def crowded(self, circles: Sequence[Circle], widest: float) -> bool:
        """True if circles lie so close that words have no room. It takes more room to go back to whole words.

        Args:
            circles: of the words that can be shortened. widest: the width of the longest ones.
        """
        if len(circles) < _CROWD:
            self._close = False
        else:
            gaps = sorted(min(math.dist(a, b) for b, _ in circles if b is not a) for a, _ in circles)
            self._close = gaps[len(gaps) // 2] < widest * (1.5 if self._close else 1.0)
        return self._close

    def place(self, wanted: Sequence[Wanted], area: Bounds, taken: Sequence[Bounds] = ()) -> list[Bounds]:
        """The boxes of words: left, top, right, bottom.

        Args:
            area: where all boxes must be. taken: what they must not cover, besides each other and the circles.
        """
        circles = [words.about for words in wanted]
        full = [*((x - r - 2, y - r - 2, x + r + 2, y + r + 2) for (x, y), r in circles if r > 0.0), *taken]
        found = []
        for own, words in enumerate(wanted):
            found.append(self._best(words, own, circles, full, area))
            full.append(found[-1])
        return found

    def _best(
        self, words: Wanted, own: int, circles: Sequence[Circle], taken: Sequence[Bounds], area: Bounds
    ) -> Bounds:
        """The best box: over nothing else, not beside another circle, and as near its own as can be."""
        last = self._last.get(words.key)
        ((x, y), radius), height = words.about, words.size[1]
        far_x, far_y = (radius + _GAP + side + _STEPS[-1] * height for side in words.size)
        around = x - far_x, y - far_y, x + far_x, y + far_y
        if area[0] <= around[0] and area[1] <= around[1] and around[2] <= area[2] and around[3] <= area[3]:
            taken = [box for box in taken if overlap(box, around)]
        best, best_place, best_cost = area, 0, math.inf
        # The last place is tried first: most often it is still free, and then nothing else has to be looked at.
        for index in _PLACES if last is None else (last, *_PLACES):
            if best_cost <= 0.0:
                break
            step, side = divmod(index, len(_SIDES))
            stays = index == last
            cost = _LONG * step - _LOYAL * stays
            if cost >= best_cost:
                continue
            tried = _beside(words, _SIDES[side], _STEPS[step] * words.size[1], area)
            harm = sum(_COVERED + covered for other in taken if (covered := overlap(tried, other)))
            if cost + harm - _PATIENT * stays < best_cost:
                harm += _DOUBTFUL * _doubts(tried, own, circles, led=step > 0)
            cost += max(0.0, harm - _PATIENT * stays)
            if cost < best_cost:
                best, best_place, best_cost = tried, index, cost
        self._last[words.key] = best_place
        return best


def line_to(box: Bounds, circle: Circle) -> tuple[Vector, Vector] | None:
    """The line from a circle to a box that stands far from it; None where it stands near."""
    (x, y), radius = circle
    end = nearest(box, (x, y))
    far = math.dist((x, y), end)
    if far <= radius + box[3] - box[1]:
        return None
    share = radius / far
    return (x + (end[0] - x) * share, y + (end[1] - y) * share), end


def overlap(a: Bounds, b: Bounds) -> float:
    """The area that two boxes have in common."""
    if a[0] >= b[2] or b[0] >= a[2] or a[1] >= b[3] or b[1] >= a[3]:
        return 0.0
    return (min(a[2], b[2]) - max(a[0], b[0])) * (min(a[3], b[3]) - max(a[1], b[1]))


def nearest(box: Bounds, point: Vector) -> Vector:
    """The point of a box that is nearest to a point."""
    return min(max(point[0], box[0]), box[2]), min(max(point[1], box[1]), box[3])


def _beside(words: Wanted, side: tuple[int, int], away: float, area: Bounds) -> Bounds:
    ((x, y), radius), (width, height) = words.about, words.size
    left = x + side[0] * (radius + _GAP + width / 2 + away) - width / 2
    top = y + side[1] * (radius + _GAP + height / 2 + away) - height / 2
    left = max(area[0], min(left, area[2] - width))
    top = max(area[1], min(top, area[3] - height))
    return left, top, left + width, top + height


def _doubts(box: Bounds, own: int, circles: Sequence[Circle], *, led: bool) -> int:
    """The number of other circles that the box may be taken for, or that its line crosses."""
    others = (circle for index, circle in enumerate(circles) if index != own and circle[1] > 0.0)
    if not led:
        clear = _edge(box, circles[own]) + _CLEARLY
        return sum(_edge(box, other) < clear for other in others)
    start, end = circles[own][0], nearest(box, circles[own][0])
    return sum(math.dist(centre, nearest_on_segment(centre, start, end)) < radius for centre, radius in others)


def _edge(box: Bounds, circle: Circle) -> float:
    """The distance from a box to the edge of a circle; negative where they overlap."""
    return math.dist(nearest(box, circle[0]), circle[0]) - circle[1]
