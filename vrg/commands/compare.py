"""The commands `vrg compare` and `vrg tournament`, which find out which of two or more strategies is better."""

from typing import Annotated

import typer
from rich.markup import escape

from vrg.commands.evaluating import EvaluationOptions, experiment, finish, show
from vrg.commands.options import StrategyArgument, make_console
from vrg.errors import ConfigError


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
        list[str], typer.Argument(metavar="STRATEGY...", help="Names of strategies, or file.py:Class, or module:Class.")
    ],
    options: EvaluationOptions,
    mirror: Annotated[bool, typer.Option("--mirror", help="Let each strategy play against itself, too.")] = False,
) -> None:
    """Let each strategy play against each other one, as `vrg compare` does, and rate them all.

    If it is interrupted, the same command goes on where it stopped.
    """
    from vrg.evaluation import files, report, standings
    from vrg.ui.crosstable import plot_cross_table

    if len(set(strategies)) < max(2, len(strategies)):
        raise ConfigError(f"expected two or more different strategies, got {', '.join(strategies)}")
    with experiment(strategies, options, "tournament", mirror=mirror) as played:
        console, folder = make_console(), played.folder
        rows = played.rows()
        rated = standings.ratings([contender.label for contender in folder.definition.contenders], rows)
        labels = [rating.label for rating in rated]
        crossed = standings.crossed(labels, played.series)
        cells = standings.cells(crossed)
        table = standings.table(rated, cells)
        sentences = [report.sentence(pairing, series, options.confidence) for pairing, series in played.series.items()]
        remarks = report.irregular(rows)
        files.write(folder.path, "games", files.games(rows, folder.again))
        files.write(folder.path, "pairings", files.pairings(played.series))
        files.write(folder.path, "ratings", files.rated(rated))
        show(console, table)
        for sentence in sentences:
            console.print(escape(sentence), soft_wrap=True)
        title = f"{folder.definition.game}, {len(rows)} games; *: a difference was found"
        marks = [(rating.mu, rating.sigma) for rating in rated]
        shares = [[None if now is None else now.share for now in line] for line in crossed]
        plot_cross_table(folder.path / "tournament.png", title, labels, shares, cells, marks)
        parts = [f"# {title}", report.markdown(table), "\n".join(f"- {text}" for text in [*sentences, *remarks])]
        finish(console, folder, parts, rows, remarks)
        console.print(f"[bold]{escape(standings.ranking(rated))}[/bold]", soft_wrap=True)
