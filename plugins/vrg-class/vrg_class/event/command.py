"""`vrg event`: a timetable of matches on one field, one after the other."""

import secrets
import time
from itertools import count
from pathlib import Path
from typing import Annotated, Final

import typer

from vrg.bus.hosts import netloc
from vrg.bus.stopping import Stop
from vrg.commands.options import ListenOption, make_console, port_at, stoppable, web_address
from vrg.commands.page import reached_at
from vrg.errors import ConfigError, VrgError
from vrg.launch.folder_lock import owned
from vrg.playing.by_command import play_file
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder
from vrg.ui.web.admission import DEFAULT_PORT
from vrg_class.event.site import EventSite
from vrg_class.event.timetable import Event, Outcome, read_timetable

PORT: Final = 8070
"""The port of the event's page, if no other program has it."""
_LOOKED: Final = 0.2
"""The real time in s between two looks at the clock and at what officials want."""


def event(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The timetable, such as open-day.toml.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for what it writes; that of FILE's name if missing.")
    ] = None,
    listen: ListenOption = None,
    windows: Annotated[
        bool, typer.Option("--windows", help="Show each match in a window on this computer too.")
    ] = False,
) -> None:
    """Run a timetable of matches on one field, virtual, physical or mixed: line-up, play, result, pause, the next one.

    It serves a page for the stage with the timetable and a countdown, which leads to the page of the match while one is
    played, and comes back. The same command goes on where it was.
    """
    folder = output or file.with_suffix("")
    with owned(folder):
        _serve(file, Event(read_timetable(file), file.parent, folder), listen, windows=windows)


def _serve(file: Path, found: Event, listen: str | None, *, windows: bool) -> None:
    for number, title in enumerate(found.titles()):
        try:
            found.setup(number)  # a mistake is found before the guests come
        except ConfigError as error:
            raise ConfigError(f"{file}: match {number + 1}, {title}: {error}") from None
    host, port = web_address(listen)
    port = port_at(host, port, PORT, "the event")
    token, console = secrets.token_urlsafe(12), make_console()
    page = port_at(host, None, DEFAULT_PORT, "the match")
    site = EventSite(host, port, found, page, token)
    with stoppable() as stop:
        site.start()
        try:
            for address in reached_at(host):
                at = f"http://{netloc(address, port)}/"
                console.print(f"stage      {at}\nofficials  {at}#{token}", soft_wrap=True, markup=False)
            if found.outcomes:
                console.print(f"{len(found.outcomes)} of {len(found.table.matches)} matches are played already")
            shown = [] if windows else ["--headless"]
            _run(found, site, stop, ["--sandbox", "--listen", netloc(host, page), *shown])
        finally:
            site.stop()


def _run(event: Event, site: EventSite, stop: Stop, options: list[str]) -> None:
    """Play the matches, until all have an outcome or it is to stop."""
    console, ended, over = make_console(), time.time(), False
    while not stop.is_set():
        if event.again:
            event.again = False
            event.repeat()
        if (number := event.next) is None:
            if not over:
                console.print("All matches are played; Ctrl-C ends the event.")
            over = True
            stop.wait(_LOOKED)  # somebody may want the last one again
            continue
        lately = event.played_lately(time.time())
        event.begins = ended if number == event.repeated else event.due(number, ended, lately=lately)
        site.check()
        if event.held or not (event.begun or time.time() >= event.begins):
            stop.wait(_LOOKED)
            continue
        event.begun, event.again, event.playing, over = False, False, number, False
        console.print(event.titles()[number], style="bold", soft_wrap=True, markup=False)
        outcome = _played(event, number, options, stop)
        if stop.is_set():
            break  # it is played anew when the event goes on
        if outcome is None:
            event.held, event.playing = True, None
            continue
        event.keep(number, outcome)
        event.playing = event.repeated = None
        ended = time.time() + event.table.pause


def _played(event: Event, number: int, options: list[str], stop: Stop) -> Outcome | None:
    """Play a match; None if it has left no result, so that the officials must decide what follows."""
    try:
        names = (f"match-{number + 1}" if n == 1 else f"match-{number + 1}-{n}" for n in count(1))
        folder = RunFolder(next(path for name in names if not (path := event.folder / name).exists()))
        folder.path.mkdir(parents=True)
        keep(event.setup(number), folder)
        run = play_file(folder.match_file, event.folder / "runs", [*options, *event.table.options], stop)
        return Outcome(title=event.titles()[number], words=run.conclusion, score=dict(run.score), run=str(run.path))
    except (OSError, VrgError) as error:
        make_console().print(f"not played, the timetable is held: {error}", soft_wrap=True, markup=False)
        return None
