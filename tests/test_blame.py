"""Who is told to be at fault for an exception: the innermost line of the student's own code."""

import json
import socket
from pathlib import Path

import pytest

from vrg import blame
from vrg.blame import OutputFloodError, failure_of, is_students, place_of_method


def fails() -> None:
    json.loads("{")  # the innermost line of this file; below it are lines of the library


def test_the_innermost_line_that_is_no_librarys_is_named() -> None:
    with pytest.raises(ValueError, match="Expecting") as caught:
        fails()
    told = failure_of(caught.value)
    assert str(told).startswith("JSONDecodeError: Expecting property name")
    assert str(told).endswith(f"(test_blame.py, line {fails.__code__.co_firstlineno + 1}, in fails)")
    assert told.__cause__ is caught.value
    assert not told.final


def test_a_mistake_of_syntax_names_the_file_that_has_it_and_an_exception_without_a_place_none() -> None:
    with pytest.raises(SyntaxError) as caught:
        compile("def f(:\n", "/home/ann/mine.py", "exec")
    assert str(failure_of(caught.value)).endswith("(mine.py, line 1)")
    assert str(failure_of(ValueError("x"))) == "ValueError: x"


@pytest.mark.parametrize("error", [MemoryError(), OutputFloodError("too much")])
def test_some_failures_are_not_tried_again(error: Exception) -> None:
    assert failure_of(error).final


def test_where_a_method_is_written() -> None:
    class Mine:
        def act(self) -> None:
            """Do nothing."""

    assert place_of_method(Mine(), "act").startswith("test_blame.py, line ")
    assert place_of_method(Mine(), "fly") == ""


def test_whose_file_it_is() -> None:
    assert is_students("/home/ann/mine.py")
    assert not is_students(json.__file__)
    assert not is_students(str(Path(place_of_method.__code__.co_filename)))


def test_a_refusal_of_the_sandbox_is_told_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blame, "_REFUSED", [])
    denied = PermissionError(13, "Permission denied")
    unknown = socket.gaierror(-3, "Temporary failure in name resolution")
    assert "sandbox" not in str(failure_of(denied))
    blame.tell_of_refusals("the sandbox refused it")
    assert str(failure_of(denied)) == "PermissionError: [Errno 13] Permission denied; the sandbox refused it"
    assert str(failure_of(unknown)).endswith("Temporary failure in name resolution; the sandbox refused it")
    assert "sandbox" not in str(failure_of(FileNotFoundError(2, "No such file")))
