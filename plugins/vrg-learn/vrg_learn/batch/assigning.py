"""The assignment of marks to players, by the very function by which the referee assigns them."""

import numpy as np

from vrg.navigation.assignment import columns_of
from vrg_learn.batch.motion import put
from vrg_learn.batch.records import Floats, Numbers, Record


def line_up(m: Record, rows: Numbers, marks: Floats) -> None:
    """Put players of a match on marks by the least sum of squared distances, in mm^2, as the referee does.

    Args:
        rows: those of the players. marks: shape (as many, 3): x, y in m, heading in rad.
    """
    if len(rows) == 0:
        return
    costs = np.empty((len(rows), len(marks)))
    for i in range(len(rows)):
        for j in range(len(marks)):
            dx, dy = m.poses[rows[i], 0] - marks[j, 0], m.poses[rows[i], 1] - marks[j, 1]
            costs[i, j] = np.rint(1e6 * (dx * dx + dy * dy))
    chosen = columns_of(costs)
    for i in range(len(rows)):
        mark = marks[chosen[i]]
        put(m, rows[i], mark[0], mark[1], mark[2])
