"""A tournament: each strategy has played against each other one, and all are rated."""

from vrg_league import files, report, standings
from vrg_league.folder import write_report, write_text, writing
from vrg_league.games import GameRecord
from vrg_league.running import Experiment
from vrg_league.ui.crosstable import plot_cross_table
from vrg_league.ui.leaderboard import Block, page


class Tournament:
    """Each strategy against each other one, and all rated.

    Args:
        experiment: the games as they are now. confidence: of the intervals.

    Attributes:
        rows: the games that count. rated: the strategies by their ratings in these.
        board: the leaderboard, as texts. table: the cross table, as texts.
        sentences: the result of each pairing. remarks: what was left out, and what was irregular, in sentences.
    """

    def __init__(self, experiment: Experiment, confidence: float) -> None:
        self._experiment = experiment
        self.rows, self.rated = _rated(experiment)
        self._crossed = standings.crossed([rating.label for rating in self.rated], experiment.series)
        self._cells = standings.cells(self._crossed)
        self.board = standings.board(self.rated, self.rows, standings.to_play(experiment.series))
        self.table = standings.table(self.rated, self._cells)
        self.sentences = [report.sentence(pairing, of, confidence) for pairing, of in experiment.series.items()]
        self.remarks = [f"{name} was left out: {why}" for name, why in experiment.left_out]
        self.remarks += report.irregular(self.rows)

    def write(self) -> None:
        """Write the tables, the report, the picture and the leaderboard into the folder.

        Raises:
            LaunchError: one cannot be written.
        """
        folder, series = self._experiment.folder, self._experiment.series
        write_leaderboard(self._experiment, None)
        files.write(folder.path, "games", files.games(self.rows, folder.again))
        files.write(folder.path, "pairings", files.pairings(series))
        files.write(folder.path, "ratings", files.rated(self.rated))
        title = f"{folder.definition.game}, {len(self.rows)} games; *: a difference was found"
        labels, marks = [r.label for r in self.rated], [(r.value, r.sigma) for r in self.rated]
        shares = [[None if now is None else now.share for now in line] for line in self._crossed]
        with writing(f"{folder.path}: tournament.png"):
            plot_cross_table(folder.path / "tournament.png", title, labels, shares, self._cells, marks)
        lines = "\n".join(f"- {text}" for text in [*self.sentences, *self.remarks])
        write_report(folder.path, [f"# {title}", report.markdown(self.board), report.markdown(self.table), lines])


def _rated(experiment: Experiment) -> tuple[list[GameRecord], list[standings.Rating]]:
    """The games that count, and the strategies by their ratings in these."""
    rows = experiment.rows()
    return rows, standings.ratings([contender.label for contender in experiment.folder.definition.contenders], rows)


def write_leaderboard(experiment: Experiment, left: float | None) -> None:
    """Write the leaderboard as a page, and the schedule with what is still to be played.

    Args:
        left: the real time in s that is left at most; None if it is not known.

    Raises:
        LaunchError: they cannot be written.
    """
    rows, rated = _rated(experiment)
    folder, over = experiment.folder, experiment.over
    goes_on = ": the tournament is over" if over else f" of at most {experiment.total}"
    until = "" if left is None or over else f", {report.lasting(left)} left at most"
    notes = [f"{len(rows)} games{goes_on}{until}"]
    if experiment.left_out:
        notes.append(f"left out: {', '.join(name for name, _ in experiment.left_out)}")
    table = standings.board(rated, rows, standings.to_play(experiment.series))
    text = page(folder.definition.game, notes, [Block(table, "board")], reloads=not over)
    write_text(folder.path, "leaderboard.html", text)
    parts = [f"# {notes[0]}", report.markdown(report.pairings(experiment.series))]
    write_text(folder.path, "schedule.md", "\n\n".join(parts))
