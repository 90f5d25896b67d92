"""The command `vrg tournament`, in which every strategy plays against every other one."""

from typing import Annotated

import typer
from rich.markup import escape

from vrg.commands.evaluating import (
    AllOption,
    ConfidenceOption,
    FirstSeedOption,
    GamesOption,
    JobsOption,
    LasersOption,
    LimitOption,
    MatchOption,
    OutOption,
    RayOption,
    Wish,
    experiment,
    finish,
    make_console,
    show,
)
from vrg.commands.play import EngineOption, SandboxOption
from vrg.errors import ConfigError


def tournament(
    strategies: Annotated[
        list[str], typer.Argument(metavar="STRATEGY...", help="Names of strategies, or file.py:Class, or module:Class.")
    ],
    match: MatchOption,
    games: GamesOption = 200,
    seed: FirstSeedOption = 0,
    jobs: JobsOption = None,
    engine: EngineOption = "planar",
    lasers: LasersOption = None,
    out: OutOption = None,
    confidence: ConfidenceOption = 0.95,
    play_all: AllOption = False,
    limit: LimitOption = 3600.0,
    ray: RayOption = None,
    sandbox: SandboxOption = None,
    mirror: Annotated[bool, typer.Option("--mirror", help="Let each strategy play against itself, too.")] = False,
) -> None:
    """Let each strategy play against each other one, as `vrg compare` does, and rate them all.

    If it is interrupted, the same command goes on where it stopped.
    """
    from vrg.evaluation import files, report, standings
    from vrg.ui.crosstable import plot_cross_table

    if len(set(strategies)) < max(2, len(strategies)):
        raise ConfigError([f"expected two or more different strategies, got {', '.join(strategies)}"])
    wish = Wish(match, games, seed, jobs, engine, lasers, out, confidence, play_all, limit, ray, sandbox)
    with experiment(strategies, wish, "tournament", mirror=mirror) as played:
        console, folder = make_console(), played.folder
        rows = played.rows()
        rated = standings.ratings([contender.label for contender in folder.definition.contenders], rows)
        labels = [rating.label for rating in rated]
        crossed = standings.crossed(labels, played.series)
        cells = standings.cells(crossed)
        table = standings.table(rated, cells)
        sentences = [report.sentence(pairing, series, confidence) for pairing, series in played.series.items()]
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
