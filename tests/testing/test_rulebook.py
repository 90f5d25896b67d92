"""The contract of rule books lets a good one pass, and finds what is wrong in others, in words and by a seed."""

import inspect
import random
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.testing.harbour import FAULTY, READY, Harbour, Random
from vrg.coordinator.rulebook import RuleBook
from vrg.testing.leap import leap
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.trial import trial


class TestHarbour(RuleBookContract):
    @pytest.fixture
    def book(self) -> Harbour:
        return Harbour()

    @pytest.fixture
    def ready(self) -> Any:
        return READY


def promises() -> Iterator[tuple[Callable[..., None], dict[str, Any]]]:
    """The tests of the contract, each with the values that it is run with."""
    for name, test in vars(RuleBookContract).items():
        if name.startswith("test"):
            [cases] = [mark.args for mark in getattr(test, "pytestmark", [])] or [("", [None])]
            yield from ((test, {cases[0]: value} if cases[0] else {}) for value in cases[1])


def broken(book: Callable[[], RuleBook[Any]]) -> list[str]:
    """What the tests of the contract say of a rule book that fails them."""
    random.seed(7)  # what a rule book draws is the same each time
    found = []
    for test, values in promises():
        given = {"book": book(), "ready": READY, **values}
        try:
            test(RuleBookContract(), **{n: given[n] for n in inspect.signature(test).parameters if n != "self"})
        except (Exception, pytest.fail.Exception) as error:  # whatever fails a test
            found.append(str(error))
    return found


def test_nothing_is_found_where_nothing_is_wrong() -> None:
    assert len(list(promises())) > 12
    assert broken(Harbour) == []


@pytest.mark.parametrize(("book", "words"), FAULTY.items(), ids=lambda value: getattr(value, "__name__", ""))
def test_what_is_wrong_is_found_and_said_in_words(book: type[Harbour], words: str) -> None:
    found = broken(book)
    assert any(re.search(words, text) for text in found), found


@pytest.mark.parametrize("book", [book for book in FAULTY if book is not Random])
def test_it_is_seen_again_by_its_seed(book: type[Harbour]) -> None:
    for text in broken(book):
        for name, again in (("trial", trial), ("leap", leap)):
            for seed in re.findall(rf"\.{name}\(book, ready, seed=(\d+)\)", text):
                with pytest.raises(AssertionError, match=re.escape(text[:40])):
                    again(book(), READY, int(seed))
