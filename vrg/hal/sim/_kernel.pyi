"""The functions of the compiled kernel. Arrays are contiguous; those named in a docstring as written are changed."""

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Flags = npt.NDArray[np.bool_]
_Rows = npt.NDArray[np.intp]

def accelerate(
    dt: float, targets: _Floats, speeds: _Floats, slew: _Floats, slowing: _Floats, sideways: _Flags, /
) -> None:
    """`Engine._accelerate`: `speeds` is written."""

def advance(
    dt: float,
    targets: _Floats,
    speeds: _Floats,
    slew: _Floats,
    slowing: _Floats,
    sideways: _Flags,
    motions: _Floats,
    reach: _Floats,
    velocities: _Floats,
    poses: _Floats,
    angles: _Floats,
    budgets: _Floats,
    /,
) -> bool:
    """`PlanarEngine._advance`: `speeds`, and all from `velocities` on, are written."""

def candidates(
    margin: float,
    push: float,
    poses: _Floats,
    reach: _Floats,
    kinematic: _Flags,
    box_at: _Floats,
    box_half: _Floats,
    box_cos: _Floats,
    box_sin: _Floats,
    discs: _Floats,
    budgets: _Floats,
    checked: _Flags,
    /,
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """`PlanarEngine._candidates`: `budgets` and `checked`, shape (2, robots), are written."""
