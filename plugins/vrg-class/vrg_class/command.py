"""`vrg class start` and `export`."""

import secrets
import shutil
import time
from pathlib import Path
from typing import Annotated, Final

import typer

from vrg.commands.options import ListenOption, TlsOption, make_console, stoppable
from vrg.commands.page import CHECKED_EVERY
from vrg.config.loading import match_path
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.launch.folder_lock import OWNER, owned
from vrg.launch.fork_server import cores
from vrg.launch.sandbox.seal import missing
from vrg.registry import expected_one_of
from vrg.ui.web.admission import TOKEN_BYTES
from vrg_class.folder import About, ClassFolder
from vrg_class.league import ClassLeague
from vrg_class.lesson import lesson_of, shipped
from vrg_class.links import NameOption, Served, served_at
from vrg_class.roster import read_roster
from vrg_class.server import ClassSite
from vrg_class.tries import Tries, setup_of

PORT: Final = 8090
"""The port of the class, if no other program has it."""
DEFAULT_GAME: Final = "sharks-and-minnows"
LEAGUE: Final = "league.toml"
"""The match of the league, beside the steps of a lesson."""

FolderArgument = Annotated[Path, typer.Argument(metavar="[FOLDER]", help="The folder of the class.")]


def start(
    folder: FolderArgument = Path("class"),
    game: Annotated[str | None, typer.Option(help="The game of a new class.")] = None,
    match: Annotated[str | None, typer.Option(help="The match of its league; the default is the game's own.")] = None,
    lesson: Annotated[Path | None, typer.Option(help="A folder with steps of your own, such as 01-drive.md.")] = None,
    roster: Annotated[
        Path | None,
        typer.Option(help="names.csv: a name and a word in each line; others cannot join. It may change at any time."),
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Tries at a time; by default, one per processor.")] = None,
    listen: ListenOption = None,
    tls: TlsOption = False,
    name: NameOption = None,
    sandbox: Annotated[
        bool, typer.Option("--sandbox/--no-sandbox", help="Without a sandbox, students' code can do all that you can.")
    ] = True,
) -> None:
    """Serve a class: students join by a link, write code in their browsers, and see at once how it plays.

    The page is for this computer alone, unless --listen serves it to others: `--listen 0.0.0.0`.
    """
    if sandbox and (lacking := missing()) is not None:
        raise ConfigError(f"{lacking}: with --no-sandbox the code of all students can do all that you can")
    with owned(folder, mode=0o700):
        place = opened(folder, game, match, lesson, roster)
        at = served_at(place.path, listen, PORT, "the class", tls=tls, name=name)
        _serve(place, at, listen, jobs or cores(), tls=tls, sandbox=sandbox)


def _serve(place: ClassFolder, at: Served, listen: str | None, jobs: int, *, tls: bool, sandbox: bool) -> None:
    about = place.about
    steps = lesson_of(Path(about.lesson)) if about.lesson else []
    tries, league = (lambda: Tries(jobs, about.game, "planar", sealed=sandbox)), ClassLeague(place, about.match)
    site = ClassSite(at, place, steps, tries, league)
    console = make_console()
    with stoppable() as stop:
        site.start()
        links = (
            ("students", f"#join={about.joining}"), ("projector", f"projector.html#{about.joining}"),
            ("teacher", f"teacher.html#{about.teacher}"),
        )  # fmt: skip
        at.show(links, console)
        if about.roster:
            console.print(
                f"{len(about.roster)} names are in the roster, {about.roster_file}", soft_wrap=True, markup=False
            )
        for problem in place.problems:
            console.print(f"not used: {problem}", style="yellow", soft_wrap=True, markup=False)
        if listen is None:
            console.print("the class is for browsers on this computer; --listen 0.0.0.0 serves it to others")
        elif not tls:
            console.print("[yellow]names and code go over the network unencrypted; --tls encrypts them[/yellow]")
        console.print("(Ctrl-C ends it; nothing is lost, and the same command continues)", markup=False)
        try:
            while not stop.wait(CHECKED_EVERY):
                site.check()
        finally:
            site.stop()


def opened(folder: Path, game: str | None, match: str | None, lesson: Path | None, roster: Path | None) -> ClassFolder:
    """The folder of a class: that which is there, or a new one.

    Raises:
        ConfigError: it cannot be used, or its class has another game.
    """
    if (folder / "class.json").exists():
        there = ClassFolder(folder)
        about = there.about
        wanted = {
            "--game": game in (None, about.game),
            "--match": match is None or str(match_path(match).resolve()) == about.match,
            "--lesson": lesson is None or str(lesson.resolve()) == about.lesson,
        }
        if other := [option for option, same in wanted.items() if not same]:
            what = f"{', '.join(other)}: its class was made with another value, which stays"
            raise ConfigError(f"{folder}: {what}: leave it out, or choose another folder")
        if roster is not None:
            there.keep_about(roster=read_roster(roster), roster_file=str(roster.resolve()))
        return there
    if folder.exists() and {file.name for file in folder.iterdir()} - {OWNER}:
        raise ConfigError(f"{folder}: expected a new folder, or that of a class, found other files")
    game = game or (setup_of(match, {}).game if match else DEFAULT_GAME)
    if game not in GAMES:
        raise ConfigError(f"--game: {expected_one_of(GAMES.names(), game)}")
    own = lesson or shipped(game)
    usual = game if own is None or not (own / LEAGUE).is_file() else str(own / LEAGUE)
    about = About(
        game=game, match=str(match_path(match or usual).resolve()),
        lesson="" if own is None else str(own.resolve()), teacher=secrets.token_urlsafe(TOKEN_BYTES),
        joining=secrets.token_urlsafe(TOKEN_BYTES), roster={} if roster is None else read_roster(roster),
        roster_file="" if roster is None else str(roster.resolve()),
    )  # fmt: skip
    if own is not None:
        lesson_of(own)
    setup_of(about.match, {})
    return ClassFolder(folder, about)


def export(
    folder: FolderArgument,
    output: Annotated[Path, typer.Argument(metavar="OUTPUT", help="A new folder.")],
) -> None:
    """Copy what students handed in into a folder that `vrg league play`, `vrg tournament` and `vrg play` take."""
    place = ClassFolder(folder)
    if output.exists():
        raise ConfigError(f"{output}: expected a new folder, but it exists already")
    shutil.copytree(place.entries, output)
    names = ", ".join(sorted(file.name for file in output.iterdir()))
    typer.echo(f"{output}: {names or 'nothing was handed in yet'} ({time.strftime('%Y-%m-%d %H:%M')})")
