"""A match file that is being changed, as a value: its text, and edits that give a new text. This needs no window.

The text is all there is, so comments and fields that no window shows are kept, and what is checked is what is saved.
"""

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from vrg.games import game_of
from vrg.toml_text import TomlValue, with_item, with_value, without
from vrg.types import Pose

SETTINGS: Final = ("name", "game", "map", "engine", "seed")
"""The fields of a match that can be changed."""
COLUMNS: Final = ("name", "role", "model", "backend", "strategy", "x", "y", "heading")
"""The fields of a player that can be changed."""
NUMBERS: Final = ("x", "y", "heading")
"""Those of them that are numbers: m, m and degrees."""
DEFAULTS: Final[Mapping[str, str]] = {"engine": "pybullet", "seed": "0", "model": "P2AT", "backend": "sim"}
"""What a field that is missing stands for, as far as that is the same in every match."""
HEADER: Final = (
    "# A match of {game}.\n"
    "# Lengths are in metres, headings in degrees counter-clockwise from +x, times in seconds.\n"
    "# docs/matches.md of VRG lists all fields.\n"
)
"""The comment at the top of a new match file."""


@dataclass(frozen=True)
class Entry:
    """One player of a draft.

    Args:
        name, role, model, backend, strategy: as the file says; empty where it says nothing.
        pose: where its robot starts, m and rad; None while that is no number.
    """

    name: str
    role: str
    model: str
    backend: str
    strategy: str
    pose: Pose | None


@dataclass(frozen=True)
class Draft:
    """A match file that is being changed.

    Args:
        text: of the file. base: the folder that relative paths in it start from.
        file: where it was read from or saved to; None if it is new.
    """

    text: str
    base: Path
    file: Path | None = None

    @classmethod
    def of_game(cls, game: str, base: Path) -> "Draft":
        """The default match of a game as a new match.

        Raises:
            OSError: its file cannot be read.
        """
        found = game_of(game)
        lines = found.default_match().read_text(encoding="utf-8").splitlines(keepends=True)
        # The comment at the top tells of the default match, of which little may be left in the end.
        first = next((index for index, line in enumerate(lines) if not line.startswith("#")), len(lines))
        return cls(HEADER.format(game=found.title) + "".join(lines[first:]), base)

    @cached_property
    def data(self) -> Mapping[str, Any]:
        """What the file says; nothing while it is no TOML."""
        try:
            return tomllib.loads(self.text)
        except tomllib.TOMLDecodeError:
            return {}

    @property
    def game(self) -> str:
        """The name of the game; empty if there is none."""
        return self.shown("game")

    @cached_property
    def players(self) -> tuple[Entry, ...]:
        """The players, in the order of the file."""
        return tuple(_entry(table) for table in self._tables)

    @property
    def _tables(self) -> Sequence[Mapping[str, Any]]:
        tables = self.data.get("players")
        return [table for table in tables if isinstance(table, dict)] if isinstance(tables, list) else []

    def shown(self, name: str, player: int | None = None) -> str:
        """What stands in a field, as a person types it; empty where the file says nothing.

        Args:
            player: the number of the player whose field it is; None for a field of the match.
        """
        return _shown((self.data if player is None else self._tables[player]).get(name))

    def default(self, name: str, player: int | None = None) -> str:
        """What holds where the file says nothing of a field; empty if that is for the game to say.

        Args:
            player: the number of the player whose field it is; None for a field of the match.
        """
        if name == "strategy" and player is not None:
            role, teams = game_of(self.game).role(self.players[player].role), self.data.get("teams")
            team = teams.get(role.team) if isinstance(teams, dict) and role is not None else None
            return _shown(team.get("strategy")) if isinstance(team, dict) else ""
        return "0" if name == "heading" else DEFAULTS.get(name, "")

    def set(self, name: str, typed: str, player: int | None = None) -> "Draft":
        """Return the draft with what was typed in a field. An empty text takes a field out that may be missing.

        What should be a number and is none is kept as it was typed, so that the check of the file can tell of it.

        Raises:
            ValueError: the field belongs to a player that is no table, or the file is no TOML.
        """
        typed = typed.strip()
        if typed == self.shown(name, player):
            return self
        where = () if player is None else ("players", player)
        if not typed and (name in DEFAULTS or name in ("strategy", "heading")):
            return replace(self, text=without(self.text, (*where, name)))
        return replace(self, text=with_value(self.text, (*where, name), _value(name, typed)))

    def place(self, player: int, pose: Pose) -> "Draft":
        """Return the draft with a player's robot at a pose, to the centimetre and a tenth of a degree."""
        draft = self
        for name, value in _numbers(pose).items():
            if draft.shown(name, player) != _shown(value):
                draft = replace(draft, text=with_value(draft.text, ("players", player, name), value))
        return draft

    def add(self, entry: Entry) -> "Draft":
        """Return the draft with one more player, the last one."""
        item: dict[str, TomlValue] = {"name": entry.name, "role": entry.role}
        for name in ("model", "backend", "strategy"):
            value = getattr(entry, name)
            if value and value != DEFAULTS.get(name):
                item[name] = value
        return replace(self, text=with_item(self.text, "players", item | _numbers(entry.pose or Pose(0.0, 0.0, 0.0))))

    def remove(self, player: int) -> "Draft":
        """Return the draft without a player."""
        return replace(self, text=without(self.text, ("players", player)))

    def named(self, name: str, file: Path) -> "Draft":
        """Return the draft as it is saved under another name."""
        return replace(self, text=with_value(self.text, ("name",), name), file=file)

    def free_name(self, role: str) -> str:
        """A name that no player has yet, like those of the players in the same role: `minnow4` after `minnow3`."""
        like = next((entry.name for entry in self.players if entry.role == role), role)
        stem = re.sub(r"\d+$", "", like) or role
        taken, number = {entry.name for entry in self.players}, 1
        while f"{stem}{number}" in taken:
            number += 1
        return f"{stem}{number}"


def _entry(table: Mapping[str, Any]) -> Entry:
    x, y, heading = (table.get("x"), table.get("y"), table.get("heading", 0.0))
    known = all(isinstance(v, int | float) and math.isfinite(v) for v in (x, y, heading))
    words = {name: _shown(table.get(name)) for name in ("name", "role", "model", "backend", "strategy")}
    return Entry(**words, pose=Pose(float(x), float(y), math.radians(heading)) if known else None)  # type: ignore[arg-type]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.10g}"
    return "" if value is None else str(value)


def _value(name: str, typed: str) -> TomlValue:
    """What was typed as a value of TOML: a number where one is wanted and it is one."""
    try:
        if name == "seed":
            return int(typed)
        return float(typed) if name in NUMBERS else typed
    except ValueError:
        return typed


def _numbers(pose: Pose) -> dict[str, TomlValue]:
    """The fields of a pose."""
    heading = math.degrees(math.remainder(pose.theta, math.tau))
    return {"x": round(pose.x, 2) + 0.0, "y": round(pose.y, 2) + 0.0, "heading": round(heading, 1) + 0.0}
