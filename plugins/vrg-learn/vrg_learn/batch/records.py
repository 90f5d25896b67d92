"""Records: all that belongs to one match side by side in memory, under names.

A function of one match is given its record, of which numba passes the address alone, however many fields it has.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Numbers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Record = Any
"""One record: its fields are numbers and arrays."""
Records = Any
"""An array of records, a `numpy.recarray`: each of its fields is an array whose first index is the record."""


def records(count: int, **fields: tuple[Any, ...]) -> Records:
    """So many records of zeros.

    Args:
        fields: the type of each field, followed by its shape. Truth values are stored as 0 and 1: numba has no arrays
            of them in records.
    """
    layout = [
        (name, np.dtype(np.uint8 if kind is bool else kind), tuple(shape)) for name, (kind, *shape) in fields.items()
    ]
    return np.zeros(count, dtype=np.dtype(layout, align=True)).view(np.recarray)


def insert(keys: Floats, values: Numbers, count: int, key: float, value: int) -> None:
    """Put a value at its place among the first `count`, whose keys rise; behind those with the same key."""
    place = count
    while place > 0 and keys[place - 1] > key:
        keys[place], values[place] = keys[place - 1], values[place - 1]
        place -= 1
    keys[place], values[place] = key, value
