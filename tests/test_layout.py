"""The rooms of the house: who may import whom."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import vrg

ROOT = Path(vrg.__file__).parent
ONLY_IN = {
    "pybullet": "hal/sim",
    "can": "hal/can",
    "canopen": "hal/can",
    "zenoh": "bus",
    "pygame": "ui",
}
ABOVE = {
    "bus": ("hal", "agents", "coordinator", "ui", "launch", "commands", "config"),
    "hal": ("agents", "coordinator", "ui", "launch", "commands", "config"),
    "agents": ("coordinator", "ui", "launch", "commands", "config"),
    "coordinator": ("agents", "ui", "launch", "commands", "config"),
    "ui": ("launch", "commands"),
}
"""What each room may not import."""


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


FILES = sorted(ROOT.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_module_imports_only_what_its_room_may(path: Path) -> None:
    place = path.relative_to(ROOT).as_posix()
    for name in _imports(path):
        top = name.split(".")[0]
        if top in ONLY_IN:
            assert place.startswith(ONLY_IN[top]), f"{place} imports {top}, which belongs to {ONLY_IN[top]}"
        for room, above in ABOVE.items():
            if place.startswith(f"{room}/"):
                assert name.split(".")[:1] != ["vrg"] or name.split(".")[1:2] not in [[a] for a in above], (
                    f"{place} imports {name}"
                )


def test_a_window_is_not_loaded_by_the_command_line() -> None:
    """Whoever plays over ssh waits for no graphics library, and without a CAN bus for none of CAN."""
    late = ("pygame", "matplotlib", "pybullet", "can", "canopen")
    code = f"import sys, vrg.cli; print([m for m in {late} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert out.stdout.strip() == "[]"
