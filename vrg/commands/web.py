"""The command `vrg web`, which shows a running match in browsers."""

import os
from typing import Annotated

import typer
from rich.console import Console

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.seats import SeatKind, seats_of_node
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.commander import first_state
from vrg.commands.options import EndpointOption, KeysOption, NameOption, credentials_for, web_address


def web(
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    at: Annotated[
        str | None,
        typer.Option("--at", metavar="HOST[:PORT]", help="Where; this machine only if missing; 0.0.0.0 is for all."),
    ] = None,
) -> None:
    """Show a running match in browsers. Without the official's keys everybody may only watch."""
    host, port = web_address(at)
    from vrg.commands.page import open_page, print_links
    from vrg.launch.serving import WINDOW_PERIOD, child_process
    from vrg.ui.web.node import WebNode
    from vrg.ui.web.server import WebServer

    found = attached(match, name, router)
    keys = Keys(found.name)
    credentials = credentials_for(found.endpoint, seats, *seats_of_node("web", ""))
    official = credentials is None or credentials.common_name == SeatKind.OFFICIAL
    with (
        child_process(leash=False) as stop,
        open_session(found.endpoint, stop=stop, credentials=credentials) as session,
    ):
        state = first_state(session, keys, stop)
        if state is not None:
            page = open_page(host, port, [player.name for player in state.players], deciding=official)
            print_links(page, Console(highlight=False))
            audience = WebServer(page, found.name)
            node = WebNode(
                f"web-{os.getpid()}", Mailbox(), keys, audience, sizes=found.sizes, obstacles=found.obstacles
            )
            run_node(node, session, keys, stop, idle=WINDOW_PERIOD)
    if stop.interrupted:
        raise typer.Exit(130)
