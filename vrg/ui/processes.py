"""Shows the processes of a match, on all its machines, as a table in the terminal."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Processes, ProcessState, ProcessStatus, Pulse
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys

_STYLES: Final = {
    ProcessState.STARTING: "yellow",
    ProcessState.RUNNING: "green",
    ProcessState.ENDED: "bold red",
    ProcessState.AWAY: "bold red",
}
LATE: Final = 0.05
"""A process that hears the match clock later than this, s, is marked."""


@dataclass(frozen=True)
class Row:
    """A process in the table.

    Args:
        status: published by the launcher. pulse: its own; None if none has arrived.
    """

    status: ProcessStatus
    pulse: Pulse | None

    @property
    def waits(self) -> bool:
        """True if the process runs, and its first pulse has not come yet."""
        alive = self.status.state in (ProcessState.STARTING, ProcessState.RUNNING)
        return alive and bool(self.status.node) and self.pulse is None


def rows(statuses: Sequence[ProcessStatus], pulses: Mapping[str, Pulse]) -> list[Row]:
    """A row for each process. A pulse is known by the kind and the name of its node, such as `player/ann`."""
    alive = (ProcessState.STARTING, ProcessState.RUNNING)
    return [Row(status, pulses.get(status.node) if status.state in alive else None) for status in statuses]


class Board:
    """Collects the reports about processes.

    Args:
        mailbox: of the reports. keys: the keys of the match.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys) -> None:
        self._processes = mailbox.subscribe(keys.processes)
        self._beats = mailbox.subscribe(keys.pulse())
        self._root = keys.root
        self._statuses: Sequence[ProcessStatus] = ()
        self._pulses: dict[str, Pulse] = {}

    def look(self) -> list[Row]:
        """The newest of every process, by machine."""
        for pulse in self._beats.take():
            self._pulses[pulse.key.removeprefix(f"{self._root}/pulse/")] = pulse.body
        newest: Processes | None = None if self._processes.latest is None else self._processes.latest.body
        if newest is not None:
            self._statuses = newest.processes
        return rows(self._statuses, self._pulses)

    @property
    def machines(self) -> set[str]:
        """The machines on which they run."""
        return {status.machine for status in self._statuses}


def process_table(listed: Sequence[Row]) -> Table:
    """The processes as a table for rich."""
    grid = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for name in ("machine", "process", "state"):
        grid.add_column(name, no_wrap=True)
    for name in ("ticks/s", "missed", "refused", "clock", "drift", "CPU", "memory", "restarts"):
        grid.add_column(name, justify="right", no_wrap=True)
    before = None
    for row in listed:
        status, pulse = row.status, row.pulse
        late = None if pulse is None else pulse.late
        grid.add_row(
            "" if status.machine == before else status.machine,
            status.name,
            Text(status.state.value, style=_STYLES[status.state]),
            "" if pulse is None else f"{pulse.frequency:.1f}",
            "" if pulse is None else str(pulse.missed),
            "" if pulse is None else Text(str(pulse.refused), style="bold red" if pulse.refused else ""),
            "" if late is None else Text(f"{1000 * late:.0f} ms", style="bold red" if late > LATE else ""),
            "" if pulse is None or pulse.drift is None else f"{1e6 * pulse.drift:+.0f} ppm",
            "" if status.pid is None else f"{status.cpu:.0%}",
            "" if status.pid is None else f"{status.memory / 1e6:.0f} MB",
            Text(str(status.restarts), style="yellow") if status.restarts else "",
        )
        before = status.machine
    return grid


class ProcessTable(Node):
    """Shows the processes until it is stopped.

    Args:
        console: where to write. On a terminal the table is redrawn in place, else it is printed once.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(self, name: str, mailbox: Mailbox, keys: Keys, *, console: Console) -> None:
        super().__init__(name, mailbox, period=0.5)
        self._console = console
        self._board = Board(mailbox, keys)
        self._live: Live | None = None
        self.printed = False

    def tick(self, tick: Tick) -> None:
        """Take messages in and show the processes."""
        found = self._board.look()
        if self._console.is_terminal:
            if self._live is None:
                # Without its own thread: a node is drawn when it ticks.
                self._live = Live(console=self._console, auto_refresh=False)
                self._live.start()
            self._live.update(process_table(found) if found else Text("waiting for `vrg play`"), refresh=True)
        elif found and not any(row.waits for row in found) and not self.printed:
            self._console.print(process_table(found))
            self.printed = True

    def stop(self) -> None:
        """Leave the last table on the terminal. Calling it again does nothing."""
        if self._live is not None:
            self._live.stop()
            self._live = None
