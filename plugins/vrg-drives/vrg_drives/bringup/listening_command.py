"""The nodes of a bus and their state: `vrg can scan` and `monitor`, and what the other tools share with them."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer
from rich.console import Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from vrg.bus.stopping import stop_on_signals
from vrg.commands import drives
from vrg.commands.drives import BusOptions
from vrg.commands.options import exit_if_stopped, lasting, make_console
from vrg.hal.can.axis import NEVER
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT
from vrg.hal.can.link import Link
from vrg.hal.can.workshop.survey import unheard
from vrg_drives.bringup.listened_bus import ASK_PERIOD, BusState, ListenedBus


@contextmanager
def listening(link: Link) -> Iterator[ListenedBus]:
    """Listen to a bus.

    Raises:
        RobotError: it cannot be opened.
        typer.Exit: at the end of the context, if a signal has stopped it, with the status of `exit_if_stopped`.
    """
    with stop_on_signals() as stop:
        bus = ListenedBus(link, drives.medium(), stop)
        bus.start()
        try:
            yield bus
        finally:
            bus.close()
    exit_if_stopped(stop)


def table_of(heard: BusState) -> Group:
    """A row for each drive, and below them what is wrong, in whole words."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for name in ("protocol", "id", "serial", "firmware", "state", "turns", "turns/s", "V"):
        table.add_column(name, justify="right" if name in ("id", "turns", "turns/s", "V") else "left")
    wrong = [f"[red]{escape(words)}[/red]" for words in heard.troubles]
    for found in heard.nodes:
        silent = heard.at - found.heard
        table.add_row(
            found.protocol,
            str(found.node),
            escape(", ".join(sorted(found.serials))) or "?",
            escape(found.firmware) or "?",
            escape(found.words) if silent < HEARTBEAT_TIMEOUT else "silent",
            _number(found.position if found.measured > NEVER else None, 2),
            _number(found.velocity if found.measured > NEVER else None, 2),
            _number(found.voltage, 1),
        )
        problems = [found.errors] if found.errors else []
        if silent >= HEARTBEAT_TIMEOUT:
            problems.append("no heartbeat" + (f" for {silent:.1f} s" if silent < math.inf else " yet"))
        if len(found.serials) > 1:
            problems.append(f"{len(found.serials)} drives have this id: {', '.join(sorted(found.serials))}")
        wrong += [f"[red]{found.protocol} {found.node}: {escape(words)}[/red]" for words in problems]
    return Group(table, *wrong)


def _number(value: float | None, digits: int) -> str:
    return "?" if value is None or math.isnan(value) else f"{value:.{digits}f}"


def scan(on: BusOptions, seconds: Annotated[float, lasting("How long to listen.", 0.3, 60)] = 1.5) -> None:
    """List the drives on a bus: protocol, id, serial number, firmware, state and errors. Nothing moves."""
    link, console = on.link(), make_console()
    with listening(link) as bus, console.status(f"listening on {link}"):
        heard = bus.look_for(seconds)
    for name, why in unheard().items():
        console.print(f"Drives of the protocol {name} are not found: {escape(why)}.")
    if heard.nodes:
        console.print(table_of(heard))
        return
    for words in heard.troubles:
        console.print(f"[red]{escape(words)}[/red]")
    console.print(f"{link}: no drives. Is the bus wired and powered, and is the bit rate right?")
    raise typer.Exit(1)


def monitor(
    on: BusOptions,
    seconds: Annotated[float | None, lasting("How long; the default is until Ctrl-C.", 0.3)] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask the drives too, which disturbs a robot that is just connecting.")
    ] = False,
) -> None:
    """Show the drives on a bus, live, from their messages. Nothing moves, and nothing is sent without `--ask`."""
    link, console = on.link(), make_console()
    with listening(link) as bus, Live(console=console, refresh_per_second=5) as live:
        live.update(f"listening on {link}")
        end = math.inf if seconds is None else bus.clock.now() + seconds
        while not bus.stop.is_set() and bus.clock.now() < end:
            heard = bus.look_for(min(ASK_PERIOD, max(0.05, end - bus.clock.now())), ask=ask)
            if heard.nodes or heard.troubles:
                live.update(table_of(heard))
            else:
                live.update(f"{link}: no drives yet{'' if ask else '; drives that speak only when asked need --ask'}")
