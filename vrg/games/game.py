"""What a game is: the one object that everybody asks who has to do with more than its rules.

It is light. The rules, the settings and the player are named by `module:attribute` and imported by the process that
needs them: a window needs none of the three.
"""

import enum
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrg.colours import BLUE, GREEN, GREY, PURPLE, YELLOW, Rgb
from vrg.registry import load_object

if TYPE_CHECKING:
    from vrg.coordinator.rulebook import RuleBook
    from vrg.tables import Table


class Marker(enum.Enum):
    """The sign on a robot's back. Every role differs in colour and sign, so that no meaning hangs on colour alone."""

    TRIANGLE = "triangle"
    CIRCLE = "circle"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "cross"


@dataclass(frozen=True)
class Role:
    """One role that a player may have.

    Args:
        name: the game's word, such as `shark`. team: of the players that begin in this role.
        colour, marker: how it is shown.
    """

    name: str
    team: str
    colour: Rgb
    marker: Marker


@dataclass(frozen=True)
class Style:
    """How a player is drawn."""

    colour: Rgb
    marker: Marker


@dataclass(frozen=True)
class Moment:
    """A rule whose calls are marked in plots.

    Args:
        sign: matplotlib's marker. word: for the legend.
    """

    sign: str
    word: str


@dataclass(frozen=True, kw_only=True)
class Game:
    """See the module.

    Args:
        name: as match files write it, such as `sharks-and-minnows`.
        settings: `module:Class` of the [rules] table of a match file, a `vrg.tables.Table`.
        rules: `module:Class` of the rule book, constructed from the settings and the contestants.
        strategy: `module:Class` of the player that plays where a match file names no other.
        match: the default match file: `package/file.toml`, as the package carries it.
        roles: what a player may be. In a match file, `role` is one of those that `starts` names.
        starts: the roles that a player may begin in; all of them if it is empty.
        round_word: what a round is called.
        score_words: what the points of a team count, by team.
        out_of_play: states in which a player is only an obstacle.
        moments: the rules whose calls are marked in plots.
    """

    name: str
    settings: str
    rules: str
    strategy: str
    match: str
    roles: tuple[Role, ...]
    starts: tuple[str, ...] = ()
    round_word: str = "round"
    score_words: Mapping[str, str] = field(default_factory=dict)
    out_of_play: frozenset[str] = frozenset()
    moments: Mapping[str, Moment] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Its name as people write it: `Sharks and Minnows`."""
        return title(self.name)

    @property
    def start_roles(self) -> tuple[str, ...]:
        """The names of the roles that a player may begin in."""
        return self.starts or tuple(role.name for role in self.roles)

    def role(self, name: str) -> Role | None:
        """The role of this name, or None."""
        return next((role for role in self.roles if role.name == name), None)

    def style(self, role: str, state: str = "") -> Style:
        """How a player is drawn: grey and crossed out of play; a role that is not the game's gets a colour by its name."""
        if state in self.out_of_play:
            return Style(GREY, Marker.CROSS)
        known = self.role(role)
        if known is not None:
            return Style(known.colour, known.marker)
        rest = (GREEN, YELLOW, BLUE, PURPLE)
        return Style(rest[zlib.crc32(role.encode()) % len(rest)], Marker.SQUARE)

    def team_style(self, team: str) -> Style:
        """How a team is drawn: as the first role of its players; a team keeps it when its players change roles."""
        first = next((role.name for role in self.roles if role.team == team), team)
        return self.style(first)

    def load_settings(self) -> "type[Table]":
        """The class of the [rules] table, imported now."""
        found: type[Table] = load_object(self.settings)
        return found

    def load_rules(self) -> "type[RuleBook[Any]]":
        """The class of the rule book, imported now."""
        found: type[RuleBook[Any]] = load_object(self.rules)
        return found

    def default_match(self) -> Path:
        """The path of the default match file."""
        package, _, file = self.match.rpartition("/")
        return Path(str(files(package) / file))


def title(word: str) -> str:
    """A name such as `sharks-and-minnows` as people write it: `Sharks and Minnows`."""
    words = word.replace("-", " ").replace("_", " ").split()
    small = {"and", "of", "the"}
    return " ".join(w if w in small and i else w[:1].upper() + w[1:] for i, w in enumerate(words))
