"""A match file that is being changed, as a value: its text, and edits that give a new text. This needs no window.

The text is all there is, so comments and fields that no window shows are kept, and what is checked is what is saved.
"""

import math
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any, Final

from vrg.errors import Path
from vrg.files import toml_of
from vrg.games import GAMES, STRATEGIES, game_of, strategies_of
from vrg.hal.sim.engines import default_engine
from vrg.toml_text import TomlValue, quoted, with_item, with_value, without
from vrg.types import Pose

SETTINGS: Final[Mapping[str, str]] = {
    "name": "",
    "game": "",
    "map": "",
    "engine": default_engine(),
    "rate": "1",
    "seed": "0",
    "noise": "true",
    "lasers": "true",
    "on_fault": "disqualify",
    "memory": "2000",
    "sight": "",
}
"""The fields of a match that can be changed, with what holds where one is missing."""
COLUMNS: Final[Mapping[str, str]] = {
    "name": "",
    "role": "",
    "strategy": "",
    "model": "P2AT",
    "backend": "sim",
    "x": "",
    "y": "",
    "heading": "0",
}
"""The same of a player."""
POSE: Final = ("x", "y", "heading")
"""Those of a player that are numbers: m, m and degrees."""
_NEEDED: Final = ("name", "game", "map", "role", "x", "y")
"""The fields that may not be missing."""
_WORDS: Final = ("name", "game", "map", "engine", "on_fault", "role", "strategy", "model", "backend")
"""The fields whose values are texts."""
HEADER: Final = (
    "# A match of {game}.\n"
    "# Lengths are in metres, headings in degrees counter-clockwise from +x, times in seconds.\n"
    "# docs/match-file.md of VRG lists all fields.\n"
)
"""The comment at the top of a new match file."""


@dataclass(frozen=True)
class Entry:
    """One player of a draft.

    Args:
        name, role, model, backend, strategy: as in the file; empty where they are not in it.
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
    base: FilePath
    file: FilePath | None = None

    @classmethod
    def of_game(cls, game: str, base: FilePath) -> "Draft":
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
        """The content of the file; empty while it is no TOML."""
        try:
            return toml_of(self.text)
        except tomllib.TOMLDecodeError:
            return {}

    @property
    def game(self) -> str:
        """The name of the game; empty if there is none."""
        return self.shown(("game",))

    @cached_property
    def players(self) -> tuple[Entry, ...]:
        """The players, in the order of the file."""
        return tuple(_entry(table) for table in self._tables)

    @property
    def _tables(self) -> Sequence[Mapping[str, Any]]:
        tables = self.data.get("players")
        return [table for table in tables if isinstance(table, dict)] if isinstance(tables, list) else []

    def value(self, path: Path) -> Any:
        """The value of a field; None where the file has none."""
        found: Any = self.data
        for part in path:
            try:
                found = found[part]
            except (LookupError, TypeError):
                return None
        return found

    def shown(self, path: Path) -> str:
        """The text of a field, as a person types it; empty where the file has none."""
        return shown(self.value(path))

    def default(self, path: Path) -> str:
        """Return the value that holds where the file has no such field; empty if the game decides."""
        match path:
            case ("players", int(player), "strategy"):
                game = game_of(self.game)
                role = game.role(self.shown(("players", player, "role")))
                follows = role is not None and game.follows_team(role.name)
                team = self.shown(("teams", role.team, "strategy")) if role is not None and follows else ""
                return team or _default_strategy(self.game, "" if role is None else role.name)
            case ("players", _, str(name)):
                return COLUMNS.get(name, "")
        return SETTINGS.get(str(path[0]), "") if len(path) == 1 else ""

    def set(self, path: Path, typed: str) -> "Draft":
        """Return the draft with what was typed in a field. An empty text takes a field out that may be missing.

        What should be a number and is none is kept as it was typed, so that the check of the file can tell of it.

        Raises:
            ValueError: the field belongs to a player that is no table, or the file is no TOML.
        """
        typed = typed.strip()
        if typed == self.shown(path):
            return self
        if not typed and (path[0] == "rules" or path[-1] not in _NEEDED):
            return replace(self, text=without(self.text, path))
        value = _value(path, typed)
        if path[0] == "rules":
            while len(path) > 1 and not isinstance(self.value(path[:-1]), dict):
                path, value = path[:-1], {str(path[-1]): value}
        return replace(self, text=with_value(self.text, path, value))

    def place(self, player: int, pose: Pose) -> "Draft":
        """Return the draft with a player's robot at a pose, to the centimetre and a tenth of a degree."""
        draft = self
        for name, value in _numbers(pose).items():
            path = ("players", player, name)
            if draft.shown(path) != shown(value):
                draft = replace(draft, text=with_value(draft.text, path, value))
        return draft

    def add(self, entry: Entry) -> "Draft":
        """Return the draft with one more player, the last one."""
        item: dict[str, TomlValue] = {"name": entry.name, "role": entry.role}
        for name in ("model", "backend", "strategy"):
            value = getattr(entry, name)
            if value and value != COLUMNS[name]:
                item[name] = value
        return replace(self, text=with_item(self.text, "players", item | _numbers(entry.pose or Pose(0.0, 0.0, 0.0))))

    def remove(self, players: Collection[int]) -> "Draft":
        """Return the draft without some players."""
        text = self.text
        for player in sorted(players, reverse=True):
            text = without(text, ("players", player))
        return replace(self, text=text)

    def named(self, name: str, file: FilePath) -> "Draft":
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
    words = {name: shown(table.get(name)) for name in ("name", "role", "model", "backend", "strategy")}
    return Entry(**words, pose=Pose(float(x), float(y), math.radians(heading)) if known else None)  # type: ignore[arg-type]


def shown(value: Any, *, inner: bool = False) -> str:
    """A value as a person types it: a text of its own without quotes, anything else as in TOML.

    Args:
        inner: the value is a part of another one.
    """
    match value:
        case None:
            return ""
        case bool():
            return str(value).lower()
        case float():
            return f"{value:.10g}"
        case list() | tuple():
            return f"[{', '.join(shown(one, inner=True) for one in value)}]"
        case dict():
            return f"{{ {', '.join(f'{key} = {shown(one, inner=True)}' for key, one in value.items())} }}"
    return quoted(value) if inner and isinstance(value, str) else str(value)


def _value(path: Path, typed: str) -> TomlValue:
    """Return the TOML value of typed text: a string where one is expected, and where it is nothing else."""
    if path[0] != "rules" and path[-1] in _WORDS:
        return typed
    try:
        value: TomlValue = tomllib.loads(f"value = {typed}")["value"]
    except (tomllib.TOMLDecodeError, KeyError):
        return typed
    return float(value) if path[-1] in POSE and isinstance(value, int) else value


def _numbers(pose: Pose) -> dict[str, TomlValue]:
    """The fields of a pose."""
    heading = math.degrees(math.remainder(pose.theta, math.tau))
    return {"x": round(pose.x, 2) + 0.0, "y": round(pose.y, 2) + 0.0, "heading": round(heading, 1) + 0.0}


def _default_strategy(name: str, role: str) -> str:
    """The strategy of a player in a role if the match file names none, as a file would name it; empty if unknown."""
    game = GAMES.find(name)
    if game is None or game.role(role) is None:
        return ""
    target = game.strategy_of(role)
    kinds = {strategy: STRATEGIES.find(strategy) for strategy in strategies_of(name)}
    made = (strategy for strategy, kind in kinds.items() if kind and f"{kind.__module__}:{kind.__name__}" == target)
    return next(made, target)
