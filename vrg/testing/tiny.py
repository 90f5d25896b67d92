"""A match of three robots on a small field, which is played in a few seconds; one may have emulated drives."""

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

TINY = """
name = "tiny"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = 3
lasers = false
[rules]
x = [-5.0, 5.0]
y = [-5.0, 5.0]
passes = 1
[[players]]
name = "shark"
role = "shark"
x = 0.0
y = -4.0
[[players]]
name = "ann"
role = "minnow"
x = -3.0
y = 4.0
[[players]]
name = "bob"
role = "minnow"
x = 3.0
y = 4.0
"""

STILL = """
from vrg.agents import Strategy, Twist


class Still(Strategy):
    def act(self, view):
        return Twist(0.0, 0.0)
"""
"""The code of a strategy that stands."""

TINY_CAN = TINY.replace(
    "[[players]]",
    """[backends.can]
interface = "virtual"
channel = "tiny"
emulate = true
[backends.can.robots.ann]
left = [0]
right = [1]
ratio = 50.0
[[players]]""",
    1,
).replace('name = "ann"', 'name = "ann"\nbackend = "can"')
"""The same; the motors of ann's robot are on a CAN bus."""

SOURCE = """[localisation.overhead]
source = "sim"
"""


def located(text: str, *names: str, more: str = "") -> str:
    """The match file with a simulated camera that locates these players."""
    for name in names:
        text = text.replace(f'name = "{name}"\n', f'name = "{name}"\nlocalisation = "fusion"\n')
    return text.replace("[[players]]", f"{SOURCE}{more}[[players]]", 1)


def forms(text: str) -> dict[str, str]:
    """The same match file in other forms of TOML, by what is different."""
    data = tomllib.loads(text)
    head, first = text[: text.index("[rules]")], text.index("[[players]]")
    listed = ",".join(map(_inline, data["players"]))
    dotted = "".join(f"rules.{key} = {json.dumps(value)}\n" for key, value in data["rules"].items())
    return {
        "players in a list": f"{head}players = [\n{listed}]\n{text[len(head) : first]}",
        "rules in one line": f"{head}rules = {_inline(data['rules'])}\n{text[first:]}",
        "dotted keys": head + dotted + text[first:],
        "quoted keys": text.replace("seed =", '"seed" =').replace("[[players]]", '[["players"]]'),
        "odd signs": text.replace("[rules]", "secret = 'a#[b]' # \u2028[[players]]\n[rules] # \x85engine = 1"),
    }


def _inline(table: dict[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }"


def work_in(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let a folder be the working folder of a test, with `tiny.toml` and `still.py`, and windows draw nothing."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    (folder / "tiny.toml").write_text(TINY, encoding="utf-8")
    (folder / "still.py").write_text(STILL, encoding="utf-8")
    return folder
