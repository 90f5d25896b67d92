"""The common part of `vrg compare` and `vrg tournament`: their options, and the course of an experiment."""

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
    LasersOption,
    OutputOption,
    SandboxOption,
    duration,
    make_console,
    print_table,
)
from vrg.config.targets import class_in, whole_target
from vrg.errors import ConfigError
from vrg.launch.fork_server import cores
from vrg.types import printable

if TYPE_CHECKING:
    from vrg.config.setup import CheckedMatch
    from vrg.evaluation.contenders import Contender
    from vrg.evaluation.experiment import Origin
    from vrg.evaluation.folder import ExperimentFolder
    from vrg.evaluation.games import GameRecord
    from vrg.evaluation.running import Experiment

PRINTED_EVERY = 20
"""The number of games after which the progress is printed, where the output is no terminal."""
FOLLOWED_EVERY = 2.0
"""The real time in s between two times at which what follows an experiment is called."""


@dataclass(frozen=True)
class EvaluationOptions:
    """The match of an experiment, and how its games are played."""

    match: Annotated[
        str | None, typer.Option("--match", metavar="GAME|match.toml", help="A match of two teams, or a game's name.")
    ] = None
    since: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="RUN@TIME", help="Play on from an instant of a run, in place of --match, as --team."
        ),
    ] = None
    team: Annotated[
        str | None, typer.Option(metavar="TEAM", help="The team that plays on from --from; the other one stays.")
    ] = None
    games: Annotated[
        int, typer.Option(min=1, help="The most games of two strategies; an odd number is rounded up.")
    ] = 200
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first pair of games; each next pair has the next.")] = 0
    jobs: Annotated[int | None, typer.Option(min=1, help="Games at a time; without it, one for each core.")] = None
    engine: EngineOption = None
    lasers: LasersOption = None
    output: OutputOption = None
    confidence: Annotated[float, typer.Option(min=0.5, max=0.9999, help="Confidence of the intervals.")] = 0.95
    play_all: Annotated[bool, typer.Option("--all", help="Play all games, even if a difference was found before.")] = (
        False
    )
    limit: Annotated[
        float, typer.Option(metavar=TIME, parser=duration(1), help="Match time after which a game is broken off.")
    ] = 3600.0
    ray: Annotated[
        str | None,
        typer.Option(
            "--ray",
            metavar="ADDRESS",
            help="Play on the cluster of Ray at this address, such as auto or 192.168.1.5:6379; local starts one here.",
        ),
    ] = None
    sandbox: SandboxOption = None


@contextmanager
def experiment(
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
    from vrg.evaluation import contenders
    from vrg.evaluation.experiment import define
    from vrg.evaluation.folder import ExperimentFolder
    from vrg.evaluation.game_process import seals
    from vrg.evaluation.games import Pairing
    from vrg.evaluation.running import Experiment
    from vrg.evaluation.series import Series
    from vrg.launch.sandbox.seal import missing

    console = make_console()
    if options.ray is not None:
        from vrg.evaluation.ray_workers import require_ray

        require_ray()
    setup, origin = _match_of(options)
    teams = [origin.team] if origin is not None else contenders.teams_of(setup)
    entered, left_out = _entered(targets, folders=leave_out)
    found = contenders.contenders([target for _, target in entered], [own for own, _ in entered])
    _check_number(found, left_out, targets, leave_out=leave_out)
    playing = [contenders.with_strategies(setup, dict.fromkeys(teams, contender.target)) for contender in found]
    if (lacking := missing()) is not None and any(map(seals, playing)):
        warning = f"strategies decide where the referee does, and can change it: {lacking}"
        if any(Path(target).is_dir() for target in targets):
            raise ConfigError([f"{warning}; --no-sandbox lets the files of a folder play all the same"])
        console.print(f"[yellow]{escape(warning)}[/yellow]", soft_wrap=True)
    if leave_out:
        console.print(f"{len(found)} strategies play {contenders.TRIAL:g} s alone, to see whether they can")
    lasting = contenders.TRIAL if leave_out else 0.0
    unable = contenders.unable(setup, found, options.jobs or cores(), match_time=lasting, teams=teams)
    left_out += [(contender.label, _line(why.problem)) for contender, why in unable.items()]
    found = [contender for contender in found if contender not in unable]
    _check_number(found, left_out, targets, leave_out=leave_out)
    for own, why in left_out:
        console.print(f"[yellow]left out: {escape(own)}: {escape(why)}[/yellow]", soft_wrap=True)
    definition = define(setup, found, seed=options.seed, limit=options.limit, origin=origin)
    labels = [contender.label for contender in found]
    pairs = [Pairing(a, b) for i, a in enumerate(labels) for b in labels[i if mirror else i + 1 :]]
    series = {p: Series((options.games + 1) // 2, options.confidence, play_all=options.play_all) for p in pairs}
    out = options.output or Path("runs") / f"{name}-{definition.digest}"
    with stop_on_signals() as stop, ExperimentFolder(out, definition) as folder:
        before = len(folder.rows)
        running = Experiment(folder, setup, series, left_out)
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
    from vrg.evaluation.contenders import teams_of
    from vrg.evaluation.experiment import origin_at

    if (options.match is None) == (options.since is None):
        raise ConfigError("expected --match GAME|match.toml, or --from RUN@TIME with --team TEAM, and not both")
    if options.since is None:
        match = match_path(options.match or "")
        if options.team is not None:
            raise ConfigError("--team: expected --from too: in a match from its beginning both teams are compared")
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
        raise ConfigError(f"--from: expected --team too: {' or '.join(teams_of(setup))}")
    teams_of(setup, options.team)
    origin = origin_at(folder, duration()(instant), options.team)
    if options.limit <= origin.time:
        raise ConfigError(f"--limit: expected more than the {origin.time:g} s at which the games go on")
    return setup, origin


def _entered(typed: Sequence[str], *, folders: bool) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """The name and the whole target of each strategy; and the name of each that cannot be found, with the reason.

    A file gives its strategy its own name.

    Args:
        folders: whether a folder stands for all files of Python and of policies in it.

    Raises:
        ConfigError: one is a folder, and may not be.
    """
    from vrg.games import STRATEGIES, is_strategy_file

    entered, wrong = list[tuple[str, str]](), list[tuple[str, str]]()
    for target in typed:
        folder = Path(target)
        for file in _files(folder) if folders and folder.is_dir() else [folder]:
            own = is_strategy_file(str(file))
            if file.suffix != ".py" and not own:
                whole = whole_target(target)
                if ":" in target or target in STRATEGIES:
                    entered.append((target.rpartition(":")[2], whole))
                else:
                    wrong.append((printable(target), _line(STRATEGIES.unknown(target))))
                continue
            try:
                str(file).encode()
                entered.append((file.stem, whole_target(str(file) if own else f"{file}:{class_in(file)}")))
            except UnicodeEncodeError:
                wrong.append((ascii(file.stem), "its name is not in UTF-8: give the file another one"))
            except ConfigError as error:
                wrong.append((printable(file.stem), _line(str(error))))
    return entered, wrong


def _files(folder: Path) -> list[Path]:
    """The files of strategies in a folder, except those whose names begin with `.` or `_`."""
    from vrg.games import is_strategy_file

    return [file for file in sorted(folder.glob("[!._]*")) if file.suffix == ".py" or is_strategy_file(file.name)]


def _line(why: str) -> str:
    """A reason in one line, without signs that control a terminal: others have written the names and words in it."""
    return printable(" ".join(why.split()))


def _check_number(
    found: "Sequence[Contender]", left_out: Sequence[tuple[str, str]], typed: Sequence[str], *, leave_out: bool
) -> None:
    """Check that enough strategies are there to play.

    Raises:
        ConfigError: there are not, or one cannot play where none may be left out.
    """
    if left_out and not leave_out:
        raise ConfigError(list(dict.fromkeys(why for _, why in left_out)))
    different = len({contender.target for contender in found})
    if different < (2 if leave_out else 1):
        expected = f"expected two or more different strategies, found {different} in {' '.join(typed)}"
        raise ConfigError([*(f"{own}: {why}" for own, why in left_out), expected])


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
    from vrg.evaluation import report
    from vrg.evaluation.workers import Workers

    if options.ray is not None:
        from vrg.evaluation.ray_workers import RayWorkers

        workers: Workers = RayWorkers(options.ray, options.jobs, cores(), running.folder)
    else:
        workers = Workers(options.jobs or cores(), running.folder, running.setup)
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("games, {task.fields[running]} running{task.fields[speed]}{task.fields[now]}"),
        TimeRemainingColumn(),
    )
    began, played, seconds, followed = time.monotonic(), 0, 0.0, 0.0
    console.print(report.schedule(running.series, workers.jobs, None), soft_wrap=True)
    follow(running, None)
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
    from vrg.evaluation.report import between, percent

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


def finish(
    console: Console,
    folder: "ExperimentFolder",
    parts: Sequence[str],
    rows: "Sequence[GameRecord]",
    remarks: Sequence[str],
) -> None:
    """Write the report, and tell what was irregular, how to watch a game, and which files there are.

    Args:
        parts: the parts of the report, as Markdown. rows: the games that count. remarks: what was irregular.

    Raises:
        LaunchError: the report cannot be written.
    """
    from vrg.evaluation.folder import write_text

    write_text(folder.path, "report.md", "\n\n".join(part.strip() for part in parts if part.strip()) + "\n")
    for remark in remarks:
        console.print(f"[yellow]{escape(remark)}[/yellow]", soft_wrap=True)
    if folder.failures.is_dir():
        console.print(f"Logs of games in which something failed: {folder.failures}", soft_wrap=True, markup=False)
    names = ", ".join(sorted(path.name for path in folder.path.iterdir() if path.is_file()))
    console.print(f"Written to {folder.path}: {names}", soft_wrap=True, markup=False)
    if rows:
        console.print(f"To watch a game: {folder.watch(rows[-1].game)}", soft_wrap=True, markup=False)
