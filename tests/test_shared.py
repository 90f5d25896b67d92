"""A result that many need is computed by the first who asks."""

import pytest

from vrg.shared import shared


def test_the_first_computes_for_all_who_ask_with_the_same_objects() -> None:
    asked: list[list[int]] = []

    @shared
    def total(numbers: list[int], factor: int) -> int:
        asked.append(numbers)
        return sum(numbers) * factor

    some, equal = [1, 2], [1, 2]
    assert [total(some, 3), total(some, 3)] == [9, 9]
    assert len(asked) == 1
    assert total(equal, 3) == 9
    assert len(asked) == 2, "equal objects are other ones: they may change in different ways"
    assert total(equal, 4) == 12
    assert total.__name__ == "total"


def test_a_failure_is_not_kept() -> None:
    fails = [False, True]

    @shared
    def once_bad(_: object) -> str:
        if fails.pop():
            raise ValueError("bad")
        return "good"

    key = object()
    with pytest.raises(ValueError, match="bad"):
        once_bad(key)
    assert once_bad(key) == "good"
