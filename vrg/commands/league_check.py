"""The command `vrg league check`: the judge of a league, on an author's own computer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.markup import escape

from vrg.bus.stopping import stop_on_signals
from vrg.commands.options import EngineOption, LasersOption, exit_if_interrupted, make_console
from vrg.config.targets import whole_target
from vrg.errors import ConfigError
from vrg.launch.fork_server import cores

if TYPE_CHECKING:
    from rich.console import Console

    from vrg.config.setup import CheckedMatch
    from vrg.evaluation.contenders import Contender

JobsOption = Annotated[int | None, typer.Option(min=1, help="Games at a time; without it, one for each core.")]
LIMIT: Final = 3600.0
"""The match time in s after which a game is broken off, unless the league was made with another one."""


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file of a strategy, or a folder with one.")],
    match: Annotated[
        str, typer.Option("--match", metavar="GAME|match.toml", help="A match of two teams, or a game's name.")
    ] = "",
    league: Annotated[
        Path | None, typer.Option("--league", help="Folder of a league whose match it plays, against its leader.")
    ] = None,
    engine: EngineOption = None,
    lasers: LasersOption = None,
    jobs: JobsOption = None,
) -> None:
    """Do with a strategy what a league does: read it, let it play alone, and let it play both sides of a game, sealed.

    The opponents are the strategies that come with the game, or the leader of a league.
    """
    from vrg.config.loading import load_match, match_path
    from vrg.launch.sandbox.seal import missing
    from vrg.runs.run_folder import scratch_folder

    console = make_console()
    if bool(match) == (league is not None):
        raise ConfigError(["expected either --match, such as `--match roboflag`, or --league"])
    if league is not None and (engine is not None or lasers is not None):
        raise ConfigError(["expected neither --engine nor --lasers: a league has its own"])
    if league is not None and not (_folder_of(league) / "versions.jsonl").is_file():
        raise ConfigError([f"--league: expected the folder of a league, found none in {league}"])
    kept = None if league is None else match_of(_folder_of(league))
    setup = kept or load_match(match_path(match), engine=engine or "planar", lasers=lasers)
    if (lacking := missing()) is not None:
        console.print(f"[yellow]it is not sealed as in a league: {escape(lacking)}[/yellow]", soft_wrap=True)
    with scratch_folder() as place:
        problems = _checked(console, file, setup, league, place, jobs or cores())
    if problems:
        for problem in problems:
            console.print(problem, markup=False, soft_wrap=True)
        raise typer.Exit(1)
    console.print("[bold]it can play in a league[/bold]")


def match_of(out: Path, *, lasers: bool | None = None) -> "CheckedMatch":
    """The match of a league.

    Args:
        out: the folder of the league. lasers: in place of its own setting.

    Raises:
        ConfigError: there is none.
    """
    from vrg.config.loading import load_match

    return load_match(out / "match" / "match.toml", lasers=lasers)


def _folder_of(folder: Path) -> Path:
    """The folder of a league, by that of its entries or by itself."""
    return folder if (folder / "versions.jsonl").is_file() else folder / "league"


def _opponents(setup: "CheckedMatch", league: Path | None) -> "list[Contender]":
    """The leader of a league, or else the strategies that come with the game."""
    from vrg.evaluation.contenders import Contender
    from vrg.evaluation.folder import read_records
    from vrg.evaluation.games import GameRecord
    from vrg.evaluation.league_folder import Version, playing, targets
    from vrg.evaluation.standings import ratings
    from vrg.games import strategies_of

    if league is None:
        return [Contender(label=name, target=name) for name in strategies_of(setup.game)]
    out = _folder_of(league)
    versions = read_records(out / "versions.jsonl", Version)
    known = targets(out, versions)
    current = {version.label for version in playing(versions).values()}
    rated = [r.label for r in ratings(list(known), read_records(out / "games.jsonl", GameRecord)) if r.label in current]
    return [Contender(label=label.replace(".", " "), target=known[label]) for label in rated[:1]]


def _checked(
    console: "Console", file: Path, setup: "CheckedMatch", league: Path | None, place: Path, jobs: int
) -> list[str]:
    """Check a strategy, and return what is wrong with it, in words.

    Args:
        place: a folder for what is written. jobs: the number of games at a time.

    Raises:
        ConfigError: the match or the league cannot be used.
    """
    from vrg.evaluation.contenders import TRIAL, Contender, contenders, unable
    from vrg.evaluation.entries import read_entry
    from vrg.evaluation.experiment import define
    from vrg.evaluation.folder import ExperimentFolder
    from vrg.evaluation.games import Pairing
    from vrg.evaluation.league import failed_games
    from vrg.evaluation.running import Experiment
    from vrg.evaluation.series import Series
    from vrg.evaluation.workers import Workers

    source = read_entry(file)
    if source is None:
        return [f"{file}: expected the file of a strategy, such as mine.py, or a folder with one"]
    if source.problem:
        return [f"it cannot be read: {source.problem}"]
    copy = place / "entry"
    for name, data in source.files.items():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_bytes(data)
    number = "1 file" if len(source.files) == 1 else f"{len(source.files)} files"
    console.print(f"{escape(source.name)}: {number}, SHA-256 {source.digest[:12]}...", soft_wrap=True)
    try:
        own = Contender(label=source.entry, target=whole_target(str(copy / source.main)))
    except ConfigError as error:
        return [str(error).replace(f"{copy}/", "")]
    console.print(f"it plays {TRIAL:g} s alone")
    if why := unable(setup, [own], jobs, match_time=TRIAL).get(own):
        return [f"it fails alone: {why.problem}".replace(f"{copy}/", "")]
    opponents = _opponents(setup, league)
    if not opponents:
        console.print("nothing in the league plays yet: there is no opponent")
        return []
    both = [own, *opponents]
    own, *others = found = contenders([one.target for one in both], [one.label for one in both])
    series = {Pairing(own.label, other.label): Series(1, 0.95, play_all=True) for other in others}
    with (
        stop_on_signals() as stop,
        ExperimentFolder(place / "games", define(setup, found, seed=0, limit=LIMIT)) as folder,
    ):
        played = Experiment(folder, setup, series)
        played.run(Workers(jobs, folder, played.setup), stop, lambda _: None)
        for row in played.rows():
            result = {1.0: "won", 0.5: "drawn", 0.0: "lost"}[row.points]
            score = " : ".join(str(row.played.score.get(t, "-")) for t in (row.game.first_team, row.game.second_team))
            line = f"as {row.game.first_team} against {row.game.pairing.second}: {result}, {score}"
            console.print(line, markup=False, soft_wrap=True)
        exit_if_interrupted(stop)
        return [part.replace(f"{copy}/", "") for part in failed_games(folder, {own.label})]
