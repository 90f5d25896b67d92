import io

from rich.console import Console

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message, Processes, ProcessState, ProcessStatus, Pulse
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.ui.processes import Board, ProcessTable, process_table

KEYS = Keys("lab")
ANN = ProcessStatus(
    name="ann", machine="lab2", state=ProcessState.RUNNING, node="player/ann", pid=7, cpu=0.25, memory=48_000_000,
    restarts=2,
)  # fmt: skip
ROUTER = ProcessStatus(name="router", machine="here", state=ProcessState.RUNNING, pid=8, memory=1_000_000)
AWAY = ProcessStatus(name="bob", machine="lab3", state=ProcessState.AWAY, node="player/bob")


def tell(mailbox: Mailbox, key: str, body: Message) -> None:
    for inlet in mailbox.inlets:
        if inlet.topic.type is type(body):
            inlet.offer(Received(key, 0.0, 0, body))
    mailbox.handover(0.0)


def written(table: object) -> str:
    console = Console(width=120, record=True, file=io.StringIO())
    console.print(table)
    return console.export_text()


def test_each_process_is_shown_with_what_it_tells_itself() -> None:
    mailbox = Mailbox()
    board = Board(mailbox, KEYS)
    tell(mailbox, KEYS.processes.key, Processes(processes=(ROUTER, ANN, AWAY)))
    pulse = Pulse(ticks=90, missed=3, frequency=9.96, late=0.012, drift=-4e-5, refused=7)
    tell(mailbox, KEYS.pulse("player", "ann").key, pulse)
    tell(mailbox, KEYS.pulse("player", "bob").key, pulse)
    lines = written(process_table(board.look())).splitlines()
    assert lines[1].split() == ["here", "router", "running", "0%", "1", "MB"]
    assert lines[2].split() == [
        "lab2", "ann", "running", "10.0", "3", "7", "12", "ms", "-40", "ppm", "25%", "48", "MB", "2",
    ]  # fmt: skip
    assert lines[3].split() == ["lab3", "bob", "away"], "what it told before counts no more"
    assert board.machines == {"here", "lab2", "lab3"}


def test_where_the_output_is_no_terminal_it_is_printed_once_and_whole() -> None:
    mailbox = Mailbox()
    console = Console(width=120, record=True, force_terminal=False, file=io.StringIO())
    node = ProcessTable("processes", mailbox, KEYS, console=console)
    node.tick(Tick(0.0))
    tell(mailbox, KEYS.processes.key, Processes(processes=(ROUTER, ANN, AWAY)))
    node.tick(Tick(0.5))
    assert not node.printed, "ann has told nothing of itself yet"
    tell(mailbox, KEYS.pulse("player", "ann").key, Pulse(ticks=1, missed=0))
    node.tick(Tick(1.0))
    node.tick(Tick(1.5))
    assert node.printed
    assert console.export_text().count("ann") == 1
