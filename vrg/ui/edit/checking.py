"""The faults of a draft, and the ground that it is played on. The check itself is given from outside."""

from collections.abc import Callable
from dataclasses import dataclass

from vrg.bus.messages import Zone
from vrg.errors import Path, Problem
from vrg.regions import Region
from vrg.ui.edit.draft import Draft


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


Check = Callable[[Draft], CheckResult]
"""Checks a draft by the rules of `vrg check`."""


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
