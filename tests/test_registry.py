"""Tables of names: what comes with VRG, what other packages add, and what is said of a name that is not there."""

from importlib.metadata import EntryPoint

import pytest

from vrg import registry
from vrg.errors import ConfigError
from vrg.registry import Registry

GROUP = "vrg.numbers"


def numbers() -> Registry[float]:
    return Registry(
        "number",
        GROUP,
        {"pi": "math:pi", "e": "math:e", "broken": "math:nothing"},
        lambda found: None if isinstance(found, float) else "expected a float",
    )


def plug(monkeypatch: pytest.MonkeyPatch, **entries: str) -> None:
    made = {name: EntryPoint(name, value, GROUP) for name, value in entries.items()}
    monkeypatch.setattr(registry, "added", lambda: {GROUP: made})


def test_what_comes_with_vrg_is_imported_when_it_is_asked_for() -> None:
    assert numbers().names() == ["broken", "e", "pi"]
    assert numbers().get("pi") == pytest.approx(3.14159, abs=1e-4)
    assert "pi" in numbers()


def test_another_package_adds_one_but_cannot_take_a_name_that_comes_with_vrg(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, tau="math:tau", pi="math:e")
    assert numbers().names() == ["broken", "e", "pi", "tau"]
    assert numbers().get("tau") > 6.0
    assert numbers().get("pi") > 3.0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pie", "number: expected one of broken, e, pi, got 'pie', did you mean 'pi'?"),
        ("PI", "did you mean 'pi'?"),
        ("seven", "number: expected one of broken, e, pi, got 'seven'$"),
        ("broken", "number broken: cannot import math:nothing: AttributeError"),
    ],
)
def test_a_name_that_is_not_there_is_answered_with_those_that_are(name: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        numbers().get(name)
    assert numbers().find(name) is None


def test_a_broken_plug_in_is_told_as_its_own_fault_and_harms_nobody_else(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, bad="no_such_package:x", wrong="math:sin")
    table = numbers()
    assert table.get("pi") > 3.0
    with pytest.raises(ConfigError, match=r"number bad: cannot import no_such_package:x of the entry point group"):
        table.get("bad")
    with pytest.raises(ConfigError, match=r"number wrong: expected a float, got"):
        table.get("wrong")
    assert table.find("bad") is None
