"""A look as rows of numbers, for rules that are functions of numbers: of lists for one match, of arrays for many.

Such a function writes what it calls into a record with these fields: `total`, how many calls there are; and of each of
them `rules`, the number of its rule; `players`, the row of the player that it names first, or NO_ONE; `others`, which
others it names; and `instants`, when it was, as a fraction of the way between the two looks, or infinite for now.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, Final

from vrg.coordinator.rulebook import Observation
from vrg.geometry import interpolate
from vrg.types import Pose

NO_ONE: Final = -1
"""Stands for the row of a player where there is none."""
_NOWHERE = Pose(0.0, 0.0, 0.0)


def note(c: Any, rule: int, player: int, at: float) -> int:
    """Add a call to a record of calls, in which others are then marked, and return its number."""
    k = int(c.total)
    c.rules[k], c.players[k], c.instants[k] = rule, player, at
    c.total = k + 1
    return k


class Look:
    """The players at two looks, and a record of calls about them.

    A player that is not there at one of the looks is where it is at the other, or anywhere.

    Args:
        names: those of the rows. before, now: what was seen at the two looks. most: the calls that there is room for.

    Attributes:
        before, now: the pose (x, y, heading) of each. here, seen: whether it is there now, and at both looks.
    """

    def __init__(self, names: Sequence[str], before: Observation, now: Observation, most: int) -> None:
        self.names = names
        self._ends = [now.poses.get(name, _NOWHERE) for name in names]
        self._starts = [before.poses.get(name, end) for name, end in zip(names, self._ends, strict=True)]
        self.before = [(pose.x, pose.y, pose.theta) for pose in self._starts]
        self.now = [(pose.x, pose.y, pose.theta) for pose in self._ends]
        self.here = [name in now.poses for name in names]
        self.seen = [name in now.poses and name in before.poses for name in names]
        self.total = 0
        self.rules, self.players, self.instants = [0] * most, [NO_ONE] * most, [math.inf] * most
        self.others: dict[int, list[bool]] = defaultdict(lambda: [False] * len(names))

    def noted(self) -> Iterator[tuple[int, tuple[str, ...], tuple[Pose, ...]]]:
        """The rule and the players of each call, in order, with the poses that those had who are there."""
        for k in range(self.total):
            first = () if self.players[k] == NO_ONE else (self.players[k],)
            rows = (*first, *(n for n, named in enumerate(self.others[k]) if named))
            yield self.rules[k], tuple(self.names[n] for n in rows), tuple(self._poses(rows, self.instants[k]))

    def _poses(self, rows: Sequence[int], at: float) -> Iterator[Pose]:
        for n in rows:
            if self.here[n]:
                yield self._ends[n] if at == math.inf else interpolate(self._starts[n], self._ends[n], at)
