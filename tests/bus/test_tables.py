"""docs/bus.md, which people write programs in other languages from, and docs/seats.md say what the code does."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_tables_of_the_pages_are_those_of_the_code() -> None:
    command = [sys.executable, str(ROOT / "scripts" / "bus-tables"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
