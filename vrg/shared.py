"""Results that many need at the same instant, computed by the first who asks.

In a match in one process all players are given the same objects: one state of the referee, for example, and not copies
of it. What follows from these objects alone is then the same for all of them. This module imports nothing of VRG.
"""

from collections.abc import Callable
from functools import wraps
from operator import is_
from typing import Any, TypeVar, TypeVarTuple

Ts = TypeVarTuple("Ts")
T = TypeVar("T")


def shared(function: Callable[[*Ts], T]) -> Callable[[*Ts], T]:
    """A function of one argument or more that keeps its newest result, and returns it again for the same arguments.

    Only the very same objects count as the same arguments. So they are compared quickly and may be of any type, but
    neither they nor the result may be changed.
    """
    newest: tuple[Any, tuple[Any, ...], T] | None = None

    @wraps(function)
    def kept(first: Any, *others: Any) -> T:
        nonlocal newest
        known = newest  # another thread may replace it at any time
        if known is not None and known[0] is first and (not others or all(map(is_, known[1], others))):
            return known[2]
        result = function(first, *others)  # type: ignore[call-arg]
        newest = first, others, result
        return result

    return kept  # type: ignore[return-value]
