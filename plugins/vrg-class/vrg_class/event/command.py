"""`vrg event`: a timetable of matches on one field, one after the other."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final

import typer

from vrg.commands.options import ListenOption, TlsOption, make_console, stoppable
from vrg.errors import ConfigError
from vrg.launch.folder_lock import owned
from vrg_class.event.course import Event
from vrg_class.event.field import Field
from vrg_class.event.outcomes import read_kept
from vrg_class.event.running import KEPT, EventClock, Running
from vrg_class.event.site import EventSite
from vrg_class.event.timetable import Timetable, read_timetable
from vrg_class.links import NameOption, Served, served_at

PORT: Final = 8070
"""The port of the event's pages, if no other program has it."""
_LOOKED: Final = 0.1
"""The real time in s between two looks at what is to be printed."""
WindowsOption = Annotated[bool, typer.Option("--windows", help="Show each match in a window on this computer too.")]


def event(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The timetable, such as open-day.toml.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Output folder; the default has the name of FILE.")
    ] = None,
    listen: ListenOption = None,
    tls: TlsOption = False,
    name: NameOption = None,
    windows: WindowsOption = False,
) -> None:
    """Run a timetable of matches on one field, virtual, physical or mixed: line-up, play, review, pause, the next one.

    It serves pages for the stage, for spectators and for officials. The same command continues where it stopped.
    """
    folder, table = output or file.with_suffix(""), read_timetable(file)
    if folder == file:
        raise typer.BadParameter("a file without an ending, such as .toml, needs --output", param_hint="FILE")
    with owned(folder):
        served = served_at(folder, listen, PORT, "the event", tls=tls, name=name)
        run_event(table, file.parent, folder, served, ["--sandbox", *([] if windows else ["--headless"])])


def run_event(
    table: Timetable, base: Path, folder: Path, served: Served, options: Sequence[str], *, quick: bool = False
) -> Event:
    """Run an event until Ctrl-C is pressed.

    Args:
        base: the folder from which the timetable names files. folder: for what is written. options: of `vrg play`.
        quick: True shows no matches on pages, and ends when all is played, or held, as nobody is there to decide.

    Raises:
        ConfigError: the timetable, or what the folder has kept, cannot be used.
        LaunchError: the pages cannot be served.
    """
    console, clock = make_console(), EventClock()
    field = Field(base, folder, served.page.official, [*options, *table.options], paged=not quick)
    try:
        event = Event(table, field.games(table), read_kept(folder / KEPT), clock.now())
        field.check_options(table)
    except ConfigError as error:
        raise ConfigError(f"{folder}: {error}") from None
    if quick:
        event.go_on(clock.now())
    running = Running(event, field, clock, folder)
    site = EventSite(served, running)

    def tell(say: Callable[..., None] = console.print) -> None:
        while not running.said.empty():
            with suppress(OSError):  # nobody may read it any more
                say(running.said.get(), soft_wrap=True, markup=False)

    with stoppable() as stop:
        site.start()
        try:
            token = f"officials.html#{served.page.official}"
            served.show((("spectators", ""), ("stage", "stage.html"), ("officials", token)), console)
            console.print("(Ctrl-C ends it; nothing is lost, and the same command continues)", markup=False)
            if event.next is None and event.on is None:
                console.print("all matches are played; officials may have one played again")
            if event.held is not None:
                console.print("the timetable is held, as it was before: resume it on the officials' page")
            while not stop.wait(_LOOKED):
                site.check()
                tell()
                if quick and (running.is_over or event.held):
                    break
        finally:
            running.close()
            tell()
            site.stop()
    return event
