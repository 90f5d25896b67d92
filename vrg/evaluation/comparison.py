"""A comparison of two strategies: which one is better, by the games that they have played."""

from typing import Final

from vrg.evaluation import files, report
from vrg.evaluation.folder import write_report
from vrg.evaluation.running import Experiment
from vrg.games import game_of
from vrg.ui.comparison import plot_comparison

PICTURE: Final = "comparison.png"
"""The name of the file of the picture in the folder of a comparison."""


class Comparison:
    """See the module. What was found is read when this is made, so the experiment may be closed then.

    Args:
        experiment: it has one pairing. confidence: of its interval.

    Attributes:
        path: the folder of the games. rows: the games that count.
        sentence: the result in words. tables: the wins by side, and the calls in a game, as texts.
        remarks: what was irregular, in sentences.
    """

    def __init__(self, experiment: Experiment, confidence: float) -> None:
        [(self._pairing, series)] = experiment.series.items()
        self._folder, self.path = experiment.folder, experiment.folder.path
        self._standings = series.standings
        self.rows = experiment.rows()
        self.sentence = report.sentence(self._pairing, series, confidence)
        self.tables = [report.sides(self.rows, self._folder.definition.teams), report.calls(self.rows)]
        self.remarks = report.irregular(self.rows)

    def write(self) -> None:
        """Write the games as tables, the report and the picture into the folder.

        Raises:
            LaunchError: one cannot be written. OSError: it is the picture.
        """
        files.write(self.path, "games", files.games(self.rows, self._folder.again))
        self._draw()
        remarks = "\n".join(f"- {remark}" for remark in self.remarks)
        write_report(self.path, [f"# {self.sentence}", *map(report.markdown, self.tables), remarks])

    def _draw(self) -> None:
        """Draw the share of the points over the games, the scores and the times, if there are games."""
        if not self.rows:
            return
        definition = self._folder.definition
        game = game_of(definition.game)
        words = {team: game.counted(team) for team in game.score_words}
        shares = [(now.games, now.share, now.low, now.high) for now in self._standings]
        scores, times = report.scores(self.rows, definition.teams, words), report.times(self.rows)
        plot_comparison(self.path / PICTURE, self.sentence, self._pairing.labels, shares, scores, times)
