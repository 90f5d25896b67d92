"""The command `vrg compare`, which finds out which of two strategies is better."""

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
    StrategyArgument,
    Wish,
    experiment,
    finish,
    make_console,
    show,
)
from vrg.commands.play import EngineOption, SandboxOption


def compare(
    first: StrategyArgument,
    second: StrategyArgument,
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
) -> None:
    """Let two strategies play many games, each seed twice with the sides swapped, until one is shown to be better.

    If it is interrupted, the same command goes on where it stopped.
    """
    from vrg.evaluation import files, report
    from vrg.games import game_of
    from vrg.ui.comparison import plot_comparison

    wish = Wish(match, games, seed, jobs, engine, lasers, out, confidence, play_all, limit, ray, sandbox)
    with experiment([first, second], wish, "compare") as played:
        console, folder = make_console(), played.folder
        [(pairing, series)] = played.series.items()
        rows, teams = played.rows(), folder.definition.teams
        sentence = report.sentence(pairing, series, confidence)
        tables = [report.sides(rows, teams), report.calls(rows)]
        remarks = report.irregular(rows)
        files.write(folder.path, "games", files.games(rows, folder.again))
        parts = [f"# {sentence}", *map(report.markdown, tables), "\n".join(f"- {remark}" for remark in remarks)]
        for table in tables:
            show(console, table)
        if rows:
            words = game_of(folder.definition.game).score_words
            shares = [(now.games, now.share, now.low, now.high) for now in series.standings]
            scores, times = report.scores(rows, teams, words), report.times(rows)
            names = pairing.first, pairing.second
            plot_comparison(folder.path / "comparison.png", sentence, names, shares, scores, times)
        finish(console, folder, parts, rows, remarks)
        console.print(f"[bold]{escape(sentence)}[/bold]", soft_wrap=True)
