"""The assignment of rows to columns by the least sum of costs, for a few dozen of either.

Shortest augmenting paths: D. F. Crouse, *On implementing 2D rectangular assignment algorithms*, IEEE Transactions on
Aerospace and Electronic Systems 52 (2016), section II. Among equal sums, the same one is always taken: that which
`scipy.optimize.linear_sum_assignment` takes, too.
"""

import math
from collections.abc import Sequence
from typing import Any


def assign(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """The pairs (row, column) whose costs have the least sum, in the order of the rows.

    Each row is in at most one pair, and each column; as many pairs are made as there are rows or columns, whichever are
    fewer.

    Args:
        costs: as rows of one length; finite.
    """
    if not costs or not costs[0]:
        return []
    if len(costs[0]) < len(costs):
        turned = columns_of([list(column) for column in zip(*costs, strict=True)])
        return sorted((row, column) for column, row in enumerate(turned))
    return list(enumerate(columns_of(costs)))


def columns_of(costs: Any) -> list[int]:
    """The column of each row, where there are at least as many columns as rows, and at least one.

    It is compiled for batches of matches, too.

    Args:
        costs: as rows of one length, or an array of shape (rows, columns); finite.
    """
    columns, free = range(len(costs[0])), -1
    row_price, column_price = [0.0] * len(costs), [0.0] * len(columns)
    row_of, column_of = [free] * len(columns), [-1] * len(costs)
    for row in range(len(costs)):
        shortest, before = [math.inf] * len(columns), [-1] * len(columns)
        seen_rows: list[int] = []
        seen_columns: list[int] = []
        # From the last column on, so that where all costs are equal the diagonal is taken.
        left = list(columns)[::-1]
        least, at, sink = 0.0, row, -1
        while sink < 0:
            seen_rows.append(at)
            best, nearest = -1, math.inf
            for place, column in enumerate(left):
                cost = least + costs[at][column] - row_price[at] - column_price[column]
                if cost < shortest[column]:
                    shortest[column], before[column] = cost, at
                # Among equal ones, a free column ends the path.
                if shortest[column] < nearest or (shortest[column] == nearest and row_of[column] == free):
                    nearest, best = shortest[column], place
            least, column = nearest, left[best]
            seen_columns.append(column)
            left[best] = left[-1]
            left.pop()
            owner = row_of[column]
            if owner == free:
                sink = column
            else:
                at = owner
        row_price[row] += least
        for other in seen_rows[1:]:
            row_price[other] += least - shortest[column_of[other]]
        for column in seen_columns:
            column_price[column] -= least - shortest[column]
        column = sink
        while True:
            at = before[column]
            row_of[column] = at
            column_of[at], column = column, column_of[at]
            if at == row:
                break
    return column_of
