"""An experiment as it runs: games are started, recorded and counted until every series is over."""

from collections.abc import Callable, Mapping, Sequence

from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup
from vrg.evaluation.folder import ExperimentFolder
from vrg.evaluation.games import FAILED, GameRecord, Pairing, Played, ScheduledGame
from vrg.evaluation.series import Series
from vrg.evaluation.workers import Workers

_LOOK = 0.1
"""The real time in s between two looks at whether to stop."""


class Experiment:
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
        setup: MatchSetup,
        series: Mapping[Pairing, Series],
        left_out: Sequence[tuple[str, str]] = (),
    ) -> None:
        self.left_out = left_out
        self.folder = folder
        self.series = dict(series)
        self._setups: dict[tuple[Pairing, str], MatchSetup] = {}
        for pairing in self.series:
            for number in (0, 1):
                game = folder.definition.game_of(pairing, number)
                self._setups[pairing, game.first_team] = folder.write_match(setup, game)
        for row in folder.rows:
            if row.game.pairing in self.series:
                self.series[row.game.pairing].add(row.game.number, row.points)

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
    def setup(self) -> MatchSetup:
        """Some match of the experiment."""
        return next(iter(self._setups.values()))

    def run(
        self,
        workers: Workers,
        stop: StopSignal,
        finished: Callable[[GameRecord], None],
        looked: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Play until every series is over, or until `stop` is set.

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
                    self.series[game.pairing].add(game.number, row.points)
                    finished(row)
                for game in workers.games():
                    if self.series[game.pairing].over:
                        workers.cancel(game)

    def rows(self) -> list[GameRecord]:
        """The games that count: round by round, one pair of games of each pairing after the other."""
        order = {pairing: number for number, pairing in enumerate(self.series)}
        counting = [
            row
            for row in self.folder.rows
            if row.game.pairing in order and row.game.number < self.series[row.game.pairing].counted
        ]
        return sorted(counting, key=lambda row: (row.game.pair, order[row.game.pairing], row.game.number))

    def _fill(self, workers: Workers) -> None:
        """Start games. All pairings go on at the same pace, pair by pair, so that no side is ahead in what counts."""
        for _ in range(workers.free):
            waiting = [(series.upcoming, pairing) for pairing, series in self.series.items()]
            games = [(number, pairing) for number, pairing in waiting if number is not None]
            if not games:
                return
            number, pairing = min(games, key=lambda game: game[0] // 2)
            game = self.folder.definition.game_of(pairing, number)
            self.series[pairing].begin()
            workers.start(game, self._setups[pairing, game.first_team], self.folder.definition.limit)

    def _row(self, game: ScheduledGame, played: Played) -> GameRecord:
        setup = self._setups[game.pairing, game.first_team]
        return GameRecord(game=game, played=played, teams={player.name: player.team for player in setup.players})
