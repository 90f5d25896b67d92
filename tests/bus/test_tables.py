"""docs/bus.md, which people write programs in other languages from, and docs/seats.md say what the code does."""

import runpy
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "bus-tables"


def test_the_tables_of_the_pages_are_those_of_the_code() -> None:
    command = [sys.executable, str(SCRIPT), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


def test_a_message_with_other_fields_needs_another_version() -> None:
    """A receiver that knows the fields of a version refuses all others, and would blame the sender."""
    unraised = runpy.run_path(str(SCRIPT))["unraised"]
    before = "**Manual**, version 1: `forward` number.\n\n**Drive**, version 3: `twist` Twist.\n"
    assert unraised(before, before) == []
    wider = before.replace("number.", "number, `side` number.")
    assert unraised(before, wider) == ["Manual"]
    assert unraised(before, wider.replace("version 1", "version 2")) == []
