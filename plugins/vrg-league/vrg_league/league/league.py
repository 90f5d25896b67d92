"""A league: entries that may change at any time, and games of their versions, played whenever there is time for some.

Each new version of an entry is copied into the folder of the league, and plays from there once it has passed a check.
An entry whose newest version has not passed goes on with the one before. Ratings always follow from all games of all
versions; the table shows the version by which each entry plays now.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path

from msgspec import structs

from vrg.config.setup import CheckedMatch
from vrg.config.targets import whole_target
from vrg.errors import ConfigError
from vrg.types import printable
from vrg_league.contenders import TRIAL, Contender, Unable, teams_of, unable, with_strategies
from vrg_league.entries import Source, entries_in
from vrg_league.folder import ExperimentFolder
from vrg_league.games import GameRecord, Pairing, ScheduledGame
from vrg_league.league.folder import LeagueFolder, Version, playing
from vrg_league.league.matchmaking import next_pairing
from vrg_league.running import Games
from vrg_league.standings import Fit, Rating, fit, rated

_FAULT_LENGTH = 2000
"""The number of characters of what is wrong with a version."""
_SHOWN = 5
"""The number of games with failures that the file for an author has."""
_TAIL = 4000
"""The number of bytes of the end of a player's log that it has."""


def entries_of(league: LeagueFolder, folder: Path, pages: Path) -> list[Source]:
    """The entries that authors have put into a folder.

    Args:
        league: it may lie there, and so may its pages.

    Raises:
        ConfigError: the folder cannot be read.
    """
    owners = {entry: version.file for entry, version in playing(league.versions).items()}
    others = league.path.resolve(), pages.resolve()
    return entries_in(folder, without=others, owner=lambda name: owners.get(name, ""))


def admit(
    folder: LeagueFolder,
    setup: CheckedMatch,
    sources: Iterable[Source],
    now: str,
    jobs: int,
) -> list[Version]:
    """Take in what has changed: copy each new version, and let it play alone, sealed, before it takes part.

    Args:
        now: the wall time, as `Version.since`. jobs: the number of games at a time.

    Returns:
        the lines that were added to the record of versions.

    Raises:
        LaunchError: the folder cannot be written, or no game can be played.
    """
    before = len(folder.versions)
    waiting: dict[Contender, Version] = {}
    for source in sources:
        of_entry = [version for version in folder.versions if version.entry == source.entry]
        known = [version for version in of_entry if version.digest == source.digest]
        if known and not known[-1].problem and known[-1] != playing(of_entry).get(source.entry):
            folder.add(structs.replace(known[-1], since=now))  # its author has gone back to this one
        overdue = bool(known) and known[-1].overdue
        if (known and not overdue) or source.problem:
            continue
        number = known[-1].number if overdue else max((version.number for version in of_entry), default=0) + 1
        new = Version(entry=source.entry, number=number, digest=source.digest, file=source.name, since=now)
        copy = folder.store(new.label, source)
        try:
            target = whole_target(str(copy))
            with_strategies(setup, dict.fromkeys(teams_of(setup), target))
            waiting[Contender(label=new.label, target=target)] = new
        except ConfigError as error:
            folder.add(structs.replace(new, problem=_own(str(error), copy)))
    problems = unable(setup, list(waiting), jobs, match_time=TRIAL) if waiting else {}
    for contender, new in waiting.items():
        found = problems.get(contender, Unable(""))
        why = _own(found.problem, Path(contender.target))
        target = folder.in_store(contender.target)
        folder.add(structs.replace(new, target=target, problem=why, overdue=found.overdue))
    return folder.versions[before:]


def _own(problem: str, copy: Path) -> str:
    """The problem of a version, in a line, with its files as their author knows them."""
    return printable(" ".join(problem.replace(f"{copy.parent}/", "").split()))[:_FAULT_LENGTH]


class League(Games):
    """The games of a league, as far as a call plays them.

    Args:
        folder: the open folder of the league. setup: its match.
        there: the entries that may play now: those whose file is still there.
        more: False ends it, when the games that run are over; called with the number of games that were started.

    Attributes:
        playing: the version by which each entry plays. active: the labels of those that may play, sorted.
    """

    def __init__(
        self, folder: LeagueFolder, setup: CheckedMatch, there: Collection[str], more: Callable[[int], bool]
    ) -> None:
        super().__init__(folder, setup)
        self.folder: LeagueFolder = folder
        self.playing = playing(folder.versions)
        self.active = sorted(version.label for entry, version in self.playing.items() if entry in there)
        self._more = more
        self._started = 0
        self._turns: Counter[str] = Counter()
        """The pairs of games that each version has begun in this call."""
        self._fit: tuple[int, Fit] | None = None

    @property
    def rows(self) -> list[GameRecord]:
        """All games."""
        return self.folder.rows

    @property
    def resting(self) -> list[str]:
        """The entries whose author has taken their file away; their games stay, and their ratings."""
        return sorted(entry for entry, version in self.playing.items() if version.label not in self.active)

    @property
    def fit(self) -> Fit:
        """The ratings of all versions by all games."""
        if self._fit is None or self._fit[0] != len(self.rows):
            played = {label for row in self.rows for label in row.game.pairing.labels}
            self._fit = len(self.rows), fit(sorted(played | {v.label for v in self.playing.values()}), self.rows)
        return self._fit[1]

    @property
    def table(self) -> list[Rating]:
        """The ratings of the versions by which the entries play now, the strongest first."""
        current = {version.label for version in self.playing.values()}
        return [rating for rating in rated(self.fit) if rating.label in current]

    def upcoming(self, running: Sequence[ScheduledGame]) -> ScheduledGame | None:
        """The other half of a pair of games that was begun, or the pair of those whose turn it is that makes the
        ratings certain fastest."""
        if not self._more(self._started):
            return None
        taken = [row.game for row in self.rows] + list(running)
        game = _half(taken, self.active)
        if game is None:
            pairing = next_pairing(self.fit, self.active, [other.pairing for other in running], self._turns)
            if pairing is None:
                return None
            self._turns.update(pairing.labels)
            game = pairing, 2 * sum(other.pairing == pairing and other.number % 2 == 0 for other in taken)
        self._started += 1
        return self.folder.definition.game_of(*game)


def _half(taken: Sequence[ScheduledGame], active: Collection[str]) -> tuple[Pairing, int] | None:
    """The first game that is missing of a pair of games, between strategies that may play; None if there is none."""
    there = {(game.pairing, game.number) for game in taken}
    for game in taken:
        if (game.pairing, other := game.number ^ 1) not in there and {*game.pairing.labels} <= {*active}:
            return game.pairing, other
    return None


def write_errors(folder: LeagueFolder, sources: Iterable[Source], now: str) -> None:
    """Write the errors of each entry; see `errors_of`.

    Args:
        sources: the entries as they are now. now: the wall time.

    Raises:
        LaunchError: they cannot be written.
    """
    of = {source.entry: source for source in sources}
    for entry in {*of, *(version.entry for version in folder.versions)}:
        folder.write_errors(entry, errors_of(folder, of.get(entry), entry, now))


def errors_of(folder: LeagueFolder, source: Source | None, entry: str, now: str) -> str:
    """The errors of an entry, for its author alone: why it does not play, and what has failed in its games.

    Args:
        source: the entry as it is now; None if it is not there any more. now: the wall time.
    """
    parts = []
    of_entry = [version for version in folder.versions if version.entry == entry]
    current = playing(of_entry).get(entry)
    goes_on = f"version {current.number} goes on playing" if current else "no version of it plays"
    if source is not None and source.problem:
        parts.append(f"{source.problem} ({goes_on})")
    elif of_entry and of_entry[-1].problem:
        last = of_entry[-1]
        parts.append(f"version {last.number} of {last.since} does not play ({goes_on}):\n{last.problem}")
    labels = {version.label for version in of_entry}
    parts += failed_games(folder, labels)
    return "\n\n".join([f"{entry}, {now}", *parts]) + "\n" if parts else ""


def failed_games(folder: ExperimentFolder, labels: Collection[str]) -> list[str]:
    """The failures in the code of some strategies, for their author, with the end of the logs: the last first."""
    parts = []
    failed = [(row, said) for row in folder.rows if (said := _failures(row, labels))]
    for row, said in reversed(failed[-_SHOWN:]):
        label, other = sorted(row.game.pairing.labels, key=lambda label: label not in labels)
        heading = f"{label} as {row.game.first_team if label == row.game.pairing.first else row.game.second_team}"
        parts.append("\n".join([f"{heading} against {other}, seed {row.game.seed}:", *said]))
        logs = folder.failures / folder.name_of(row.game) / "logs"
        own = _players(row, labels)
        names = dict.fromkeys(name for name in row.played.failing if name in own)
        parts += [f"the end of {name}.log:\n{end}" for name in names if (end := _tail(logs / f"{name}.log"))]
    return parts


def _failures(row: GameRecord, labels: Collection[str]) -> list[str]:
    """The failures of a game in the code of versions of one entry."""
    own, played = _players(row, labels), row.played
    if own and played.failures and not played.failing:
        return ["an earlier VRG did not record whose code failed: see the logs of the game"]
    return [failure for name, failure in zip(played.failing, played.failures, strict=False) if name in own]


def _players(row: GameRecord, labels: Collection[str]) -> set[str]:
    """The players of a game that versions of one entry played for."""
    return {name for name, team in row.teams.items() if row.label(team) in labels}


def _tail(log: Path) -> str:
    """The end of the log of a player; empty if there is none."""
    try:
        with log.open("rb") as file:
            file.seek(max(0, log.stat().st_size - _TAIL))
            return printable(file.read(_TAIL).decode(errors="replace"), lines=True)
    except OSError:
        return ""
