"""The tables of keys, messages and seats, from which people write programs in other languages."""

import runpy
from pathlib import Path

TABLES = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "tables"))


def test_a_message_whose_fields_have_changed_has_another_version() -> None:
    """A receiver that knows the fields of a version refuses all others, and would blame the sender."""
    kept = TABLES["KEPT"].read_text(encoding="utf-8")
    messages = TABLES["bodies"]()
    assert TABLES["unraised"](kept, messages) == [], "raise the version of these"
    assert kept == messages, "their versions are raised: keep them by scripts/tables --write"


def test_a_version_that_was_not_raised_is_found() -> None:
    unraised = TABLES["unraised"]
    before = "**Manual**, version 1: `forward` number.\n\n**Drive**, version 3: `twist` Twist.\n"
    assert unraised(before, before) == []
    wider = before.replace("number.", "number, `side` number.")
    assert unraised(before, wider) == ["Manual"]
    assert unraised(before, wider.replace("version 1", "version 2")) == []


def test_the_pages_are_as_the_code_is() -> None:
    wrong = [page.name for page in TABLES["PAGES"] if TABLES["tabled"](text := page.read_text("utf-8")) != text]
    assert not wrong, "write them by scripts/tables --write"


def test_each_table_has_its_keys() -> None:
    assert "| `referee/state` | RefereeState | state | referee | all |" in TABLES["key_map"]()
    assert "| `commander.TEAM` | `player/<own team's>/manual`" in TABLES["seats"]()
