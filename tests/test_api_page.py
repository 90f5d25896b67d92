"""docs/api.md, in which students look things up, says what the code does."""

import runpy
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from vrg.agents import View
from vrg.bus.messages import PlayerStatus, RefereeState, Zone
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.hal.sensors.laser import Laser
from vrg.regions import Rectangle

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "scripts" / "api-page"


def test_the_page_is_what_the_code_says() -> None:
    command = [sys.executable, str(SCRIPT), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("kind", [View, PlayerStatus, RefereeState, Zone, Rectangle, Readings, Laser, RobotModel])
def test_everything_public_of_a_class_is_on_the_page(kind: type) -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    parts = page.split("\n### ")
    own = next(part for part in parts if part.startswith(f"{kind.__name__}\n"))
    if kind is Rectangle:
        own += next(part for part in parts if part.startswith("Region\n"))
    of_the_bus = {"version", "kind"} if kind in (Laser, RefereeState) else set()
    names = {name for name in dir(kind) if not name.startswith("_")} | set(getattr(kind, "__annotations__", ()))
    for name in names - of_the_bus:
        assert f"`{name}`" in own or f"`{name}(" in own, name


def test_a_field_of_which_no_docstring_says_anything_is_an_error() -> None:
    attributes = runpy.run_path(str(SCRIPT), run_name="api_page")["attributes"]

    @dataclass
    class Half:
        """A class.

        Args:
            one, two: numbers, m. three: another number, s.
        """

        one: float
        two: float
        three: float

    @dataclass
    class More(Half):
        """A class with one more."""

        four: float

    rows = [("one", "float", "Numbers, m."), ("two", "float", "Numbers, m."), ("three", "float", "Another number, s.")]
    assert attributes(Half) == rows
    with pytest.raises(SystemExit, match=r"More: its docstring says nothing of four"):
        attributes(More)
