"""The assignment of marks to players by the least sum of costs."""

import math

import numpy as np

from vrg_learn.batch.motion import put
from vrg_learn.batch.records import Floats, Numbers, Record


def line_up(m: Record, rows: Numbers, marks: Floats) -> None:
    """Put players of a match on marks by the least sum of squared distances, in mm^2, as the referee does.

    Args:
        rows: those of the players. marks: shape (as many, 3): x, y in m, heading in rad.
    """
    costs = np.empty((len(rows), len(marks)))
    for i in range(len(rows)):
        for j in range(len(marks)):
            dx, dy = m.poses[rows[i], 0] - marks[j, 0], m.poses[rows[i], 1] - marks[j, 1]
            costs[i, j] = np.rint(1e6 * (dx * dx + dy * dy))
    chosen = assigned(costs)
    for i in range(len(rows)):
        mark = marks[chosen[i]]
        put(m, rows[i], mark[0], mark[1], mark[2])


def assigned(costs: Floats) -> Numbers:
    """The column of each row, so that the sum of their costs is least: the Hungarian method with potentials.

    Args:
        costs: shape (rows, columns), with at least as many columns as rows.
    """
    rows, columns = costs.shape
    u, v = np.zeros(rows + 1), np.zeros(columns + 1)
    taken, way = np.zeros(columns + 1, dtype=np.int64), np.zeros(columns + 1, dtype=np.int64)
    for row in range(1, rows + 1):
        taken[0], column = row, 0
        least, used = np.full(columns + 1, math.inf), np.zeros(columns + 1, dtype=np.bool_)
        while taken[column] != 0:
            used[column] = True
            at, delta, following = taken[column], math.inf, 0
            for j in range(1, columns + 1):
                if used[j]:
                    continue
                cost = costs[at - 1, j - 1] - u[at] - v[j]
                if cost < least[j]:
                    least[j], way[j] = cost, column
                if least[j] < delta:
                    delta, following = least[j], j
            for j in range(columns + 1):
                if used[j]:
                    u[taken[j]] += delta
                    v[j] -= delta
                else:
                    least[j] -= delta
            column = following
        while column != 0:
            before = way[column]
            taken[column] = taken[before]
            column = before
    found = np.zeros(rows, dtype=np.int64)
    for j in range(1, columns + 1):
        if taken[j] != 0:
            found[taken[j] - 1] = j - 1
    return found
