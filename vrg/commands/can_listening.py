"""The nodes of a bus and their state: `vrg can scan` and `monitor`, and what the other tools share with them."""

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

import typer
from rich.console import Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from vrg.bus.stopping import Stop
from vrg.commands import can_options
from vrg.commands.can_options import BusOptions
from vrg.commands.options import lasting, make_console, stoppable
from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import HEARTBEAT_TIMEOUT
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.listener import Found
from vrg.hal.can.workshop.survey import Survey, all_listeners

ASK_PERIOD = 0.25
"""s between questions to the drives. Some speak only when they are asked, and are silent after HEARTBEAT_TIMEOUT."""


@dataclass(frozen=True)
class BusState:
    """The nodes of a bus, the troubles of the bus itself, in words, and the time of the look, in monotonic s."""

    nodes: list[Found]
    troubles: list[str]
    at: float


class ListenedBus:
    """A bus that is listened to; open it by `listening`.

    Attributes:
        survey: who speaks there. clock: the time of the bus. stop: Ctrl-C sets it.
    """

    def __init__(self, link: Link, stop: Stop) -> None:
        self.stop = stop
        medium = can_options.medium()
        self.clock = medium.clock
        self._lock = threading.Lock()
        self._troubles: dict[str, None] = {}
        self._bus = medium.bus(link, self._hear, self._complain)
        self.survey = Survey(all_listeners(self._bus.send, self.clock))

    def start(self) -> None:
        """Begin to listen.

        Raises:
            RobotError: the bus cannot be opened.
        """
        self._bus.start()

    def close(self) -> None:
        """Let go of the bus."""
        self._bus.stop()

    def wait(self, seconds: float) -> None:
        """Wait for some time, or until Ctrl-C."""
        self.clock.wait(self.stop.is_set, seconds)

    def look(self, *, ask: bool) -> BusState:
        """Return the present state of the bus.

        Args:
            ask: ask everybody for what they do not say by themselves.
        """
        with self._lock:
            nodes = self.survey.nodes
        if ask:
            try:
                self.survey.greet()
                for found in nodes:
                    # An answer may have to be waited for: a node that has fallen silent is not asked.
                    if not self.stop.is_set() and self.clock.now() - found.heard < HEARTBEAT_TIMEOUT:
                        self.survey.ask(found)
            except RobotError as error:
                self._complain(str(error))
        return BusState(nodes, list(self._troubles), self.clock.now())

    def look_for(self, seconds: float, *, ask: bool = True) -> BusState:
        """Look again and again for a while; what has been heard at last."""
        end = self.clock.now() + seconds
        while (left := end - self.clock.now()) > 0 and not self.stop.is_set():
            self.look(ask=ask)
            self.wait(min(ASK_PERIOD, left))
        return self.look(ask=ask)

    def _hear(self, frame: Frame) -> None:
        with self._lock:
            self.survey.hear(frame)

    def _complain(self, words: str) -> None:
        self._troubles.setdefault(words)


@contextmanager
def listening(link: Link) -> Iterator[ListenedBus]:
    """Listen to a bus.

    Raises:
        RobotError: it cannot be opened.
        typer.Exit: at the end of the context, with status 130, if Ctrl-C was pressed.
    """
    with stoppable() as stop:
        bus = ListenedBus(link, stop)
        bus.start()
        try:
            yield bus
        finally:
            bus.close()


def unheard() -> list[str]:
    """The names of the protocols without a listener, whose drives cannot be found, or stopped, on a bus."""
    return [name for name in PROTOCOLS.names() if (found := PROTOCOLS.find(name)) and found.listener is None]


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
            escape(", ".join(found.serials)) or "?",
            escape(found.firmware) or "?",
            escape(found.state) if silent < HEARTBEAT_TIMEOUT else "silent",
            _number(found.position, 2),
            _number(found.velocity, 2),
            _number(found.voltage, 1),
        )
        problems = [found.errors] if found.errors else []
        if silent >= HEARTBEAT_TIMEOUT:
            problems.append(f"no heartbeat for {silent:.1f} s")
        if len(found.serials) > 1:
            problems.append(f"{len(found.serials)} drives have this id: {', '.join(found.serials)}")
        wrong += [f"[red]{found.protocol} {found.node}: {escape(words)}[/red]" for words in problems]
    return Group(table, *wrong)


def _number(value: float | None, digits: int) -> str:
    return "?" if value is None else f"{value:.{digits}f}"


def scan(on: BusOptions, seconds: Annotated[float, lasting("How long to listen.", 0.3, 60)] = 1.5) -> None:
    """Say which drives are on a bus: protocol, id, serial number, firmware, state and errors. Moves nothing."""
    link, console = on.link(), make_console()
    with listening(link) as bus, console.status(f"listening on {link}"):
        heard = bus.look_for(seconds)
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
    on: BusOptions,
    seconds: Annotated[float | None, lasting("How long; until Ctrl-C if missing.", 0.3)] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask the drives too, which disturbs a robot that is just connecting.")
    ] = False,
) -> None:
    """Show the drives on a bus, live, by their messages. Moves nothing, and sends nothing but for `--ask`."""
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
