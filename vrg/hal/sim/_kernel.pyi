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

def press(
    dt: float,
    give: float,
    drive: float,
    cos: _Floats,
    sin: _Floats,
    velocities: _Floats,
    rims: _Floats,
    ways: _Floats,
    damped: _Floats,
    grips: _Floats,
    stretches: _Floats,
    forces: _Floats,
    /,
) -> None:
    """`Traction.press`: `stretches` and `forces` are written."""

def depart(
    places: _Floats,
    speeds: _Floats,
    zeros: _Floats,
    frames: _Floats,
    cos: _Floats,
    sin: _Floats,
    poses: _Floats,
    velocities: _Floats,
    /,
) -> None:
    """`MujocoEngine._depart`: all up to `sin` are written."""

def settle(
    places: _Floats,
    speeds: _Floats,
    zeros: _Floats,
    frames: _Floats,
    cos: _Floats,
    sin: _Floats,
    bound: _Floats,
    /,
) -> None:
    """`MujocoEngine._settle`: all but `places` and `bound` are written."""

def arrive(
    places: _Floats,
    speeds: _Floats,
    zeros: _Floats,
    frames: _Floats,
    cos: _Floats,
    sin: _Floats,
    kinematic: _Flags,
    poses: _Floats,
    velocities: _Floats,
    /,
) -> None:
    """`MujocoEngine._arrive`: the headings in `places`, `poses` and `velocities` are written."""

def integrate(
    angles: _Floats,
    axes: _Rows,
    per_rad: _Floats,
    turned: _Floats,
    factors: _Floats,
    motions: _Floats,
    starts: _Rows,
    poses: _Floats,
    moved: _Floats,
    /,
) -> None:
    """`OdometrySimulation._integrate`: `poses` and `moved` are written."""

def outlines(poses: _Floats, sizes: _Floats, ends: _Floats, normals: _Floats, offsets: _Floats, /) -> None:
    """`rays.among_robots`: `ends`, `normals` and `offsets` of the edges of robots are written."""

def cast_edges(
    range_max: float,
    places: _Floats,
    turns: _Floats,
    ends: _Floats,
    normals: _Floats,
    offsets: _Floats,
    directions: _Floats,
    order: _Floats,
    inverse: _Floats,
    /,
) -> None:
    """`rays._cast_edges`: `inverse` is written."""

def cone_edges(
    range_max: float,
    slope: float,
    stretch: float,
    poses: _Floats,
    turns: _Floats,
    ends: _Floats,
    normals: _Floats,
    offsets: _Floats,
    nearest: _Floats,
    /,
) -> None:
    """`rays._hear_edges`: `nearest` is written. `stretch` is the length of the vector (1, `slope`)."""
