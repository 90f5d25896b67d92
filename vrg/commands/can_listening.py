"""The nodes of a bus and their state, for commands that show it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console, Group
from rich.markup import escape
from rich.table import Table

from vrg.bus.stopping import StopSignal
from vrg.commands import can_options
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


class Listener:
    """A bus that is listened to; open it by `listening`.

    Attributes:
        survey: who speaks there. clock: the time of the bus.
    """

    def __init__(self, link: Link) -> None:
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

    def stop(self) -> None:
        """Let go of the bus."""
        self._bus.stop()

    def look(self, interrupted: StopSignal, *, ask: bool) -> BusState:
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
                    if not interrupted.is_set() and self.clock.now() - found.heard < HEARTBEAT_TIMEOUT:
                        self.survey.ask(found)
            except RobotError as error:
                self._complain(str(error))
        return BusState(nodes, list(self._troubles), self.clock.now())

    def look_for(self, seconds: float, interrupted: StopSignal, *, ask: bool) -> BusState:
        """Look again and again for a while; what has been heard at last."""
        end = self.clock.now() + seconds
        while (left := end - self.clock.now()) > 0 and not interrupted.is_set():
            self.look(interrupted, ask=ask)
            self.clock.wait(interrupted.is_set, min(ASK_PERIOD, left))
        return self.look(interrupted, ask=ask)

    def _hear(self, frame: Frame) -> None:
        with self._lock:
            self.survey.hear(frame)

    def _complain(self, words: str) -> None:
        self._troubles.setdefault(words)


@contextmanager
def listening(link: Link) -> Iterator[Listener]:
    """Listen to a bus.

    Raises:
        RobotError: it cannot be opened.
    """
    bus = Listener(link)
    bus.start()
    try:
        yield bus
    finally:
        bus.stop()


def unheard() -> list[str]:
    """The names of the protocols without a listener, whose drives cannot be found, or stopped, on a bus."""
    return [name for name in PROTOCOLS.names() if (found := PROTOCOLS.find(name)) and found.listener is None]


def plain_console() -> Console:
    """A console that prints names as they are: `virtual:x:` is a bus, and no picture."""
    return Console(highlight=False, emoji=False)


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
