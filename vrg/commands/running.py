"""The command `vrg processes`, which shows the processes of a match that runs."""

import os

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.commands.options import (
    EndpointOption,
    KeysOption,
    NameOption,
    credentials_for,
    stoppable,
    table_console,
    which_match,
)
from vrg.ui.processes import ProcessTable


def processes(name: NameOption = None, router: EndpointOption = None, seats: KeysOption = None) -> None:
    """Show the processes of a match on all its machines, until Ctrl-C; once, where the output is no terminal."""
    found, endpoint = which_match(name, router)
    keys = Keys(found)
    credentials = credentials_for(endpoint, seats, Seat(SeatKind.OFFICIAL), Seat(SeatKind.WINDOW))
    with stoppable() as stop, open_session(endpoint, stop=stop, credentials=credentials) as session:
        node = ProcessTable(f"processes-{os.getpid()}", Mailbox(), keys, console=table_console())
        run_node(node, session, keys, stop, finished=lambda: node.printed, idle=0.5)
