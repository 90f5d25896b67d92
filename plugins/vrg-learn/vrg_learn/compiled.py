"""The compilation of functions of numbers, such as those by which the referee judges, as they stand.

`compiled` makes machine code by numba of a function and of all that it calls in VRG and in this package. Neither they
nor their modules know of it, so a match needs no numba. Without numba a function is returned as it is, and the same
code runs, slowly.
"""

import contextlib
import functools
import hashlib
import importlib.util
import inspect
import math
from collections import namedtuple
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FunctionType
from typing import Any, Final, TypeVar, cast

import numpy as np
import platformdirs

import vrg
import vrg_learn
from vrg import geometry, regions, types
from vrg.hal.sim import shapes
from vrg.portable.scalars import cos_sin, within_a_quarter

F = TypeVar("F", bound=Callable[..., Any])

_FOLDERS: Final = (Path(vrg.__file__).parent, Path(vrg_learn.__file__).parent)
HAS_NUMBA: Final = importlib.util.find_spec("numba") is not None
"""True if functions are compiled."""


def _wrap(angle: float) -> float:
    """The same as vrg.geometry.wrap; numba does not know math.remainder. No step rounds."""
    rest = float(np.fmod(angle, math.tau))
    if rest > math.pi:
        return rest - math.tau
    return rest + math.tau if rest < -math.pi else rest


def _cos_sin(angle: float) -> tuple[float, float]:
    """The same as vrg.portable.scalars.cos_sin for angles up to its FAR, as all headings are.

    It has no branches, so that the processor works on several angles at a time.
    """
    quarters, cos, sin = within_a_quarter(angle)
    quarter = quarters - 4.0 * np.floor(quarters * 0.25)
    odd = abs(quarter - 2.0) == 1.0
    return (
        (-1.0 if abs(quarter - 1.5) == 0.5 else 1.0) * (sin if odd else cos),
        (-1.0 if quarter >= 2.0 else 1.0) * (cos if odd else sin),
    )


def _tuple_of(kind: type) -> type:
    """A tuple with the fields of a class and their defaults: numba knows tuples, but none of the project's classes."""
    defaults = [p.default for p in inspect.signature(kind).parameters.values() if p.default is not p.empty]
    return namedtuple(kind.__name__, inspect.signature(kind).parameters, defaults=defaults)


_INSTEAD: Final[dict[int, Any]] = {
    id(geometry.wrap): _wrap,
    id(cos_sin): _cos_sin,
    **{id(kind): _tuple_of(kind) for kind in (types.Pose, types.Twist, regions.Circle, shapes.Box, shapes.Gap)},
}
"""The machine code for objects that numba does not know, by their ids."""


_OF_THE_C_LIBRARY: Final = {"sin", "cos", "tan", "atan2", "exp", "log", "hypot", "dist"}
"""What numba takes from the C library, or computes otherwise than Python does."""


def hole(*_: Any) -> Any:
    """Stands for a function that `compiled` fills in, such as the rules of a game."""
    raise NotImplementedError("expected a function that `compiled` has filled in")


_Filled = dict[str, FunctionType]
_done: dict[tuple[int, ...], Any] = {}


def compiled(function: F, **filled: Callable[..., Any]) -> F:
    """The function as machine code, which holds no lock while it runs; without numba as it is.

    The machine code is kept in the user's cache, for as long as no file that it is made of changes.

    Args:
        filled: the functions that its module, and those that it calls there, name as a `hole`.
    """
    files: set[str] = set()
    return cast(F, _compiled(function, cast(_Filled, filled), files, outermost=True))


def direct(function: F) -> F:
    """A compiled function of which each call is given arguments of the same types as the first one.

    From the second call on they are not compared, which takes longer than to play a match for a decision. Others would
    end the process, so who calls it must make sure of them.
    """
    if not HAS_NUMBA:
        return function
    entries: list[Any] = []

    def call(*arguments: Any) -> Any:
        if entries:
            return entries[0](*arguments)
        result = function(*arguments)
        kinds = tuple(map(function.typeof_pyval, arguments))  # type: ignore[attr-defined]
        entries.append(function.overloads[kinds].entry_point)  # type: ignore[attr-defined]
        return result

    return cast(F, call)


def _compiled(function: Any, filled: _Filled, files: set[str], *, outermost: bool = False) -> Any:
    """Compile a function after those that it calls. Its module's own names stay as they are.

    Args:
        files: the files of all functions that were compiled; this one's are added.
    """
    own = cast(FunctionType, _INSTEAD.get(id(function), function)) if HAS_NUMBA else function
    own_filled = {name: value for name, value in filled.items() if own.__globals__.get(name) is hole}
    names = {**own.__globals__, **own_filled}
    files.add(own.__code__.co_filename)
    if HAS_NUMBA and (its := {name for name in own.__code__.co_names if name not in names} & _OF_THE_C_LIBRARY):
        raise ValueError(f"{own.__qualname__} has other last bits as machine code: use {its} of vrg.portable.scalars")
    for name in own.__code__.co_names:
        value = names.get(name)
        if HAS_NUMBA and isinstance(value, type) and id(value) in _INSTEAD:
            names[name] = _INSTEAD[id(value)]
        elif isinstance(value, FunctionType) and _is_ours(value):
            names[name] = _compiled(value, filled, files)
    key = (id(function), outermost, *map(id, own_filled.values()))
    if key not in _done:
        twin = FunctionType(own.__code__, names, own.__name__, own.__defaults__, own.__closure__)
        functools.update_wrapper(twin, own)
        # One name for each combination, by which numba finds its machine code again.
        twin.__qualname__ = f"{own.__qualname__}-{_digest(f'{f.__module__}.{f.__name__}' for f in own_filled.values())}"
        _done[key] = _machine_code(twin, files if outermost else None) if HAS_NUMBA else twin
    return _done[key]


def _machine_code(function: FunctionType, kept: set[str] | None) -> Any:
    """Let numba compile a function when it is called first.

    Args:
        kept: the files that its machine code, which is kept, is made of; None keeps none.
    """
    from numba import config, njit  # noqa: PLC0415 - not everybody has it, and a policy in a match needs none

    cached = False
    if kept is not None:
        # numba itself compares the file of the function alone.
        folder = platformdirs.user_cache_path("vrg") / "machine-code"
        folder /= _digest(Path(file).read_text(encoding="utf-8") for file in sorted(kept))
        with contextlib.suppress(OSError):  # a home may be read-only
            folder.mkdir(parents=True, exist_ok=True)
            vars(config)["CACHE_DIR"], cached = str(folder), True

    def made(*, cache: bool) -> Any:
        # fastmath stays off: results must be those of Python, to the last bit wherever the processor allows it.
        return njit(nogil=True, error_model="numpy", forceinline=kept is None, cache=cache)(function)

    try:
        return made(cache=cached)
    except RuntimeError:  # the folder is there, and of another user
        return made(cache=False)


def _digest(texts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


def _is_ours(function: FunctionType) -> bool:
    file = Path(function.__code__.co_filename)
    return any(file.is_relative_to(folder) for folder in _FOLDERS)
