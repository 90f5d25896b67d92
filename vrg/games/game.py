"""The description of a game: all that the other parts of VRG need to know about it.

Importing it is cheap. The rules, the settings and the player are named by `module:attribute`, and only a process that
needs them imports them. A window needs none of the three.
"""

import enum
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrg.bus.messages import DISQUALIFIED
from vrg.colours import BLUE, GREEN, PURPLE, YELLOW, Rgb, dulled
from vrg.registry import load_object

if TYPE_CHECKING:
    from vrg.coordinator.proof import Prover
    from vrg.coordinator.rulebook import RuleBook
    from vrg.tables import Table


class Marker(enum.Enum):
    """The sign that is drawn on a robot. Roles should differ in sign too, so that spectators need no colours."""

    TRIANGLE = "triangle"
    CIRCLE = "circle"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "cross"


@dataclass(frozen=True)
class Role:
    """One role that a player may have.

    Args:
        name: the game's word for it, such as `shark`. team: the team of the players that begin in this role.
        colour, marker: how a player in this role is drawn.
        strategy: `module:Class` of the strategy that a player in this role has if the match file names no other; empty
            for that of the game. A player in a further role of its team that has one does not follow its team's.
    """

    name: str
    team: str
    colour: Rgb
    marker: Marker
    strategy: str = ""


@dataclass(frozen=True)
class ThingStyle:
    """The look of things of a kind that belong to no team.

    Args:
        colour: theirs. height: how high they stand in three dimensions, m.
    """

    colour: Rgb
    height: float = 0.3


@dataclass(frozen=True)
class Shown:
    """How windows write a number that the rules publish.

    Args:
        words: around the number, with a place for it as `str.format` has them, such as `best run {:.2f} s`.
        since: the number is a time of play, s, and what is shown is the time since then.

    Raises:
        ValueError, IndexError, KeyError: there is no place for a number in the words.
    """

    words: str
    since: bool = False

    def __post_init__(self) -> None:
        self.text(0.0, 0.0)

    def text(self, number: float, clock: float) -> str:
        """The words of a number at a time of play, s."""
        return self.words.format(max(0.0, clock - number) if self.since else number)


@dataclass(frozen=True)
class Style:
    """The colour and the sign by which a player is drawn."""

    colour: Rgb
    marker: Marker


@dataclass(frozen=True)
class Moment:
    """The mark of a rule's calls at the place where they happened.

    Args:
        sign: matplotlib's marker in a plot. word: the word in its legend, and in a window.
        others: what the other players of the call have to do with the first one, in a word such as `by`.
        thought: a plot also shows what the first player of the call sketched at that moment.
        counts: it is by these calls that a team comes nearer to winning.
    """

    sign: str
    word: str
    others: str = "with"
    thought: bool = False
    counts: bool = False


@dataclass(frozen=True)
class Priority:
    """Something that a person who commands a team can want the team to do, as long as the person wants it.

    Args:
        name: its name in messages, such as `hail-mary`. title: its name as people read it. meaning: what a team does.
    """

    name: str
    title: str
    meaning: str


@dataclass(frozen=True)
class RuleText:
    """A rule as people read it.

    Args:
        words: its text. source: where it is written, such as `thesis 4.3`; empty for a rule of VRG's own.
    """

    words: str
    source: str = ""


COMMON_RULES: Mapping[str, RuleText] = {
    "begin": RuleText("A round begins when everybody stands on its mark and reports.", "thesis, Algorithm 3.1"),
    "halt": RuleText("Play is halted by an official, an emergency stop, or a fault outside the game.", "thesis 3.2"),
    "resume": RuleText("An official continues play once nothing stands against it.", "thesis 3.2"),
    "ended": RuleText("An official may end the game.", "thesis 3.2"),
    "overruled": RuleText("An official may set a score, a role or a state.", "thesis 3.2"),
    "refused": RuleText("What cannot be done now is refused, with the reason."),
    "recover": RuleText("An official asks robots to clear the faults that they have latched."),
    "place": RuleText("An official puts a virtual robot somewhere, or says where a physical one stands."),
    "placed": RuleText("Virtual robots that are late for the round are put on their marks."),
    "late": RuleText("A physical robot that is late for the round must be carried to its mark."),
    "game_over": RuleText("The game ends when the rules of the game say so.", "thesis, Algorithm 3.1"),
    DISQUALIFIED: RuleText("A player whose program fails is out, and its robot stands as an obstacle."),
    "reinstated": RuleText("A player that was out and reports again plays from the next round."),
}
"""The rules that every game has, by the names of their calls."""


@dataclass(frozen=True, kw_only=True)
class Game:
    """The description of one game.

    Args:
        name: the game's name in match files, such as `sharks-and-minnows`.
        settings: `module:Class` of the [rules] table of a match file, a `vrg.tables.Table`.
        rules: `module:Class` of the rule book, which is constructed from the settings and the contestants.
        strategy: `module:Class` of the strategy that a player has if the match file names no other.
        match: the default match file, as `package/file.toml`.
        roles: the roles that a player may have during the match.
        starts: the names of the roles that a player may begin in; all of them if it is empty.
        round_word: the game's word for a round.
        score_words: what the points of a team count, by team, with `{s}` where it is not 1, as in `flag{s} captured`.
        won_words: why a team has won, by team, where the score does not decide.
        decisive: the role of which players must be left, where the score does not decide; empty where it does.
        out_of_play: the states in which a player is only an obstacle.
        expected: what may happen at any time while players are in a state and none of their team moves, by state.
        moments: how calls are marked in plots and windows, by rule.
        label: the game's name as people write it; made from `name` if it is empty.
        priorities: what a person who commands a team can order, at most four: one for each face button of a gamepad.
        competitive: False if there is no winner, so that its end is only announced as the end.
        rule_texts: the rules as people read them, by the names of their calls.
        things: the look of things that are no robots, by kind, such as a ball.
        numbers: which of the published numbers windows show, by name.
        plans: True if windows show from the start what players sketch, because it tells what they know of the field.
        window: the kind (`vrg.kinds`) of the window that `vrg play` opens; one of a player or a team is of the first.
        about: what happens in the game, in a sentence for a person who chooses one.
        prover: `module:function`, a `vrg.coordinator.proof.Prover`; empty if the game computes no numbers.
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
    won_words: Mapping[str, str] = field(default_factory=dict)
    decisive: str = ""
    out_of_play: frozenset[str] = frozenset()
    expected: Mapping[str, str] = field(default_factory=dict)
    moments: Mapping[str, Moment] = field(default_factory=dict)
    label: str = ""
    priorities: tuple[Priority, ...] = ()
    competitive: bool = True
    rule_texts: Mapping[str, RuleText] = field(default_factory=dict)
    prover: str = ""
    things: Mapping[str, ThingStyle] = field(default_factory=dict)
    numbers: Mapping[str, Shown] = field(default_factory=dict)
    plans: bool = False
    window: str = "spectator"
    about: str = ""

    @property
    def title(self) -> str:
        """The game's name as people write it, such as `Sharks and Minnows`."""
        return self.label or title(self.name)

    @property
    def start_roles(self) -> tuple[str, ...]:
        """The names of the roles that a player may begin in."""
        return self.starts or tuple(role.name for role in self.roles)

    @property
    def marked(self) -> Mapping[str, Moment]:
        """The marks of calls, by rule: the game's own, and those that every game has."""
        return {DISQUALIFIED: Moment("P", "disqualified"), **self.moments}

    def rule_text(self, rule: str) -> RuleText | None:
        """The rule of a call as people read it: the game's own, or one that every game has; None if there is none."""
        return self.rule_texts.get(rule) or COMMON_RULES.get(rule)

    def role(self, name: str) -> Role | None:
        """The role of this name, or None if there is none."""
        return next((role for role in self.roles if role.name == name), None)

    def strategy_of(self, role: str) -> str:
        """`module:Class` of the strategy that a player in a role has if the match file names no other."""
        known = self.role(role)
        return (known.strategy if known is not None else "") or self.strategy

    def follows_team(self, role: str) -> bool:
        """True if a player in a role plays by the strategy of its team: those of the team's first role do, and all
        whose role has no strategy of its own."""
        known = self.role(role)
        return known is None or not known.strategy or known is next(r for r in self.roles if r.team == known.team)

    def is_out(self, state: str) -> bool:
        """True if a player in this state is only an obstacle."""
        return state in self.out_of_play or state == DISQUALIFIED

    def remark(self, state: str) -> str:
        """The word that tells a robot out of play from others that are; empty where all are so for the same reason."""
        return state if state in self.out_of_play and len(self.out_of_play) > 1 else ""

    def style(self, role: str, state: str = "") -> Style:
        """The style of a player. Out of play it is a cross in a dull colour; an unknown role has one by its name."""
        known, rest = self.role(role), (GREEN, YELLOW, BLUE, PURPLE)
        if known is not None:
            own = Style(known.colour, known.marker)
        else:
            own = Style(rest[zlib.crc32(role.encode()) % len(rest)], Marker.SQUARE)
        return Style(dulled(own.colour), Marker.CROSS) if self.is_out(state) else own

    def team_style(self, team: str) -> Style:
        """The style of a team: that of its first role, also when its players have changed roles."""
        first = next((role.name for role in self.roles if role.team == team), team)
        return self.style(first)

    def thing_style(self, kind: str, team: str = "") -> ThingStyle:
        """The style of a thing: its team's colour, or that of its kind."""
        style = self.things.get(kind, ThingStyle(YELLOW))
        return ThingStyle(self.team_style(team).colour, style.height) if team else style

    def counted(self, team: str, points: int = 0) -> str:
        """The words for what this many points of a team count, without their number; empty if there are none."""
        return self.score_words.get(team, "").replace("{s}", "" if points == 1 else "s")

    def load_settings(self) -> "type[Table]":
        """Import and return the class of the [rules] table."""
        found: type[Table] = load_object(self.settings)
        return found

    def load_rules(self) -> "type[RuleBook[Any]]":
        """Import and return the class of the rule book."""
        found: type[RuleBook[Any]] = load_object(self.rules)
        return found

    def load_prover(self) -> "Prover | None":
        """Import and return the function that explains calls; None if the game has no such function."""
        found: Prover | None = load_object(self.prover) if self.prover else None
        return found

    def default_match(self) -> Path:
        """The path of the default match file."""
        package, _, file = self.match.rpartition("/")
        return Path(str(files(package) / file))


def capitalised(text: str) -> str:
    """Return the text with a large first letter."""
    return text[:1].upper() + text[1:]


def title(word: str) -> str:
    """Return a name such as `sharks-and-minnows` as people write it: `Sharks and Minnows`."""
    words = word.replace("-", " ").replace("_", " ").split()
    small = {"and", "of", "the"}
    return " ".join(w if w in small and i else capitalised(w) for i, w in enumerate(words))
