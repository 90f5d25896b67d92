"""`vrg class final`: the best of a class play a bracket on a stage."""

from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import typer
from pydantic import ValidationError

from vrg.commands.options import ListenOption, TlsOption, make_console
from vrg.errors import ConfigError
from vrg.files import read_bytes, write_whole
from vrg.launch.folder_lock import owned
from vrg_class.command import FolderArgument
from vrg_class.event.command import PORT, WindowsOption, run_event
from vrg_class.event.timetable import Entry, Team, Timetable
from vrg_class.folder import ClassFolder
from vrg_class.league import ClassLeague
from vrg_class.links import NameOption, served_at

TABLE: Final = "timetable.json"
"""The file in the folder of the final with who takes part, so that it goes on after a restart."""


def final(
    folder: FolderArgument = Path("class"),
    match: Annotated[
        str | None, typer.Option(help="A match file to play on, such as one with physical robots; else the league's.")
    ] = None,
    places: Annotated[int, typer.Option(min=2, max=32, help="How many students of the leaderboard take part.")] = 8,
    elimination: Annotated[
        Literal["single", "double"], typer.Option(help="After how many lost pairings a student is out.")
    ] = "single",
    listen: ListenOption = None,
    tls: TlsOption = False,
    name: NameOption = None,
    windows: WindowsOption = False,
    show: Annotated[
        list[str] | None, typer.Option(help="As for `vrg play`, such as 3d; may be given several times.")
    ] = None,
    lockstep: Annotated[bool, typer.Option("--lockstep", help="Play as fast as possible, without pictures.")] = False,
    sandbox: Annotated[bool, typer.Option(help="Run the players' code in a sandbox.")] = True,
) -> None:
    """Let the best of the class play a bracket on a stage: the first against the last, and so on, until one is left.

    The final is an event of `vrg event`, in FOLDER/final. If the teams of the game have different roles, each pair
    plays two matches with sides changed. A draw goes to the higher place. The same command continues where it stopped.
    """
    place = ClassFolder(folder)
    own = place.path / "final"
    with owned(own):
        own.chmod(0o700)
        table = _table(place, own / TABLE, match, places, elimination)
        if lockstep:
            table = table.model_copy(update={"pause": 0.0, "review": 0.0})
        served = served_at(own, listen, PORT, "the final", tls=tls, name=name)
        options = [
            "--sandbox" if sandbox else "--no-sandbox",
            *(word for one in show or () for word in ("--show", one)),
        ]
        options += ["--lockstep", "--engine", "planar"] if lockstep else []
        options += [] if windows and not lockstep else ["--headless"]
        event = run_event(table, place.path, own, served, options, quick=lockstep)
    if event.held is not None and lockstep:
        raise ConfigError(f"{own}: the final is held: {event.held.get('words') or event.held['why']}")
    if (best := event.plan.champion) is not None:
        make_console().print(f"{best} wins the class", markup=False)


def _table(
    place: ClassFolder, file: Path, match: str | None, places: int, elimination: Literal["single", "double"]
) -> Timetable:
    """The timetable of a final that has begun, or else a new one, by the leaderboard.

    Raises:
        ConfigError: the league has not played yet, or what was kept cannot be used.
    """
    base = match or place.about.match
    if file.exists():
        try:
            return Timetable.model_validate_json(read_bytes(file))
        except (OSError, ValidationError) as error:
            raise ConfigError(f"{file}: expected the final that has begun: {error}: move {file.parent} away") from None
    league = ClassLeague(place, place.about.match)
    best = [str(row["name"]) for row in league.board if row["games"]][:places]
    if len(best) < 2:
        raise ConfigError(
            f"{place.path}: expected two in the leaderboard, found {len(best)}: let the league play first"
        )
    # By the versions that have earned their places.
    teams = tuple(Team(name=name, strategy=str(league.files[name].resolve())) for name in best)
    beside = Path(base)
    entry = Entry(
        match=str(beside.resolve()) if beside.is_file() else base, kind="bracket", title="Final",
        elimination=elimination,
    )  # fmt: skip
    table = Timetable(title="Final of the class", pause=30.0, teams=teams, matches=(entry,))
    write_whole(file, msgspec.json.encode(table.model_dump(mode="json")), synced=True)
    return table
