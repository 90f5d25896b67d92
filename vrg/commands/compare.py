"""The commands `vrg compare` and `vrg tournament`, which find out which of two or more strategies is better."""

from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from vrg.commands.evaluating import EvaluationOptions, experiment, finish, show
from vrg.commands.options import StrategyArgument, make_console

if TYPE_CHECKING:
    from vrg.evaluation.games import GameRecord
    from vrg.evaluation.running import Experiment
    from vrg.evaluation.standings import Rating

MOST_CROSSED = 8
"""The number of strategies up to which the cross table is printed; the report always has it."""


def compare(first: StrategyArgument, second: StrategyArgument, options: EvaluationOptions) -> None:
    """Let two strategies play many games, each seed twice with the sides swapped, until one is shown to be better.

    If it is interrupted, the same command goes on where it stopped.
    """
    from vrg.evaluation import files, report
    from vrg.games import game_of
    from vrg.ui.comparison import plot_comparison

    with experiment([first, second], options, "compare") as played:
        console, folder = make_console(), played.folder
        [(pairing, series)] = played.series.items()
        rows, teams = played.rows(), folder.definition.teams
        sentence = report.sentence(pairing, series, options.confidence)
        tables = [report.sides(rows, teams), report.calls(rows)]
        remarks = report.irregular(rows)
        files.write(folder.path, "games", files.games(rows, folder.again))
        parts = [f"# {sentence}", *map(report.markdown, tables), "\n".join(f"- {remark}" for remark in remarks)]
        for table in tables:
            show(console, table)
        if rows:
            game = game_of(folder.definition.game)
            words = {team: game.counted(team) for team in game.score_words}
            shares = [(now.games, now.share, now.low, now.high) for now in series.standings]
            scores, times = report.scores(rows, teams, words), report.times(rows)
            names = pairing.first, pairing.second
            plot_comparison(folder.path / "comparison.png", sentence, names, shares, scores, times)
        finish(console, folder, parts, rows, remarks)
        console.print(f"[bold]{escape(sentence)}[/bold]", soft_wrap=True)


def tournament(
    strategies: Annotated[
        list[str],
        typer.Argument(
            metavar="STRATEGY...",
            help="Files or folders of files, names of strategies, file.py:Class, module:Class, policy.npz.",
        ),
    ],
    options: EvaluationOptions,
    mirror: Annotated[bool, typer.Option("--mirror", help="Let each strategy play against itself, too.")] = False,
) -> None:
    """Let each strategy play against each other one, as `vrg compare` does, and rate them all.

    A strategy that cannot play is named and left out. `leaderboard.html` in the folder shows how it goes. If the
    tournament is interrupted, the same command goes on where it stopped.
    """
    from vrg.evaluation import files, report, standings
    from vrg.ui.crosstable import plot_cross_table

    with experiment(
        strategies, options, "tournament", mirror=mirror, leave_out=True, follow=_write_leaderboard
    ) as played:
        console, folder = make_console(), played.folder
        rows, rated = _rated(played)
        _write_leaderboard(played, None)
        labels = [rating.label for rating in rated]
        crossed = standings.crossed(labels, played.series)
        cells = standings.cells(crossed)
        table = standings.table(rated, cells)
        sentences = [report.sentence(pairing, series, options.confidence) for pairing, series in played.series.items()]
        remarks = [f"{name} was left out: {why}" for name, why in played.left_out] + report.irregular(rows)
        files.write(folder.path, "games", files.games(rows, folder.again))
        files.write(folder.path, "pairings", files.pairings(played.series))
        files.write(folder.path, "ratings", files.rated(rated))
        board = standings.board(rated, rows, standings.to_play(played.series))
        show(console, board)
        if len(labels) <= MOST_CROSSED:
            show(console, table)
            for sentence in sentences:
                console.print(escape(sentence), soft_wrap=True)
        title = f"{folder.definition.game}, {len(rows)} games; *: a difference was found"
        marks = [(rating.value, rating.sigma) for rating in rated]
        shares = [[None if now is None else now.share for now in line] for line in crossed]
        plot_cross_table(folder.path / "tournament.png", title, labels, shares, cells, marks)
        parts = [
            f"# {title}",
            report.markdown(board),
            report.markdown(table),
            "\n".join(f"- {text}" for text in [*sentences, *remarks]),
        ]
        finish(console, folder, parts, rows, remarks)
        console.print(f"[bold]{escape(standings.ranking(rated))}[/bold]", soft_wrap=True)


def _rated(played: "Experiment") -> "tuple[list[GameRecord], list[Rating]]":
    """The games that count, and the strategies by their ratings in these."""
    from vrg.evaluation import standings

    rows = played.rows()
    return rows, standings.ratings([contender.label for contender in played.folder.definition.contenders], rows)


def _write_leaderboard(played: "Experiment", left: float | None) -> None:
    """Write the leaderboard as a page, and the schedule with what is still to be played.

    Args:
        left: the real time in s that is left at most; None if it is not known.
    """
    from vrg.evaluation import report, standings
    from vrg.evaluation.folder import write_text
    from vrg.ui.leaderboard import Block, page

    rows, rated = _rated(played)
    definition = played.folder.definition
    goes_on = ": the tournament is over" if played.over else f" of at most {played.total}"
    until = "" if left is None or played.over else f", {report.lasting(left)} left at most"
    notes = [f"{len(rows)} games{goes_on}{until}"]
    if played.left_out:
        notes.append(f"left out: {', '.join(name for name, _ in played.left_out)}")
    table = standings.board(rated, rows, standings.to_play(played.series))
    text = page(definition.game, notes, [Block(table, "board")], reloads=not played.over)
    write_text(played.folder.path, "leaderboard.html", text)
    parts = [f"# {notes[0]}", report.markdown(report.pairings(played.series))]
    write_text(played.folder.path, "schedule.md", "\n\n".join(parts))
