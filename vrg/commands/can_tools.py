"""`vrg can scan | monitor`: who is on a bus, and how they are."""

import math
from typing import Annotated

import typer
from rich.live import Live
from rich.markup import escape

from vrg.commands.can_listening import ASK_PERIOD, listening, plain_console, table_of, unheard
from vrg.commands.can_options import AdapterOption, AnyChannelOption, BitrateOption, InterfaceOption, can_link
from vrg.commands.options import lasting, stoppable


def scan(
    channel: AnyChannelOption = None,
    interface: InterfaceOption = "socketcan",
    bitrate: BitrateOption = None,
    adapter: AdapterOption = None,
    seconds: Annotated[float, lasting("How long to listen.", 0.3, 60)] = 1.5,
) -> None:
    """Say which drives are on a bus: protocol, id, serial number, firmware, state and errors. Moves nothing."""
    link = can_link(interface, channel, bitrate, adapter)
    console = plain_console()
    with stoppable() as interrupted, listening(link) as bus, console.status(f"listening on {link}"):
        heard = bus.look_for(seconds, interrupted, ask=True)
    for name in unheard():
        console.print(f"Drives of the protocol {name} are not found: it has no listener.")
    if heard.nodes:
        console.print(table_of(heard))
        return
    for words in heard.troubles:
        console.print(f"[red]{escape(words)}[/red]")
    console.print(f"{link}: no drives. Is the bus wired and powered, and the bit rate right?")
    raise typer.Exit(1)


def monitor(
    channel: AnyChannelOption = None,
    interface: InterfaceOption = "socketcan",
    bitrate: BitrateOption = None,
    adapter: AdapterOption = None,
    seconds: Annotated[
        float | None,
        lasting("How long; until Ctrl-C if missing.", 0.3),
    ] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask the drives too, which disturbs a robot that is just connecting.")
    ] = False,
) -> None:
    """Show the drives on a bus, live, by their messages. Moves nothing, and sends nothing but for `--ask`."""
    link = can_link(interface, channel, bitrate, adapter)
    console = plain_console()
    with stoppable() as interrupted, listening(link) as bus, Live(console=console, refresh_per_second=5) as live:
        live.update(f"listening on {link}")
        end = math.inf if seconds is None else bus.clock.now() + seconds
        while not interrupted.is_set() and bus.clock.now() < end:
            heard = bus.look_for(min(ASK_PERIOD, max(0.05, end - bus.clock.now())), interrupted, ask=ask)
            if heard.nodes or heard.troubles:
                live.update(table_of(heard))
            else:
                live.update(f"{link}: no drives yet{'' if ask else '; drives that speak only when asked need --ask'}")
