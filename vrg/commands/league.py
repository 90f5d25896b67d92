"""The command `vrg league`: a tournament that goes on for weeks, between strategies that their authors change."""

import secrets
import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.markup import escape

from vrg.bus.stopping import stop_on_signals
from vrg.commands.evaluating import show
from vrg.commands.groups import CommandGroup
from vrg.commands.league_check import LIMIT, JobsOption, check, match_of
from vrg.commands.options import (
    TIME,
    EngineOption,
    LasersOption,
    duration,
    exit_if_interrupted,
    lasting,
    make_console,
)
from vrg.config.targets import whole_target
from vrg.errors import ConfigError
from vrg.launch.fork_server import cores

if TYPE_CHECKING:
    from vrg.commands.league_pages import LeaguePages
    from vrg.config.setup import CheckedMatch
    from vrg.evaluation.entries import Source
    from vrg.evaluation.league import League
    from vrg.evaluation.league_folder import LeagueFolder

app = CommandGroup(no_args_is_help=True)

WRITTEN_EVERY: Final = 15.0
"""The real time in s between two times at which the pages are written."""

LeagueOption = Annotated[
    Path | None, typer.Option("--output", "-o", help="Folder of the league; `league` in that of the entries.")
]
PagesOption = Annotated[Path | None, typer.Option(help="Folder of the pages; `pages` in the league's.")]
FolderArgument = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the authors' files.")]


@dataclass(frozen=True)
class SettingOptions:
    """The settings of a league, which are fixed when it is made."""

    match: Annotated[
        str | None, typer.Option("--match", metavar="GAME|match.toml", help="A match of two teams, or a game's name.")
    ] = None
    engine: EngineOption = None
    lasers: LasersOption = None
    limit: Annotated[
        float | None,
        typer.Option(metavar=TIME, parser=duration(1), help="Match time after which a game is broken off; an hour."),
    ] = None
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the first pair of games of two versions; 0.")] = None


@app.command()
def play(
    folder: FolderArgument,
    settings: SettingOptions,
    games: Annotated[int | None, typer.Option(min=1, help="Games of this call; 100 without --for.")] = None,
    seconds: Annotated[float | None, lasting("Real time in which games of this call begin.", least=1)] = None,
    jobs: JobsOption = None,
    output: LeagueOption = None,
    pages: PagesOption = None,
    new_release: Annotated[bool, typer.Option("--new-release", help="Go on, although VRG has changed.")] = False,
) -> None:
    """Take in what authors have changed, play those games that make the ratings certain fastest, and write the pages.

    The first call makes the league, and needs --match. Each call goes on where the one before has stopped.
    """
    from vrg.commands.league_pages import LeaguePages
    from vrg.evaluation import standings
    from vrg.evaluation.contenders import TRIAL
    from vrg.evaluation.entries import entries_in
    from vrg.evaluation.league import League, admit
    from vrg.evaluation.league_folder import playing
    from vrg.evaluation.workers import Workers
    from vrg.launch.sandbox.seal import missing

    console, out = make_console(), output or folder / "league"
    if not folder.is_dir():
        raise ConfigError([f"{folder}: expected a folder of strategies, found none"])
    if (lacking := missing()) is not None:
        raise ConfigError([f"a league seals the code of its entries, which this machine cannot do: {lacking}"])
    where = pages or out / "pages"
    most = 100 if games is None and seconds is None else games
    until = None if seconds is None else time.monotonic() + seconds
    with _opened(out, settings, new_release=new_release) as league_folder:
        owners = {entry: version.file for entry, version in playing(league_folder.versions).items()}
        sources = entries_in(folder, without=(out.resolve(), where.resolve()), owner=lambda name: owners.get(name, ""))
        setup = match_of(league_folder.path)
        console.print(f"{len(sources)} entries; each new version plays {TRIAL:g} s alone before it takes part")
        for version in admit(league_folder, setup, sources, whole_target, _now(), jobs or cores()):
            what = "plays from now on" if not version.problem else "does not pass the check"
            console.print(f"{escape(version.entry)}: version {version.number} {what}", soft_wrap=True)

        def more(started: int) -> bool:
            return (most is None or started < most) and (until is None or time.monotonic() < until)

        league = League(league_folder, setup, {source.entry for source in sources}, more)
        site = LeaguePages(where, league, f"League {folder.resolve().name}, {league_folder.definition.game}")
        _write(league, site, sources, reloads=True)
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
                    _write(league, site, sources, reloads=True)
                    written = time.monotonic()

            if len(league.active) > 1:
                league.run(Workers(jobs or cores(), league_folder, setup), stop, finished)
            _write(league, site, sources, reloads=False)
            table = [r for r in standings.rated(league.fit) if r.label in {v.label for v in league.playing.values()}]
            show(console, standings.board(table, league.rows))
            words = f"{len(league.rows) - before} games played, {len(league.rows)} in all"
            console.print(f"{words}; the table: {where / 'index.html'}", soft_wrap=True, markup=False)
        exit_if_interrupted(stop)


app.command()(check)


def _opened(out: Path, settings: SettingOptions, *, new_release: bool) -> "LeagueFolder":
    """The open folder of a league, which is made if there is none.

    Raises:
        ConfigError: it cannot be made with these settings, or was made with others.
    """
    from msgspec import structs

    from vrg import __version__
    from vrg.config.loading import load_match, match_path
    from vrg.evaluation.contenders import teams_of
    from vrg.evaluation.experiment import Definition, code_of_vrg
    from vrg.evaluation.folder import DEFINITION, read_definition
    from vrg.evaluation.league_folder import LeagueFolder

    code = {"the code of VRG": code_of_vrg()}
    made = (out / DEFINITION).is_file()
    if not made and settings.match is None:
        raise ConfigError([f"{out}: there is no league yet: name its game or match file, such as `--match roboflag`"])
    secret = match_of(out).secret if made else secrets.token_hex(16)

    def wanted_by(engine: str, lasers: bool | None) -> "CheckedMatch":
        path = match_path(settings.match or "")
        return load_match(path, engine=engine, lasers=lasers, sandbox=True, secret=secret)

    if not made:
        wanted = wanted_by(settings.engine or "planar", settings.lasers)
        definition = Definition(
            match=wanted.text,
            game=wanted.game,
            teams=teams_of(wanted),
            seed=settings.seed or 0,
            limit=settings.limit or LIMIT,
            contenders=[],
            code=code,
        )
        return LeagueFolder(out, definition, wanted)
    before, kept = read_definition(out), match_of(out)
    asked = (None, kept.lasers)
    same = {
        "--match": settings.match is None or before.match in [wanted_by(kept.engine, on).text for on in asked],
        "--engine": settings.engine in (None, kept.engine),
        "--lasers": settings.lasers in asked,
        "--limit": settings.limit in (None, before.limit),
        "--seed": settings.seed in (None, before.seed),
    }
    if other := [option for option in same if not same[option]]:
        what = f"{', '.join(other)}: the league was made with another value, and all its games depend on it"
        raise ConfigError([f"{out}: {what}: leave it out, or make another league with --output"])
    now = structs.replace(before, vrg=__version__, code=code)
    if not new_release and (differences := now.differences(before)):
        what = "older games may not be played again as they were, and count as before"
        raise ConfigError([f"{out}: {'; '.join(differences)}: --new-release goes on all the same: {what}"])
    return LeagueFolder(out, now, another=new_release)


def _write(league: "League", site: "LeaguePages", sources: "list[Source]", *, reloads: bool) -> None:
    """Write the pages, and the errors of each entry."""
    from vrg.evaluation.league import errors_of

    now, of = _now(), {source.entry: source for source in sources}
    site.write(now, reloads=reloads)
    for entry in {*of, *(version.entry for version in league.folder.versions)}:
        league.folder.write_errors(entry, errors_of(league.folder, of.get(entry), entry, now))


def _now() -> str:
    """The local wall time."""
    return f"{datetime.now():%Y-%m-%d %H:%M}"
