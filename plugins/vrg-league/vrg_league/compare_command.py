"""The commands `vrg compare` and `vrg tournament`, which find out which of two or more strategies is better."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import structs
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from vrg.bus.stopping import Stop, stop_on_signals
from vrg.commands.matches import ended_run
from vrg.commands.options import (
    TIME,
    EngineOption,
    OutputOption,
    SandboxOption,
    StrategyArgument,
    duration,
    make_console,
    print_table,
)
from vrg.errors import ConfigError
from vrg_league.games import LIMIT

if TYPE_CHECKING:
    from vrg.config.setup import CheckedMatch
    from vrg_league.experiment import Origin
    from vrg_league.folder import ExperimentFolder
    from vrg_league.games import GameRecord
    from vrg_league.running import Experiment

PRINTED_EVERY = 20
"""The number of games after which the progress is printed, where the output is no terminal."""
ROUGH = 20
"""The number of games after which a clear difference is seen, and a small one is not."""
FOLLOWED_EVERY = 2.0
"""The real time in s between two times at which what follows an experiment is called."""
MOST_CROSSED = 8
"""The number of strategies up to which the cross table is printed; the report always has it."""

TeamMatchOption = Annotated[
    str | None, typer.Option("--match", metavar="GAME|match.toml", help="A match of two teams, or a game's name.")
]
LasersOption = Annotated[
    bool | None, typer.Option("--lasers/--no-lasers", help="Simulate lasers, or not, whatever the match file says.")
]
JobsOption = Annotated[int | None, typer.Option(min=1, help="Games at a time; the default is one for each core.")]


@dataclass(frozen=True)
class EvaluationOptions:
    """The match of an experiment, and how its games are played."""

    match: TeamMatchOption = None
    since: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="RUN@TIME", help="Play on from an instant of a run, in place of --match, as --team."
        ),
    ] = None
    team: Annotated[str | None, typer.Option(metavar="TEAM", help="The team whose strategies vary with --from.")] = None
    games: Annotated[
        int, typer.Option(min=1, help="The most games between two strategies; an odd number is rounded up.")
    ] = 200
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first pair of games; each next pair has the next.")] = 0
    jobs: JobsOption = None
    engine: EngineOption = None
    lasers: LasersOption = None
    output: OutputOption = None
    confidence: Annotated[float, typer.Option(min=0.5, max=0.9999, help="Confidence of the intervals.")] = 0.95
    play_all: Annotated[bool, typer.Option("--all", help="Play all games, even if a difference was found before.")] = (
        False
    )
    limit: Annotated[
        float, typer.Option(metavar=TIME, parser=duration(1), help="Match time after which a game is broken off.")
    ] = LIMIT
    ray: Annotated[
        str | None,
        typer.Option(
            "--ray",
            metavar="ADDRESS",
            help="Play on the cluster of Ray at this address, such as auto or 192.168.1.5:6379; local starts one here. "
            "It needs virtual-robotic-games-league[ray].",
        ),
    ] = None
    sandbox: SandboxOption = None


def compare(first: StrategyArgument, second: StrategyArgument, options: EvaluationOptions) -> None:
    """Let two strategies play many games, each seed twice with the sides swapped, until one is shown to be better.

    If it is interrupted, the same command continues where it stopped.
    """
    from vrg_league.comparison import Comparison

    with _experiment([first, second], options, "compare") as played:
        console, found = make_console(), Comparison(played, options.confidence)
        for table in found.tables:
            show(console, table)
        found.write()
        _finish(console, played.folder, found.rows, found.remarks)
        console.print(f"[bold]{escape(found.sentence)}[/bold]", soft_wrap=True)


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
    """Let every strategy play against every other one, as `vrg compare` does, and rate them all.

    A strategy that cannot play is named and left out. `leaderboard.html` in the folder shows the progress. If the
    tournament is interrupted, the same command continues where it stopped.
    """
    from vrg_league import standings
    from vrg_league.tournament import Tournament, write_leaderboard

    with _experiment(
        strategies, options, "tournament", mirror=mirror, leave_out=True, follow=write_leaderboard
    ) as played:
        console, found = make_console(), Tournament(played, options.confidence)
        show(console, found.board)
        if len(found.rated) <= MOST_CROSSED:
            show(console, found.table)
            for sentence in found.sentences:
                console.print(escape(sentence), soft_wrap=True)
        found.write()
        _finish(console, played.folder, found.rows, found.remarks)
        console.print(f"[bold]{escape(standings.ranking(found.rated))}[/bold]", soft_wrap=True)


@contextmanager
def _experiment(
    targets: Sequence[str],
    options: EvaluationOptions,
    name: str,
    *,
    mirror: bool = False,
    leave_out: bool = False,
    follow: "Callable[[Experiment, float | None], None]" = lambda *_: None,
) -> "Iterator[Experiment]":
    """Play an experiment of all pairings of some strategies, and let the caller conclude it.

    Args:
        targets: the strategies as they were typed. name: the beginning of the name of its folder.
        mirror: True lets each strategy play against itself, too.
        leave_out: True leaves out strategies that cannot play, or fail in a trial; False ends the command by the first.
        follow: called before the first game and then again and again, with the real time in s that is left at most;
            None before a game has been measured.

    Raises:
        ConfigError: the match or a strategy cannot be used, too few are left, or the folder is that of another
            experiment.
        LaunchError: the folder cannot be used.
        typer.Exit: at the end of the context, with status 130, if the experiment was interrupted.
    """
    from vrg_league.conduct import enter, opened
    from vrg_league.contenders import TRIAL

    console = make_console()
    if options.ray is not None:
        from vrg_league.workers import WORKERS

        WORKERS.get("ray").require()
    setup, origin = _match_of(options)

    def tries(number: int) -> None:
        console.print(f"{number} strategies play {TRIAL:g} s alone, to check whether they can play")

    def warn(text: str) -> None:
        console.print(f"[yellow]{escape(text)}[/yellow]", soft_wrap=True)

    teams = None if origin is None else [origin.team]
    entrants = enter(targets, setup, jobs=options.jobs, warn=warn, tries=tries, teams=teams, leave_out=leave_out)
    for own, why in entrants.left_out:
        warn(f"left out: {own}: {why}")
    with (
        stop_on_signals() as stop,
        opened(
            setup, entrants, entrants.pairings(mirror=mirror), options.output or name, games=options.games,
            seed=options.seed, confidence=options.confidence, play_all=options.play_all, limit=options.limit,
            origin=origin,
        ) as running,
    ):  # fmt: skip
        out, before = running.folder.path, len(running.folder.rows)
        console.print(
            f"{setup.name}: {setup.game}, {setup.engine}, from seed {options.seed}; games in {out}", soft_wrap=True
        )
        if before:
            console.print(f"{before} games are in {out} already")
        _play(running, options, stop, console, follow)
        yield running
        if stop.is_set():
            raise typer.Exit(130)


def _match_of(options: EvaluationOptions) -> "tuple[CheckedMatch, Origin | None]":
    """The match of an experiment, and the instant from which its games go on; None for its beginning.

    Raises:
        ConfigError: the options do not fit together, or the match cannot be used.
        LaunchError: there is no such run, or it cannot be taken up there.
    """
    from vrg.config.loading import load_match, match_path
    from vrg_league.contenders import teams_of
    from vrg_league.experiment import origin_at

    if (options.match is None) == (options.since is None):
        raise ConfigError("expected --match GAME|match.toml, or --from RUN@TIME with --team TEAM, and not both")
    if options.since is None:
        match = match_path(options.match or "")
        if options.team is not None:
            raise ConfigError("--team needs --from: from the beginning of a match, both teams are compared")
        engine = options.engine or "planar"
        return load_match(match, engine=engine, lasers=options.lasers, sandbox=options.sandbox), None
    if options.engine is not None or options.lasers is not None:
        raise ConfigError("--from: expected no --engine and no --lasers or --no-lasers: they are those of the run")
    run, at, instant = options.since.rpartition("@")
    if not at:
        raise ConfigError(f"--from: expected RUN@TIME, such as {options.since}@1:20")
    if options.ray is not None:
        raise ConfigError("--ray: expected no --from: the run folder is on this computer alone")
    folder, played = ended_run(Path(run))
    setup = load_match(folder.match_file, engine=played.engine, sandbox=options.sandbox)
    if options.sandbox is None:
        setup = structs.replace(setup, sandbox=None)  # the run may be a stranger's, and its match file with it
    if options.team is None:
        raise ConfigError(f"--from needs --team: {' or '.join(teams_of(setup))}")
    teams_of(setup, options.team)
    origin = origin_at(folder, duration()(instant), options.team)
    if options.limit <= origin.time:
        raise ConfigError(f"--limit: expected more than the {origin.time:g} s at which the games continue")
    return setup, origin


def _play(
    running: "Experiment",
    options: EvaluationOptions,
    stop: Stop,
    console: Console,
    follow: "Callable[[Experiment, float | None], None]",
) -> None:
    """Play what is missing, and show how it goes."""
    if running.over:
        return
    from vrg_league import report
    from vrg_league.conduct import workers_of

    workers = workers_of(running, options.jobs, options.ray)
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("games, {task.fields[running]} running{task.fields[speed]}{task.fields[now]}"),
        TimeRemainingColumn(),
    )
    many = running.total - running.completed > ROUGH
    minute = workers.minute(running.setup, stop) if many and running.folder.definition.origin is None else None
    console.print(report.schedule(running.series, workers.jobs, None, minute), soft_wrap=True)
    if options.games > ROUGH:
        console.print(f"Ctrl-C keeps what was played; --games {ROUGH} gives a rough answer soon", soft_wrap=True)
    follow(running, None)
    began, played, seconds, followed = time.monotonic(), 0, 0.0, 0.0
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("games", total=running.total, running=0, speed="", now=_now(running))
        progress.update(bar, completed=running.completed)

        def finished(row: "GameRecord") -> None:
            nonlocal played, seconds, followed
            played += 1
            seconds += row.played.match_time or 0.0
            took = time.monotonic() - began
            speed = f", {played / took:.2f} a second, {seconds / took:.0f} times real time"
            completed, total = running.completed, running.total
            left = (total - completed) * took / played
            progress.update(bar, completed=completed, total=total, speed=speed, now=_now(running))
            if played == 2 * workers.jobs:
                console.print(report.schedule(running.series, workers.jobs, left), soft_wrap=True)
            if not console.is_terminal and played % PRINTED_EVERY == 0:
                until = f", {report.lasting(left)} left at most"
                console.print(f"{completed} of at most {total} games{speed}{_now(running)}{until}", soft_wrap=True)
            if took - followed > FOLLOWED_EVERY:
                follow(running, left)
                followed = time.monotonic() - began

        def looked(games: int) -> None:
            progress.update(bar, running=games)

        running.run(workers, stop, finished, looked)
    if played:
        took = time.monotonic() - began
        how = f"{workers.jobs} at a time" + ("" if options.ray is None else f" on the cluster {options.ray}")
        console.print(f"{played} games played in {took:.0f} s ({played / took:.2f} a second, {how})")


def _now(running: "Experiment") -> str:
    """The present result, in a few words."""
    from vrg_league.report import between, percent

    [*all_series] = running.series.items()
    if len(all_series) > 1:
        return f", {sum(series.over for _, series in all_series)} of {len(all_series)} pairings done"
    [(pairing, series)] = all_series
    if not series.standings:
        return ""
    standing = series.standings[-1]
    return f", {pairing.first} has {percent(standing.share)} ({between(standing.low, standing.high)})"


def show(console: Console, table: Sequence[Sequence[str]]) -> None:
    """Print a table of texts, whose first row is the head."""
    if len(table) > 1:
        print_table(console, table[0], table[1:], right=range(1, len(table[0])))


def _finish(console: Console, folder: "ExperimentFolder", rows: "Sequence[GameRecord]", remarks: Sequence[str]) -> None:
    """Tell what was irregular, how to watch a game, and which files there are.

    Args:
        rows: the games that count. remarks: what was irregular.
    """
    for remark in remarks:
        console.print(f"[yellow]{escape(remark)}[/yellow]", soft_wrap=True)
    if folder.failures.is_dir():
        console.print(f"Logs of games in which something failed: {folder.failures}", soft_wrap=True, markup=False)
    names = ", ".join(sorted(path.name for path in folder.path.iterdir() if path.is_file()))
    console.print(f"Written to {folder.path}: {names}", soft_wrap=True, markup=False)
    if rows:
        console.print(f"To watch a game: {folder.watch(rows[-1].game)}", soft_wrap=True, markup=False)
