"""A comparison of two strategies: which one is better, by the games that they have played."""

from html import escape
from pathlib import Path
from typing import Final, Literal

import pyarrow as pa

from vrg.errors import LaunchError
from vrg.games import game_of
from vrg.playing.run import PngFile
from vrg_league import files, report
from vrg_league.folder import write_report, writing
from vrg_league.running import Experiment
from vrg_league.ui.comparison import plot_comparison

_PICTURE: Final = "comparison.png"


class Comparison:
    """The verdict on which of two strategies is better, by the games that they have played. It has what was found when
    it was made, and its folder holds that after `write`.

    Args:
        experiment: it has one pairing. confidence: of its interval.

    Attributes:
        path: the folder. rows: the games that count. first, second: the names of the strategies.
        result: of the first strategy: it is better or worse than the second with this confidence, or that is undecided.
        rate: the share of the points that the first has, 0 to 1, for which a draw is half a win; None without games.
        interval: the ends of the interval of this share. confidence: of the interval.
        sentence: the result in words. tables: the wins by side, and the calls in a game, as texts.
        remarks: what was irregular, in sentences.
    """

    def __init__(self, experiment: Experiment, confidence: float) -> None:
        [(pairing, series)] = experiment.series.items()
        now, self._standings, self._folder = series.standing, series.standings, experiment.folder
        self.path: Path = self._folder.path
        self.first, self.second = pairing.labels
        self.rows = experiment.rows()
        self.rate = None if now is None else now.share
        self.interval = (0.0, 1.0) if now is None else (now.low, now.high)
        self.confidence = confidence
        low, high = self.interval
        self.result: Literal["better", "worse", "undecided"] = (
            "better" if low > 0.5 else "worse" if high < 0.5 else "undecided"
        )
        self.sentence = report.sentence(pairing, series, confidence)
        self.tables = [report.sides(self.rows, self._folder.definition.teams), report.calls(self.rows)]
        self.remarks = report.irregular(self.rows)

    def __repr__(self) -> str:
        return f"Comparison({str(self.path)!r}): {self.sentence}"

    def write(self) -> None:
        """Write the games as tables, the report and, if there are games, the picture into the folder.

        Raises:
            LaunchError: one cannot be written.
        """
        files.write(self.path, "games", self._columns)
        if self.rows:
            self.plot()
        remarks = "\n".join(f"- {remark}" for remark in self.remarks)
        write_report(self.path, [f"# {self.sentence}", *map(report.markdown, self.tables), remarks])

    def to_arrow(self) -> pa.Table:
        """The games as a table, a row for each: the columns are those of `games.csv`."""
        return files.table(self._columns)

    @property
    def _columns(self) -> files.Columns:
        return files.games(self.rows, self._folder.again)

    def plot(self) -> PngFile:
        """Draw the share of the points over the games, the scores and the times.

        Raises:
            LaunchError: there are no games, or the picture cannot be written.
        """
        if not self.rows:
            raise LaunchError(f"{self.path}: expected games to plot, found none: {self.sentence}")
        definition, picture = self._folder.definition, self.path / _PICTURE
        game = game_of(definition.game)
        words = {team: game.counted(team) for team in game.score_words}
        shares = [(now.games, now.share, now.low, now.high) for now in self._standings]
        scores, times = report.scores(self.rows, definition.teams, words), report.times(self.rows)
        with writing(f"{self.path}: {_PICTURE}"):
            plot_comparison(picture, self.sentence, (self.first, self.second), shares, scores, times)
        return PngFile(picture)

    def _repr_html_(self) -> str:
        tables = "".join(f"<table>{''.join(map(_row, table))}</table>" for table in self.tables)
        return f"<p>{escape(self.sentence)}</p>{tables}{PngFile(self.path / _PICTURE).html('share of the points')}"


def _row(cells: list[str]) -> str:
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
