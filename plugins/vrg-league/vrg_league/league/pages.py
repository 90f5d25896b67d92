"""The pages of a league: the table, the cross table, each entry, and each game.

Names are the authors' words, and are escaped. Nothing that the code of a player has raised or printed is in them. Files
are named by numbers, which are the same whatever an entry is called, and on every file system.
"""

from collections.abc import Sequence
from pathlib import Path

from vrg.errors import LaunchError
from vrg.ui.web.share import shared
from vrg_league import standings
from vrg_league.folder import write_text
from vrg_league.games import OUTCOMES, GameRecord, Pairing
from vrg_league.league.league import League
from vrg_league.ui.leaderboard import Block, Cell, Link, page

INDEX, CROSS = "index.html", "cross.html"


class LeaguePages:
    """The pages of a league, in a folder of their own.

    Args:
        folder: the folder, which is made. league: the league. title: of all pages.

    Raises:
        LaunchError: they cannot be written.
    """

    def __init__(self, folder: Path, league: League, title: str) -> None:
        self._folder, self._league, self._title = folder, league, title
        self._versions = {v.label: v for v in league.folder.versions if not v.problem}
        entries = dict.fromkeys(version.entry for version in league.folder.versions)
        self._pages = {entry: f"entry-{number}.html" for number, entry in enumerate(entries, 1)}
        self._rated: dict[str, standings.Rating] = {}
        self._back = [Link(title, INDEX), Link("cross table", CROSS)]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LaunchError(f"{folder}: the pages cannot be written: {error.strerror}") from None

    def write(self, now: str, *, reloads: bool) -> None:
        """Write all pages. Those of games that are there already stay.

        Args:
            now: the wall time. reloads: True lets browsers read the table again and again.

        Raises:
            LaunchError: they cannot be written.
        """
        league = self._league
        self._rated = {rating.label: rating for rating in standings.rated(league.fit)}
        table = league.table
        self._write(INDEX, self._index(table, now, reloads=reloads))
        self._write(CROSS, self._cross(table))
        for entry, name in self._pages.items():
            self._write(name, self._entry(entry))
        for number, row in enumerate(league.rows, 1):
            if not self._is_there(number, row):
                recording = self._league.folder.shown(row.game)
                if recording:
                    self._write(_watched(number), shared(recording, f"{self._title}, game {number}"))
                self._write(_game(number), self._of_game(number, row, shown=bool(recording)))

    def _is_there(self, number: int, row: GameRecord) -> bool:
        """True if the page of a game is there, and is not that of an older league in the same folder."""
        try:
            played = self._league.folder.kept(row.game).stat().st_mtime
            return (self._folder / _game(number)).stat().st_mtime > played
        except OSError:
            return False

    def _write(self, name: str, text: str) -> None:
        write_text(self._folder, name, text)

    def _index(self, table: Sequence[standings.Rating], now: str, *, reloads: bool) -> str:
        league = self._league
        versions = {v.label: v for v in league.playing.values()}
        more = {
            "version": {label: str(version.number) for label, version in versions.items()},
            "since": {label: version.since for label, version in versions.items()},
            **standings.thinking(league.rows),
        }
        board: list[list[Cell]] = [list(line) for line in standings.board(table, league.rows, more)]
        for line, rating in zip(board[1:], table, strict=True):
            line[1] = self._link(rating.label, short=True)
        notes = [f"{len(league.rows)} games by {now}; +- is two standard deviations of the rating"]
        if resting := league.resting:
            notes.append(f"withdrawn: {', '.join(resting)}")
        never = sorted(set(self._pages) - set(league.playing))
        if never:
            notes.append(f"no version has passed the check: {', '.join(never)}")
        links = [Link("cross table", CROSS)]
        return page(self._title, notes, [Block(board, "board")], reloads=reloads, links=links)

    def _cross(self, table: Sequence[standings.Rating]) -> str:
        found: dict[Pairing, list[float]] = {}
        for row in self._league.rows:
            first, second = row.game.pairing.labels
            found.setdefault(Pairing(first, second), []).append(row.points)
            found.setdefault(Pairing(second, first), []).append(1.0 - row.points)
        places = standings.ranks(table)
        lines: list[list[Cell]] = [["", "", *map(str, places)]]
        for place, rating in zip(places, table, strict=True):
            cells: list[Cell] = []
            for other in table:
                points = found.get(Pairing(rating.label, other.label), [])
                share = sum(points) / len(points) if points else 0.0
                names = self._versions[rating.label].entry, self._versions[other.label].entry
                about = f"{names[0]} against {names[1]}: {share * len(points):g} of {len(points)}"
                text = "·" if other == rating else ""
                cells.append(Link(f"{100 * share:.0f}", "", about, more=share > 0.5) if points else text)
            lines.append([str(place), self._link(rating.label, short=True), *cells])
        notes = ["The share of the points, in %, of the strategy of each row against that of each column, by rank."]
        block = Block(lines, "cross")
        return page("Cross table", notes, [block], reloads=False, links=self._back[:1])

    def _entry(self, entry: str) -> str:
        league = self._league
        own = [v for v in self._versions.values() if v.entry == entry]
        labels = {version.label for version in own}
        of_entry = [(n, row) for n, row in enumerate(league.rows, 1) if labels & {*row.game.pairing.labels}]
        rated = [self._rated[v.label] for v in reversed(own) if v.label in self._rated]
        more = {"since": {v.label: v.since for v in own}}
        versions: list[list[Cell]] = [list(line[1:]) for line in standings.board(rated, league.rows, more)]
        versions[0][0] = "version"
        for line, rating in zip(versions[1:], rated, strict=True):
            line[0] = str(self._versions[rating.label].number)
        games: list[list[Cell]] = [["game", "against", "result", "version", "side", "score", "seed"]]
        games += [self._line(number, row, entry) for number, row in reversed(of_entry)]
        now = league.playing.get(entry)
        notes = [f"plays with version {now.number} since {now.since}" if now else "no version has passed the check"]
        blocks = [Block(versions, "numbers", "Versions"), Block(games, "list", "Games")]
        return page(entry, notes, blocks, reloads=False, links=self._back)

    def _line(self, number: int, row: GameRecord, entry: str) -> list[Cell]:
        first, second = (self._versions[label] for label in row.game.pairing.labels)
        is_first = first.entry == entry
        own, other = (first, second) if is_first else (second, first)
        points = row.points if is_first else 1.0 - row.points
        side = row.game.first_team if is_first else row.game.second_team
        sides = sorted(self._league.folder.definition.teams, key=lambda team: team != side)
        against = self._link(other.label)
        numbers = [str(own.number), side, row.score(sides), str(row.game.seed)]
        return [Link(str(number), _game(number)), against, OUTCOMES[points], *numbers]

    def _of_game(self, number: int, row: GameRecord, *, shown: bool) -> str:
        league, game = self._league, row.game
        by_team = dict(zip((game.first_team, game.second_team), game.pairing.labels, strict=True))
        winner = "drawn" if row.winner is None else f"won by {self._versions[row.winner].entry}"
        teams = league.folder.definition.teams
        sides: list[list[Cell]] = [["side", "strategy", "score"]]
        for team in teams:
            sides.append([team, self._link(by_team[team]), str(row.played.score.get(team, "-"))])
        time = row.played.match_time
        how = f"game {number}: {row.played.ended}; {winner}; seed {game.seed}"
        notes = [how if time is None else f"{how}; {time:.0f} s"]
        blocks = [
            Block(sides, "sides", match=_watched(number) if shown else ""),
            Block(heading="The same game again, in the folder of the league", command=league.folder.again(game)),
        ]
        title = " against ".join(self._versions[by_team[team]].entry for team in teams)
        return page(title, notes, blocks, reloads=False, links=self._back)

    def _link(self, label: str, *, short: bool = False) -> Link:
        version = self._versions[label]
        text = version.entry if short else f"{version.entry}, version {version.number}"
        return Link(text, self._pages[version.entry])


def _watched(number: int) -> str:
    return f"watch-{number}.html"


def _game(number: int) -> str:
    return f"game-{number}.html"
