"""The field of an event: it plays one match after the other by `vrg play`, each in its own process."""

import asyncio
import functools
import hashlib
import hmac
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Final

import msgspec
from aiohttp import ClientSession

from vrg.api import played_by
from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch
from vrg.coordinator.journal import read_journal
from vrg.errors import ConfigError, VrgError
from vrg.files import read_text, write_whole
from vrg.launch.endpoints import free_port
from vrg.playing.by_command import started
from vrg.playing.run import Run
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder
from vrg.ui.web.admission import Admission
from vrg_class.event.course import PLAYED, Live, Report
from vrg_class.event.outcomes import Match
from vrg_class.event.plan import Game
from vrg_class.event.timetable import Timetable
from vrg_class.event.watching import LOOPBACK, watch
from vrg_class.tries import teams_of

PORT: Final = 18470
"""The port of the page of a match on loopback, or one of the next ones; systems give none of these away."""
_LOOKED: Final = 0.05
"""The real time in s between two looks at whether a match has ended."""
_KILLED: Final = 45.0
"""The real time in s after which a match that is to be broken off is killed."""


class Field:
    """Plays one match of an event after the other.

    Args:
        base: the folder from which the timetable names files. folder: for what is written.
        official: the token of the officials. options: of `vrg play`. paged: False serves no page of a match.

    Attributes:
        page: that of the match on the field, on loopback; None if there is none.
    """

    def __init__(self, base: Path, folder: Path, official: str, options: Sequence[str], *, paged: bool) -> None:
        self._base, self._folder, self._official = base, folder, official
        self._options, self._paged = [*options], paged
        self.page: Admission | None = None

    def setup(self, match: str, strategies: Mapping[str, str], seed: int | None = None) -> CheckedMatch:
        """A match with its strategies.

        Raises:
            ConfigError: it cannot be played.
        """
        beside = self._base / match
        setup = load_match(beside if beside.is_file() else match_path(match), seed=seed)
        return played_by(setup, {name: self._target(strategy) for name, strategy in strategies.items()})

    def _target(self, strategy: str) -> str:
        """A strategy as a match file anywhere may have it."""
        name, colon, what = strategy.partition(":")
        file = self._base / name
        return f"{file.resolve()}{colon}{what}" if file.is_file() else strategy

    def games(self, table: Timetable) -> list[Game]:
        """What each entry of a timetable is about. All of it can be played: a mistake is found before the guests come.

        Raises:
            ConfigError: a match or a strategy cannot be used.
        """
        found = []
        for number, entry in enumerate(table.matches, 1):
            try:
                setup = self.setup(entry.match, entry.strategies, entry.seed)
                sides = tuple(teams_of(setup))
                if entry.kind != "match":
                    if len(sides) != 2:
                        raise ConfigError(f"expected a match of two teams, got {', '.join(sides)}")
                    for team in table.teams:
                        self.setup(entry.match, dict.fromkeys(sides, team.strategy))
                roles = [Counter(player.role for player in setup.players if player.team == team) for team in sides]
                found.append(Game(sides, 1 if all(one == roles[0] for one in roles) else 2))
            except ConfigError as error:
                raise ConfigError(f"entry {number} of the timetable, {entry.title or entry.match}: {error}") from None
        return found

    def check_options(self, table: Timetable) -> None:
        """Make sure that `vrg play` takes the options; it says itself what is wrong.

        Raises:
            ConfigError: it does not.
        """
        if table.options:
            entry = table.matches[0]
            file = self._folder / "options.toml"
            write_whole(file, self.setup(entry.match, entry.strategies, entry.seed).text.encode())
            command = ["play", str(file), "--dry-run", *self._options]
            with started(command, stdout=subprocess.DEVNULL) as process:
                status = process.wait()
            file.unlink()
            if status != 0:
                raise ConfigError(f"options: `vrg play {' '.join(table.options)}` is refused for the reason above")

    async def play(
        self, match: Match, session: ClientSession, hear: Callable[[Live | None], None], stopping: Callable[[], bool]
    ) -> Report:
        """Play a match to its end.

        Args:
            hear: is told what is known of it. stopping: tells that it is to be broken off.
        """
        watching: asyncio.Task[None] | None = None
        try:
            file, page = await asyncio.to_thread(self._prepare, match)
            runs = file.parent / "runs"
            shown = [] if page is None else ["--page", str(self._page_file)]
            command = ["play", str(file), "--runs", str(runs), *shown, *self._options]
            errors = file.parent / "errors.txt"
            with errors.open("wb") as said:
                process = await asyncio.to_thread(functools.partial(started, command, stderr=said))
            self.page = page
            if page is not None:
                watching = asyncio.create_task(watch(session, page, hear))
            stopped = 0.0
            while process.poll() is None:
                if stopping() and not stopped:
                    stopped = time.monotonic()
                    process.send_signal(signal.SIGINT)
                elif stopped and time.monotonic() - stopped > _KILLED:
                    process.kill()
                await asyncio.sleep(_LOOKED)
            if process.stdin is not None:
                process.stdin.close()
            report = await asyncio.to_thread(report_of, self._folder, next(iter(runs.glob("*")), None))
            told = _last(read_text(errors)) if report.why and not report.words else ""
            return msgspec.structs.replace(report, words=told) if told else report
        except (OSError, VrgError) as error:
            return Report(why="not_played", words=str(error))
        finally:
            self.page = None
            if watching is not None:
                watching.cancel()
                with suppress(asyncio.CancelledError):
                    await watching

    def _prepare(self, match: Match) -> tuple[Path, Admission | None]:
        """Write what `vrg play` needs."""
        names = (f"match-{match.number}" if n == 1 else f"match-{match.number}-{n}" for n in count(1))
        folder = RunFolder(next(path for name in names if not (path := self._folder / name).exists()))
        folder.path.mkdir(parents=True)
        setup = self.setup(match.match, match.strategies, match.seed)
        keep(setup, folder)
        if not self._paged:
            return folder.match_file, None
        port = free_port(LOOPBACK, PORT, tries=200)
        seats = {player.name: self._seat(match.name, player.name) for player in setup.players}
        page = Admission(LOOPBACK, port, self._official, seats)
        write_whole(self._page_file, page.encoded().encode(), 0o600)
        return folder.match_file, page

    @property
    def _page_file(self) -> Path:
        return self._folder / "match-page.json"

    def _seat(self, match: str, player: str) -> str:
        """The token of a player's seat, which stays the same when a match is played again."""
        return hmac.new(self._official.encode(), f"{match}\n{player}".encode(), hashlib.sha256).hexdigest()[:32]


def _last(text: str) -> str:
    """The last line with words, without the frame that some terminals get."""
    lines = [line.strip(" \u2500\u2502\u256d\u256e\u2570\u256f") for line in text.splitlines()]
    return next((line for line in reversed(lines) if line), "")


def report_of(base: Path, path: Path | None) -> Report:
    """How the match of a run folder has ended.

    Args:
        base: the folder of the event. path: the run folder; None if there is none.

    Raises:
        VrgError: its files cannot be read.
    """
    if path is None or not RunFolder(path).result.is_file():
        return Report(why="no_result")
    run = Run(path)
    begun = any(stage in PLAYED for record in read_journal(RunFolder(path).journal)[1] for stage in record.stages)
    if not begun:
        return Report(why="not_begun", words=run.conclusion)
    return Report(words=run.conclusion, score=dict(run.score), winner=run.winner, run=str(path.relative_to(base)))
