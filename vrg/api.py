"""Matches as functions, for programs and notebooks: `vrg.play` and `vrg.judge`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from rich.console import Console

from vrg.bus.stopping import StopSignal
from vrg.config.loading import check_match, check_strategies, load_match, match_path
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError
from vrg.launch.fork_server import fork_server
from vrg.playing.launch import How, Launch
from vrg.playing.match import new_run, prepare
from vrg.playing.match import play as play_launch
from vrg.playing.run import Run
from vrg.playing.trial import trial
from vrg.runs.change import by_player
from vrg.runs.judged import Judged, judge_folder
from vrg.runs.run_folder import RunFolder
from vrg.toml_text import with_value


def play(
    match: str | Path,
    players: Mapping[str, str] | None = None,
    *,
    how: Literal["in process", "lockstep", "processes"] = "in process",
    engine: str | None = None,
    seed: int | None = None,
    rate: float | Literal["max"] | None = None,
    record: bool = True,
    sandbox: bool | None = None,
    runs: str | Path = "runs",
    stop: StopSignal | None = None,
) -> Run:
    """Play a match to its end, in any thread.

    Args:
        match: a match file, or the name of a game.
        players: other strategies than those of the match file, by team or by player: a name, `mine.py`,
            `mine.py:Class`, `module:Class` or `policy.npz`.
        how: `in process`: all of it in this process, as fast as it can, but for strategies that are files: these
            decide in processes of their own. `lockstep`: the same match, byte for byte, but each strategy does.
            `processes`: as `vrg play` does, in real time or at a rate.
        engine: the physics engine; None for that of the match. seed: None for that of the match.
        rate: match seconds per second; `max` as fast as possible, which is the default but for `processes`.
        record: record the match; without it a run has no tracks and no plot.
        sandbox: whether strategies that are files are sealed in their processes; None for the match's own choice. With
            False, and `in process`, they are trusted, and decide in this process, which is faster.
        runs: the folder for the run folder.
        stop: what breaks the match off when it is set, such as a `threading.Event`. The run then has what was played.

    Raises:
        ConfigError: the match file or the options have problems.
        LaunchError: a process does not start, or dies too often; what was played until then is in the run folder.
        KeyboardInterrupt: the match was broken off by Ctrl-C, which only the main thread hears; its processes have
            ended, and the run is kept.
    """
    if how not in tuple(How):
        raise ConfigError([f"how: expected one of {', '.join(How)}, got {how!r}"])
    way = How(how)
    if rate == "max" and way is How.PROCESSES:
        raise ConfigError(["rate: expected a number, because the match clock paces the processes, got 'max'"])
    number = None if rate == "max" else rate
    setup = load_match(match_path(str(match)), engine=engine, seed=seed, rate=number, sandbox=sandbox)
    setup = played_by(setup, players or {})
    launch = Launch(
        setup=setup.all_here() if way is How.IN_PROCESS else setup, how=way, console=Console(quiet=True),
        record=record, paced=number is not None, trusted=sandbox is False,
        secured=way is How.PROCESSES and setup.has_seats,
    )  # fmt: skip
    with fork_server(wanted=way is not How.IN_PROCESS) as server:
        launch = prepare(launch, server)
        if way is How.PROCESSES:
            with trial() as tried:
                check_strategies(launch.setup, tried.make)
        folder = new_run(launch, Path(runs))
        played = play_launch(launch, folder, server, stop)
    if played.interrupted and not played.over and not (stop is not None and stop.is_set()):
        raise KeyboardInterrupt(f"the run is kept in {folder.path}")
    return Run(folder.path)


def played_by(setup: CheckedMatch, players: Mapping[str, str]) -> CheckedMatch:
    """The same match with other strategies, by team or by player, as `play` takes them.

    They are in its text, so that the run folder has the match as it was played.

    Raises:
        ConfigError: there is no such player or team, or a strategy cannot be used.
    """
    text, names = setup.text, [player.name for player in setup.players]
    for name, strategy in by_player(setup, players).items():
        text = with_value(text, ("players", names.index(name), "strategy"), strategy)
    return check_match(text, Path(setup.origin), Path(setup.base)) if players else setup


def judge(run: Run | str | Path) -> Judged:
    """Let the rule book judge a run again, and compare its recording with what the referee decided by.

    Raises:
        LaunchError: it is no run folder, or has no evidence. JournalError: its files are damaged.
    """
    of = run if isinstance(run, Run) else Run(run)
    return judge_folder(RunFolder(of.path), of.setup)
