"""Mistakes that are planted into rules, so that a test shows that it would find them."""

import inspect
from types import FunctionType

import pytest


def plant(patch: pytest.MonkeyPatch, function: FunctionType, old: str, new: str) -> None:
    """Let a function do something else, wherever it is called, until the test ends.

    Args:
        old: what stands in it, once. new: what stands there in place of it.
    """
    source, names = inspect.getsource(function), dict(function.__globals__)
    assert source.count(old) == 1
    exec(source.replace(old, new), names)
    patch.setattr(function, "__code__", names[function.__name__].__code__)
