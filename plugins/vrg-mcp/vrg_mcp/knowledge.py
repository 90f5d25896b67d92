"""What an agent must know before it writes a player, in words from the code itself: games, their rules, the view."""

import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from vrg.agents.strategy import Action, Strategy, View
from vrg.bus.messages import FieldObject, PlayerStatus, RefereeState, Zone
from vrg.config.loading import read_match
from vrg.errors import ConfigError
from vrg.games import GAMES, game_of, strategies_of
from vrg.regions import Rectangle
from vrg.registry import load_object
from vrg.templates import filled
from vrg.types import Pose, Twist

_SHOWN: Final[tuple[type, ...]] = (Strategy, View, PlayerStatus, RefereeState, Zone, FieldObject, Pose, Twist, Action)
_HELPERS: Final = (
    "vrg.navigation.control:linearise", "vrg.navigation.control:go_to", "vrg.navigation.control:scaled",
    "vrg.navigation.avoidance:steer", "vrg.navigation.avoidance:Obstacle", "vrg.agents.interception:intercept",
    "vrg.geometry:wrap",
)  # fmt: skip


@dataclass(frozen=True)
class Match:
    """A match that may be played.

    Args:
        path: of its file. game: its game. named: True if a person has named the file on the command line.
    """

    path: Path
    game: str
    named: bool = False


def matches(named: Sequence[Path]) -> dict[str, Match]:
    """The matches by name: those that games ship, under the game's name, and those of files that a person has named.

    Raises:
        ConfigError: a file cannot be read, or two have one name.
    """
    found: dict[str, Match] = {}
    for name in GAMES.names():
        game = GAMES.find(name)
        if game is None or not game.competitive:
            continue
        path = game.default_match()
        more = sorted(file for file in path.parent.glob("*.toml") if file != path)
        found |= {name: Match(path, name)} | {f"{name}-{file.stem}": Match(file, name) for file in more}
    for file in named:
        if file.stem in found:
            raise ConfigError(f"--match {file}: expected a file of another name, {file.stem} is taken")
        found[file.stem] = Match(file.resolve(), read_match(file).game, named=True)
    return found


def teams_of(match: Match) -> list[str]:
    """The teams of the game of a match."""
    return list(dict.fromkeys(role.team for role in game_of(match.game).roles))


def games(there: Mapping[str, Match]) -> list[dict[str, Any]]:
    """The games of the matches that may be played, with their teams and strategies."""
    found = []
    for name in dict.fromkeys(match.game for match in there.values()):
        game = game_of(name)
        teams = {role.team: [r.name for r in game.roles if r.team == role.team] for role in game.roles}
        found.append({
            "game": name, "about": game.about, "teams_and_first_roles": teams,
            "built_in_strategies": strategies_of(name),
            "matches": [match for match, of in there.items() if of.game == name],
        })  # fmt: skip
    return found


def rules(match: Match) -> dict[str, Any]:
    """The rules of a game as its referee has them, the fields of its settings, and the values in a match.

    Raises:
        ConfigError: the match cannot be read.
    """
    game, file = game_of(match.game), read_match(match.path)
    built_in = {role.name: game.strategy_of(role.name) for role in game.roles}
    players = [[p.name, p.role, p.x, p.y, p.heading] for p in file.players]
    values = load_object(game.settings).model_validate(dict(file.rules)).model_dump(mode="json")
    return {
        "about": game.about, "rules": {name: rule.words for name, rule in game.rule_texts.items()},
        "settings": _doc(load_object(game.settings)), "values_in_this_match": values, "map": file.map,
        "players_name_role_x_y_heading_degrees": players, "to_build_upon": built_in,
    }  # fmt: skip


def view() -> str:
    """The classes that a player sees and returns, with the properties and methods that it needs."""
    parts = ["from vrg.agents import STILL, Action, Pose, Sighting, Strategy, Stroke, Twist, View", text("units")]
    parts += [f"class {kind.__name__}\n{_doc(kind)}" for kind in _SHOWN]
    parts += [_member("View", getattr(View, name), name) for name in ("position", "speed", "others", "zone")]
    names = ("contains", "nearest", "shrunk", "middle", "bounds", "distance")
    parts += [_member("region", getattr(Rectangle, name), name) for name in names]
    return "\n\n".join(parts)


def helpers() -> str:
    """Functions to build with, with their signatures."""
    return "\n\n".join(_helper(target) for target in _HELPERS)


def text(name: str) -> str:
    """A text of this package."""
    return files(__package__).joinpath(f"{name}.txt").read_text(encoding="utf-8")


TOPICS: Final[Mapping[str, Callable[[], str]]] = {
    "view": view, "first": partial(text, "first.py"), "helpers": helpers,
    "example": partial(filled, "player.py.template", class_name="Mine"),
}  # fmt: skip
"""What can be read, by topic."""


def _helper(target: str) -> str:
    module, _, name = target.partition(":")
    found = getattr(importlib.import_module(module), name)
    return f"from {module} import {name}\n{name}{inspect.signature(found)}\n{_doc(found)}"


def _member(of: str, found: object, name: str) -> str:
    """A property, or a method with its arguments, and what it is."""
    called = str(inspect.signature(found)).replace("(self, ", "(").replace("(self)", "()") if callable(found) else ""
    return f"{of}.{name}{called}: {_first(found)}"


def _doc(found: object) -> str:
    return inspect.cleandoc(getattr(found, "__doc__", None) or "")


def _first(found: object) -> str:
    return _doc(found).partition("\n")[0]
