"""The command `vrg league`: a tournament that goes on for weeks, between strategies that their authors change."""

import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.markup import escape

from vrg.bus.stopping import stop_on_signals
from vrg.commands.groups import CommandGroup
from vrg.commands.options import (
    TIME,
    EngineOption,
    duration,
    exit_if_interrupted,
    lasting,
    make_console,
    stoppable,
)
from vrg.errors import ConfigError
from vrg.launch.fork_server import cores
from vrg_league.compare_command import JobsOption, LasersOption, TeamMatchOption, show

if TYPE_CHECKING:
    from collections.abc import Sequence

    from vrg_league.entries import Source
    from vrg_league.games import GameRecord

app = CommandGroup(no_args_is_help=True)

WRITTEN_EVERY: Final = 15.0
"""The real time in s between two times at which the pages are written."""

LeagueOption = Annotated[
    Path | None, typer.Option("--output", "-o", help="Folder of the league; by default FOLDER/league.")
]
PagesOption = Annotated[Path | None, typer.Option(help="Folder of the pages; by default `pages` in the league's.")]
FolderArgument = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the authors' files.")]


@dataclass(frozen=True)
class SettingOptions:
    """The settings of a league, which are fixed when it is made."""

    match: TeamMatchOption = None
    engine: EngineOption = None
    lasers: LasersOption = None
    limit: Annotated[
        float | None,
        typer.Option(metavar=TIME, parser=duration(1), help="Match time after which a game is broken off, an hour."),
    ] = None
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the first pair of games of two versions, 0.")] = None


@app.command()
def play(
    folder: FolderArgument,
    settings: SettingOptions,
    games: Annotated[int | None, typer.Option(min=1, help="Games of this call; 100 without --for.")] = None,
    seconds: Annotated[float | None, lasting("Real time during which games of this call begin.", least=1)] = None,
    jobs: JobsOption = None,
    output: LeagueOption = None,
    pages: PagesOption = None,
    new_release: Annotated[bool, typer.Option("--new-release", help="Continue although VRG has changed.")] = False,
) -> None:
    """Take in the authors' changes, play the games that make the ratings certain fastest, and write the pages.

    The first call makes the league, and needs --match. Each call continues where the one before stopped.
    """
    from vrg.launch.sandbox.seal import missing
    from vrg_league import report, standings
    from vrg_league.contenders import TRIAL
    from vrg_league.league.league import League, admit, entries_of, write_errors
    from vrg_league.league.pages import LeaguePages
    from vrg_league.league.settings import match_of, open_league
    from vrg_league.workers import Workers

    console, out = make_console(), output or folder / "league"
    if not folder.is_dir():
        raise ConfigError([f"{folder}: expected a folder of strategies, found none"])
    if (lacking := missing()) is not None:
        raise ConfigError([f"a league sandboxes the code of its entries, which this machine cannot do: {lacking}"])
    where = pages or out / "pages"
    most = 100 if games is None and seconds is None else games
    until = None if seconds is None else time.monotonic() + seconds
    with open_league(out, **vars(settings), new_release=new_release) as league_folder:
        sources = entries_of(league_folder, folder, where)
        setup = match_of(league_folder.path)
        console.print(f"{len(sources)} entries; each new version plays {TRIAL:g} s alone before it takes part")
        for version in admit(league_folder, setup, sources, _now(), jobs or cores()):
            what = "plays from now on" if not version.problem else "does not pass the check"
            console.print(f"{escape(version.entry)}: version {version.number} {what}", soft_wrap=True)

        def more(started: int) -> bool:
            return (most is None or started < most) and (until is None or time.monotonic() < until)

        league = League(league_folder, setup, {source.entry for source in sources}, more)
        site = LeaguePages(where, league, f"League {folder.resolve().name}, {league_folder.definition.game}")

        def write(*, reloads: bool) -> None:
            now = _now()
            site.write(now, reloads=reloads)
            write_errors(league_folder, sources, now)

        write(reloads=True)
        if resting := league.resting:
            console.print(f"withdrawn, so that they play no more: {escape(', '.join(resting))}", soft_wrap=True)
        if len(league.active) < 2:
            console.print(f"{len(league.active)} of the entries can play: it takes two for a game", soft_wrap=True)
        before, written = len(league.rows), time.monotonic()
        with stop_on_signals() as stop:

            def finished(_: object) -> None:
                nonlocal written
                if time.monotonic() - written > WRITTEN_EVERY:
                    console.print(f"{len(league.rows) - before} games played", soft_wrap=True)
                    write(reloads=True)
                    written = time.monotonic()

            if len(league.active) > 1:
                league.run(Workers(jobs or cores(), league_folder, setup), stop, finished)
            write(reloads=False)
            show(console, standings.board(league.table, league.rows, standings.thinking(league.rows)))
            for remark in report.computed(league.rows):
                console.print(escape(remark), soft_wrap=True)
            words = f"{len(league.rows) - before} games played, {len(league.rows)} in all"
            console.print(f"{words}; the table: {where / 'index.html'}", soft_wrap=True, markup=False)
        exit_if_interrupted(stop)


@app.command()
def improve(
    folder: FolderArgument,
    authors: Annotated[Path, typer.Argument(metavar="AUTHORS", help="The file of the authors, such as authors.toml.")],
    output: LeagueOption = None,
) -> None:
    """Let authors that are programs write the next versions of their entries, from a report of their games.

    Each runs in a folder of its own in the league's, shut off from other files and from the network, and is noted in
    `authors/turns.jsonl` there. `vrg league play` then takes in what they have changed.
    """
    from vrg_league.league.author_process import lacking
    from vrg_league.league.authors import note, read_authors, report, table_of, write_version
    from vrg_league.league.league import League
    from vrg_league.league.settings import match_of, open_league

    console, out, wanted = make_console(), output or folder / "league", read_authors(authors)
    if not folder.is_dir():
        raise ConfigError([f"{folder}: expected a folder of strategies, found none"])
    if (why := lacking()) is not None:
        raise ConfigError([f"a league sandboxes its authors, which this machine cannot do: {why}"])
    turns, place = [], out / "authors"
    with open_league(out) as league_folder, stoppable() as stop:
        league = League(league_folder, match_of(out), wanted.authors.keys(), lambda _: False)
        for name, author in wanted.authors.items():
            if stop.is_set():
                break
            console.print(f"{name} writes ...", markup=False)
            about = report(league, name, publish=wanted.publish)
            turns.append(write_version(name, author, authors.parent, folder, place, about, stop.wait))
            note(place, turns[-1])
    show(console, table_of(turns))
    console.print(f"what they have printed: {place / 'turns.jsonl'}", soft_wrap=True, markup=False)


@app.command()
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file of a strategy, or a folder with one.")],
    match: TeamMatchOption = None,
    league: Annotated[
        Path | None, typer.Option("--league", help="Folder of a league whose match it plays, against its leader.")
    ] = None,
    engine: EngineOption = None,
    lasers: LasersOption = None,
    jobs: JobsOption = None,
) -> None:
    """Check a strategy as a league does: read it, let it play alone and both sides of a game, in a sandbox.

    The opponents are the strategies that come with the game, or the leader of a league.
    """
    from vrg.config.loading import load_match, match_path
    from vrg.launch.sandbox.seal import missing
    from vrg.runs.run_folder import scratch_folder
    from vrg_league.contenders import TRIAL
    from vrg_league.games import OUTCOMES
    from vrg_league.league.check import BrokenOffError, check_entry
    from vrg_league.league.settings import match_of

    console = make_console()
    if bool(match) == (league is not None):
        raise ConfigError(["expected either --match, such as `--match roboflag`, or --league"])
    if league is not None and (engine is not None or lasers is not None):
        raise ConfigError(["expected neither --engine nor --lasers: a league has its own"])
    if league is not None and not (league / "versions.jsonl").is_file():
        league = league / "league"
        if not (league / "versions.jsonl").is_file():
            raise ConfigError([f"--league: expected the folder of a league, found none in {league.parent}"])
    if league is None:
        setup = load_match(match_path(match or ""), engine=engine or "planar", lasers=lasers)
    else:
        setup = match_of(league)
    if (lacking := missing()) is not None:
        console.print(f"[yellow]it is not sandboxed as in a league: {escape(lacking)}[/yellow]", soft_wrap=True)

    def read(source: "Source") -> None:
        number = "1 file" if len(source.files) == 1 else f"{len(source.files)} files"
        console.print(f"{escape(source.name)}: {number}, SHA-256 {source.digest[:12]}...", soft_wrap=True)

    def tries() -> None:
        console.print(f"it plays {TRIAL:g} s alone")

    def played(rows: "Sequence[GameRecord] | None") -> None:
        if rows is None:
            console.print("nothing in the league plays yet: there is no opponent")
        for row in rows or ():
            game = row.game
            score = row.score((game.first_team, game.second_team))
            line = f"as {game.first_team} against {game.pairing.second}: {OUTCOMES[row.points]}, {score}"
            console.print(f"{line}, seed {game.seed}", markup=False, soft_wrap=True)

    try:
        with scratch_folder() as place:
            problems = check_entry(file, setup, league, place, jobs or cores(), read=read, tries=tries, played=played)
    except KeyboardInterrupt:
        raise typer.Exit(130) from None
    except BrokenOffError as error:
        console.print(str(error), soft_wrap=True)
        raise typer.Exit(error.status) from None
    if problems:
        for problem in problems:
            console.print(problem, markup=False, soft_wrap=True)
        raise typer.Exit(1)
    console.print("[bold]it can play in a league[/bold]")


def _now() -> str:
    """The local wall time."""
    return f"{datetime.now():%Y-%m-%d %H:%M}"
