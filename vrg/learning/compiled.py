"""The compilation of functions of numbers, such as those by which the referee judges, as they stand.

`compiled` makes machine code of a function and of all that it calls in VRG, by numba. Neither they nor their modules know
of it, so a match needs no numba. Without numba a function is returned as it is, and the same code runs, slowly.
"""

import functools
import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any, Final, NamedTuple, TypeVar, cast

import numpy as np

import vrg
from vrg import geometry, regions, types
from vrg.hal.sim import shapes

F = TypeVar("F", bound=Callable[..., Any])

HAS_NUMBA: Final = importlib.util.find_spec("numba") is not None
"""True if functions are compiled."""


class Place(NamedTuple):
    """A pose in machine code: vrg.types.Pose, whose class numba does not know."""

    x: float
    y: float
    theta: float


def _wrap(angle: float) -> float:
    """The same as vrg.geometry.wrap; numba does not know math.remainder. No step rounds."""
    rest = float(np.fmod(angle, math.tau))
    if rest > math.pi:
        return rest - math.tau
    return rest + math.tau if rest < -math.pi else rest


class Disc(NamedTuple):
    """A circle in machine code: vrg.regions.Circle."""

    x: float
    y: float
    radius: float


class Outline(NamedTuple):
    """A box in machine code: vrg.hal.sim.shapes.Box."""

    x: float
    y: float
    heading: float
    length: float
    width: float


class Between(NamedTuple):
    """A gap in machine code: vrg.hal.sim.shapes.Gap."""

    distance: float
    nx: float
    ny: float
    x: float
    y: float


class Velocity(NamedTuple):
    """A twist in machine code: vrg.types.Twist."""

    v: float
    w: float


_INSTEAD: Final[dict[int, Any]] = {
    id(types.Twist): Velocity,
    id(types.Pose): Place,
    id(regions.Circle): Disc,
    id(shapes.Box): Outline,
    id(shapes.Gap): Between,
    id(geometry.wrap): _wrap,
}
"""What stands in machine code for what numba does not know, by its id."""
_done: dict[int, Any] = {}


def compiled(function: F) -> F:
    """The function as machine code, which holds no lock while it runs; without numba the function itself."""
    return cast(F, _compiled(function)) if HAS_NUMBA else function


def _compiled(function: Any) -> Any:
    """Compile a function after those that it calls. Its module's own names stay as they are."""
    known = _done.get(id(function))
    if known is not None:
        return known
    from numba import njit

    own = cast(FunctionType, _INSTEAD.get(id(function), function))
    names = dict(own.__globals__)
    for name in own.__code__.co_names:
        value = names.get(name)
        if id(value) in _INSTEAD and isinstance(value, type):
            names[name] = _INSTEAD[id(value)]
        elif isinstance(value, FunctionType) and _is_ours(value):
            names[name] = _compiled(value)
    twin = FunctionType(own.__code__, names, own.__name__, own.__defaults__, own.__closure__)
    functools.update_wrapper(twin, own)
    # fastmath stays off: results must be those of Python, to the last bit wherever the processor allows it.
    found = _done[id(function)] = njit(nogil=True, error_model="numpy", forceinline=True)(twin)
    return found


def _is_ours(function: FunctionType) -> bool:
    return Path(function.__code__.co_filename).is_relative_to(Path(vrg.__file__).parent)
