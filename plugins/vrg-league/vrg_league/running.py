"""Games as they are played: they are started, recorded and counted; an experiment is over when every series is."""

from collections.abc import Callable, Mapping, Sequence

from vrg.bus.stopping import StopSignal
from vrg.config.setup import CheckedMatch
from vrg_league.folder import ExperimentFolder
from vrg_league.games import FAILED, GameRecord, Pairing, Played, ScheduledGame
from vrg_league.series import Series
from vrg_league.workers import Workers

_LOOK = 0.1
"""The real time in s between two looks at whether to stop."""


class Games:
    """Games that are played and recorded, as many at a time as there are workers; which ones, a subclass decides.

    Args:
        folder: the open folder of the games. setup: the match as its user has written it.
    """

    def __init__(self, folder: ExperimentFolder, setup: CheckedMatch) -> None:
        self.folder = folder
        self._match = setup
        self._setups: dict[tuple[Pairing, str], CheckedMatch] = {}

    def run(
        self,
        workers: Workers,
        stop: StopSignal,
        finished: Callable[[GameRecord], None] = lambda _: None,
        looked: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Play until no more game is needed, or until `stop` is set.

        Args:
            workers: what plays the games; it is closed. finished: called with each game that was played.
            looked: called again and again with the number of games that run.

        Raises:
            LaunchError: a game cannot be recorded, or no game can be played any more.
        """
        with workers:
            while not stop.is_set():
                self._fill(workers)
                looked(len(workers.games()))
                if not workers.games():
                    return
                for game, played in workers.finished(_LOOK):
                    if played.ended == FAILED and stop.is_set():
                        continue  # the signal that stops this may have ended the game, too
                    row = self._row(game, played)
                    self.folder.append(row)
                    self.count(row)
                    finished(row)
                for game in workers.games():
                    if self.needless(game):
                        workers.cancel(game)

    def upcoming(self, running: Sequence[ScheduledGame]) -> ScheduledGame | None:
        """The game to start now; None if there is none.

        Args:
            running: the games that are being played.
        """
        raise NotImplementedError

    def count(self, row: GameRecord) -> None:
        """Take in a game that was played, and is in the record."""

    def needless(self, game: ScheduledGame) -> bool:
        """True if a game that is being played is not needed any more."""
        return False

    def setup_of(self, game: ScheduledGame) -> CheckedMatch:
        """The match of a game, whose file is written when it is asked for the first time.

        Raises:
            ConfigError: the strategies cannot be put into the match file.
            LaunchError: the files cannot be written.
        """
        key = game.pairing, game.first_team
        if key not in self._setups:
            self._setups[key] = self.folder.write_match(self._match, game)
        return self._setups[key]

    def _fill(self, workers: Workers) -> None:
        for _ in range(workers.free):
            game = self.upcoming(workers.games())
            if game is None:
                return
            workers.start(game, self.setup_of(game), self.folder.definition.limit)

    def _row(self, game: ScheduledGame, played: Played) -> GameRecord:
        return GameRecord(game=game, played=played, teams={p.name: p.team for p in self.setup_of(game).players})


class Experiment(Games):
    """All series of an experiment, one for each pairing.

    Args:
        folder: the open folder of the experiment. The games in it count.
        setup: the match as its user has written it.
        series: the series of each pairing, without games.
        left_out: the strategies that take no part: the name of each, and the reason.
    """

    def __init__(
        self,
        folder: ExperimentFolder,
        setup: CheckedMatch,
        series: Mapping[Pairing, Series],
        left_out: Sequence[tuple[str, str]] = (),
    ) -> None:
        super().__init__(folder, setup)
        self.left_out = left_out
        self.series = dict(series)
        for pairing in self.series:
            for number in (0, 1):
                self.setup_of(folder.definition.game_of(pairing, number))
        for row in folder.rows:
            if row.game.pairing in self.series:
                self.count(row)

    @property
    def over(self) -> bool:
        """True if no more game is needed."""
        return all(series.over for series in self.series.values())

    @property
    def completed(self) -> int:
        """The number of games that count."""
        return sum(series.counted for series in self.series.values())

    @property
    def total(self) -> int:
        """The most games that may count in the end."""
        return self.completed + sum(series.left for series in self.series.values())

    @property
    def setup(self) -> CheckedMatch:
        """Some match of the experiment."""
        return next(iter(self._setups.values()))

    def rows(self) -> list[GameRecord]:
        """The games that count: round by round, one pair of games of each pairing after the other."""
        order = {pairing: number for number, pairing in enumerate(self.series)}
        counting = [
            row
            for row in self.folder.rows
            if row.game.pairing in order and row.game.number < self.series[row.game.pairing].counted
        ]
        return sorted(counting, key=lambda row: (row.game.pair, order[row.game.pairing], row.game.number))

    def upcoming(self, running: Sequence[ScheduledGame]) -> ScheduledGame | None:
        """See Games.upcoming. All pairings go on at the same pace, so that no side is ahead in what counts."""
        waiting = [(series.upcoming, pairing) for pairing, series in self.series.items()]
        games = [(number, pairing) for number, pairing in waiting if number is not None]
        if not games:
            return None
        number, pairing = min(games, key=lambda game: game[0] // 2)
        self.series[pairing].begin()
        return self.folder.definition.game_of(pairing, number)

    def count(self, row: GameRecord) -> None:
        """Take in a game that is in the record."""
        self.series[row.game.pairing].add(row.game.number, row.points)

    def needless(self, game: ScheduledGame) -> bool:
        """True if the series of a game is over."""
        return self.series[game.pairing].over
