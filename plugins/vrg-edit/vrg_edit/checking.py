"""The check of a match that is being changed, by the rules of `vrg check`: its faults, and the ground it is played on.

Strategies that are files or modules are imported once everything else is good.
"""

from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Zone
from vrg.config.code_files import imported, readable_parts
from vrg.config.loading import check_match, check_strategies
from vrg.config.rules import rulebook_of
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError, Path, Problem
from vrg.games import has_name
from vrg.hal.sim.map import load_map
from vrg.playing.trial import trial
from vrg.regions import Region
from vrg.toml_text import without
from vrg_edit.draft import Draft

UNSAVED: Final = "match.toml"
"""The name in messages of a file that has none yet."""


@dataclass(frozen=True)
class CheckResult:
    """The result of a draft's check.

    Args:
        problems: what is wrong, in the order of the file.
        zones: of the rules. obstacles: the ground that walls and obstacles of the map cover.
        bounds: the part of the plane in which robots may be placed; None while there is no map.
    """

    problems: tuple[Problem, ...] = ()
    zones: tuple[Zone, ...] = ()
    obstacles: tuple[Region, ...] = ()
    bounds: Region | None = None

    def of(self, path: Path) -> tuple[Problem, ...]:
        """The problems of a field. Those of a player as a whole are of the fields of its place."""
        return tuple(problem for problem in self.problems if path in fields_of(problem))


class DraftCheck:
    """Checks drafts. It remembers what it has imported, and where the zones were while all was good.

    Args:
        imports: False imports no strategies.
    """

    def __init__(self, *, imports: bool = True) -> None:
        self._imports = imports
        self._imported: tuple[object, tuple[Problem, ...]] = (None, ())
        self._ground: tuple[object, CheckResult] = (None, CheckResult())

    def __call__(self, draft: Draft) -> CheckResult:
        """Return the faults of a draft, and the ground that it is played on."""
        path = draft.file or draft.base / UNSAVED
        try:
            setup = check_match(draft.text, path, draft.base)
        except ConfigError as error:
            return self._with_ground(draft, tuple(error.problems), None)
        return self._with_ground(draft, self._import_problems(setup, draft), setup)

    def _with_ground(self, draft: Draft, problems: tuple[Problem, ...], setup: CheckedMatch | None) -> CheckResult:
        key = (draft.game, draft.shown(("map",)), draft.data.get("rules"))
        if setup is None and self._ground[0] != key:
            setup = _good_part(draft, problems)
        if setup is not None or self._ground[0] != key:
            self._ground = key, _ground(draft, setup)
        ground = self._ground[1]
        return CheckResult(problems, ground.zones, ground.obstacles, ground.bounds)

    def _import_problems(self, setup: CheckedMatch, draft: Draft) -> tuple[Problem, ...]:
        """The faults of the strategies that are files or modules."""
        players = [player for player in setup.players if not has_name(player.strategy)]
        own = {(player.number, player.strategy) for player in players}
        codes = {setup.strategy_file(player.name) for player in players}
        needed = {part for code in codes if code for path in (code, *imported(code)) for part in readable_parts(path)}
        stats = {file: file.stat() for file in needed if file.is_file()}
        key = (own, setup.base, {(file, stat.st_mtime_ns, stat.st_size) for file, stat in stats.items()})
        if not self._imports or all(strategy.startswith("vrg.") for _, strategy in own):
            return ()
        if self._imported[0] != key:
            self._imported = key, _imported(setup)
        return self._imported[1]


def _imported(setup: CheckedMatch) -> tuple[Problem, ...]:
    """Import the strategies of a match in sealed processes, and return what is wrong with them."""
    try:
        with trial() as tried:
            check_strategies(setup, tried.make)
    except ConfigError as error:
        return tuple(error.problems)
    return ()


def _good_part(draft: Draft, problems: tuple[Problem, ...]) -> CheckedMatch | None:
    """The set-up of the match without the players that have problems, which has the zones; or None."""
    bad = sorted({p.path[1] for p in problems if p.path[:1] == ("players",) and len(p.path) > 1}, reverse=True)
    try:
        text = draft.text
        for number in bad:
            text = without(text, ("players", number))
        return check_match(text, draft.base / UNSAVED, draft.base)
    except ValueError:
        return None


def _ground(draft: Draft, setup: CheckedMatch | None) -> CheckResult:
    """The zones, the obstacles and the bounds, as far as they are known."""
    name = draft.shown(("map",))
    try:
        map_ = load_map(draft.base / name if "/" in name or name.endswith(".toml") else name)
    except ConfigError:
        return CheckResult()
    book = None if setup is None else rulebook_of(setup)
    zones = () if book is None else tuple(book.zones(book.initial()))
    return CheckResult((), zones, map_.obstacles, map_.bounds)


def fields_of(problem: Problem) -> tuple[Path, ...]:
    """The fields beside which a problem is shown, that to go to first; none for the whole file."""
    match problem.path:
        case ("players", int(player)):
            return ("players", player, "x"), ("players", player, "y")
        case ("players", int(_), _, *_):
            return (problem.path[:3],)
        case ("rules", _, *_):
            return tuple(problem.path[:end] for end in range(len(problem.path), 1, -1))
        case (_, *_):
            return (problem.path[:1],)
    return ()


def problem_text(problem: Problem, draft: Draft) -> str:
    """A problem in words, with the name of the field and of the player that it is about."""
    parts = [str(part) for part in problem.path]
    match problem.path:
        case ("players", int(player), *rest) if player < len(draft.players):
            parts = [draft.players[player].name or str(player + 1), *map(str, rest)]
            if problem.text.startswith(parts[0]) and not rest:
                parts = []
    return f"{' '.join(parts)}: {problem.text}" if parts else problem.text
