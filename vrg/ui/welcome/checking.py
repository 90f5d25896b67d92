"""What is wrong with a draft, and the ground that it is played on. The check itself is given from outside."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Zone
from vrg.errors import Problem
from vrg.regions import Region
from vrg.ui.welcome.draft import Draft

PAUSE: Final = 0.15
"""The real time in s without an edit after which a draft is checked."""


@dataclass(frozen=True)
class Verdict:
    """What the check of a draft has found.

    Args:
        problems: what is wrong, in the order of the file.
        zones: of the rules. obstacles: the ground that walls and obstacles of the map cover.
        bounds: the part of the plane in which robots may be placed; None while there is no map.
    """

    problems: tuple[Problem, ...] = ()
    zones: tuple[Zone, ...] = ()
    obstacles: tuple[Region, ...] = ()
    bounds: Region | None = None

    def of(self, player: int | None, field: str) -> tuple[Problem, ...]:
        """The problems of a field. Those of a player as a whole are of the fields of its pose.

        Args:
            player: its number; None for a field of the match.
        """
        if player is None:
            return tuple(
                p for p in self.problems if p.path[:1] == (field,) and (field != "players" or len(p.path) == 1)
            )
        whole = field in ("x", "y")
        return tuple(
            p
            for p in self.problems
            if p.path[:2] == ("players", player) and (p.path[2:3] == (field,) or (whole and len(p.path) == 2))
        )

    def of_player(self, player: int) -> tuple[Problem, ...]:
        """The problems of a player."""
        return tuple(p for p in self.problems if p.path[:2] == ("players", player))


Check = Callable[[Draft], Verdict]
"""Checks a draft by the rules of `vrg check`."""


class Checker:
    """Checks the newest draft beside the window, once its edits pause.

    Args:
        check: what checks a draft. executor: runs it, one at a time.
    """

    def __init__(self, check: Check, executor: Executor) -> None:
        self._check = check
        self._executor = executor
        self._wanted: Draft | None = None
        self._since = 0.0
        self._running: tuple[Draft, Future[Verdict]] | None = None
        self._done: Draft | None = None

    @property
    def busy(self) -> bool:
        """Whether a verdict on the newest draft is still to come."""
        return self._wanted is not None and self._wanted is not self._done

    def look(self, draft: Draft, now: float) -> tuple[Draft, Verdict] | None:
        """Take in the present draft; return a verdict that has come since, with the draft that it is on.

        Args:
            now: the real time, s, from any beginning.
        """
        if draft is not self._wanted:
            self._wanted, self._since = draft, now
        found = None
        if self._running is not None and self._running[1].done():
            self._done, future = self._running
            self._running = None
            found = self._done, _result(future)
        due = draft is not self._done and (self._done is None or now - self._since >= PAUSE)
        if self._running is None and due:
            self._running = draft, self._executor.submit(self._check, draft)
        return found


def _result(future: Future[Verdict]) -> Verdict:
    """What the check has found. Games of other packages are checked too, and their mistakes must not end the window."""
    try:
        return future.result()
    except Exception as error:
        return Verdict((Problem(f"the check itself has failed: {error!r}"),))
