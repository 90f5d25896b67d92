"""`vrg can scan | monitor | calibrate`: who is on a bus, how they are, and how a robot's wheels really turn."""

import math
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from vrg.bus.stopping import Stop
from vrg.commands.options import stoppable
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.calibration import calibration_text, load_calibration
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import HEARTBEAT_TIMEOUT
from vrg.hal.can.link import Link, read_adapter
from vrg.hal.can.listener import Found
from vrg.hal.can.settings import can_settings
from vrg.hal.can.survey import Survey, all_listeners
from vrg.hal.models import robot_model

InterfaceOption = Annotated[str, typer.Option("--interface", help="python-can's name of the interface.")]
ChannelOption = Annotated[str, typer.Option("--channel", help="The bus, such as can0.")]
AnyChannelOption = Annotated[
    str | None, typer.Option("--channel", help="The bus; can0 if missing, or vcan0 where there is no can0.")
]
BitrateOption = Annotated[int | None, typer.Option("--bitrate", help="bit/s, where the interface sets it itself.")]
AdapterOption = Annotated[
    list[str] | None,
    typer.Option("--adapter", help="A further option of python-can's interface, NAME=VALUE; several are possible."),
]

_ASK_PERIOD = 0.5
"""s between questions to the drives."""


@dataclass(frozen=True)
class Heard:
    """Who is on a bus, and what is wrong with the bus itself, in words."""

    nodes: list[Found]
    troubles: list[str]


def scan(
    channel: AnyChannelOption = None,
    interface: InterfaceOption = "socketcan",
    bitrate: BitrateOption = None,
    adapter: AdapterOption = None,
    seconds: Annotated[float, typer.Option("--for", min=0.3, max=60, help="How long to listen, s.")] = 1.5,
) -> None:
    """Say which drives are on a bus: protocol, id, serial number, firmware, state and errors. Moves nothing."""
    link = link_of(interface, channel or _channel(), bitrate, adapter)
    console = Console(highlight=False)
    with stoppable() as stop, _listening(link) as look, console.status(f"listening on {link}"):
        heard = _look_for(look, stop, True, seconds)
    if heard.nodes:
        console.print(_table(heard, time.monotonic()))
        return
    for words in heard.troubles:
        console.print(f"[red]{escape(words)}[/red]")
    console.print(f"{link}: nobody. Is the bus wired and powered, and the bit rate right?")
    raise typer.Exit(1)


def monitor(
    channel: AnyChannelOption = None,
    interface: InterfaceOption = "socketcan",
    bitrate: BitrateOption = None,
    adapter: AdapterOption = None,
    seconds: Annotated[
        float | None, typer.Option("--for", min=0.3, help="How long, s; until Ctrl-C if missing.")
    ] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask the drives too, which disturbs a robot that is just connecting.")
    ] = False,
) -> None:
    """Show the drives on a bus, live, by what they say. Moves nothing, and sends nothing but for `--ask`."""
    link = link_of(interface, channel or _channel(), bitrate, adapter)
    console = Console(highlight=False)
    end = math.inf if seconds is None else time.monotonic() + seconds
    with stoppable() as stop, _listening(link) as look, Live(console=console, refresh_per_second=5) as live:
        while not stop.is_set() and time.monotonic() < end:
            heard = _look_for(look, stop, ask, min(_ASK_PERIOD, max(0.05, end - time.monotonic())))
            live.update(_table(heard, time.monotonic()))


def calibrate(
    match: Annotated[str, typer.Argument(metavar="match.toml", help="The match file that wires the robot.")],
    player: Annotated[str, typer.Argument(help="Whose robot.")],
    output: Annotated[Path | None, typer.Option(help="The calibration file; the wiring's own if missing.")] = None,
    speed: Annotated[float, typer.Option(min=0.02, max=1, help="Speed while it is measured, m/s.")] = 0.2,
    way: Annotated[float, typer.Option(min=0.2, max=20, help="How far straight ahead, m.")] = 1.5,
    turns: Annotated[float, typer.Option(min=0.25, max=20, help="Turns on the spot.")] = 2.0,
) -> None:
    """Find a robot's directions, gear ratios and track, with a tape measure; writes its calibration file."""
    from vrg.config.loading import match_path, read_match  # the other tools need no match file
    from vrg.hal.can import calibrating  # python-can is for who uses a bus
    from vrg.hal.can.train import DriveTrain

    # What the robot has been calibrated to so far, its file included, may be missing or wrong: that is to be mended.
    file, base = read_match(match_path(match)), match_path(match).resolve().parent
    settings = can_settings(file.backends.get("can", {}))
    if player not in settings.robots:
        known = ", ".join(settings.robots) or "none"
        raise ConfigError([f"{match}: expected a robot of [backends.can.robots] ({known}), got {player!r}"])
    wiring = settings.robots[player]
    own = base / (wiring.calibration or f"{player}.cal.toml")
    where = output or own
    if not os.access(where.parent, os.W_OK) or where.is_dir():
        raise ConfigError([f"{where}: expected a place to write the calibration to, this is none"])
    before = load_calibration(own, wiring.nodes) if wiring.calibration and own.exists() else None
    model = robot_model(next((p.model for p in file.players if p.name == player), "P2AT"))
    axes = wiring.wheel_axes(before)
    unwatched = wiring.watchdog == "unsafe"
    link, spoken, own_options = settings.link(player), settings.protocol_of(player), settings.options_of(player)
    train = DriveTrain(player, link, spoken, axes, model, options=own_options, unwatched=unwatched)
    plan = calibrating.Plan(speed=speed, way=way, turn=turns * 2 * math.pi)
    typer.echo(f"Calibrating {player} ({model.name}) on {settings.link(player)}. Keep a hand at the power switch.")
    if settings.emulate:
        (drives,) = settings.companions([player])
        typer.echo(f"(Its drives are emulated: `vrg {' '.join(drives.arguments)}` must run.)")
    train.connect()
    try:
        found = calibrating.calibrate(train, model, _Asker(), plan)
    except ValueError as error:
        raise ConfigError([f"{player}: a measurement that cannot be: {error}"]) from None
    finally:
        train.close()
    where.write_text(calibration_text(found), encoding="utf-8")
    typer.echo(f"Written to {where}.")
    if wiring.calibration is None or own != where:
        typer.echo(f'To use it, write `calibration = "{where.name}"` below [backends.can.robots.{player}] of {match}.')


def link_of(interface: str, channel: str, bitrate: int | None, adapter: list[str] | None) -> Link:
    """The bus that a command's options mean.

    Raises:
        ConfigError: an option of the adapter makes no sense.
    """
    try:
        return Link(interface=interface, channel=channel, bitrate=bitrate, adapter=read_adapter(adapter or []))
    except ValueError as error:
        raise ConfigError([f"--adapter: {error}"]) from None


def _channel() -> str:
    """The bus that is meant where none is named: whoever has no real bus means the virtual one."""
    names = {name for _, name in socket.if_nameindex()}
    return "vcan0" if "vcan0" in names and "can0" not in names else "can0"


class _Asker:
    """Asks the person who sits at the terminal."""

    def ready(self, words: str) -> None:
        """Say what is to be done, and wait for Enter."""
        typer.prompt(f"{words} Then press Enter", default="", show_default=False)

    def agrees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no. Enter alone is no answer: nobody should guess a direction."""
        return typer.confirm(question, default=None)

    def measures(self, question: str, expected: float) -> float:
        """Ask for a number."""
        answer: float = typer.prompt(question, type=float, default=round(expected, 3))
        return answer

    def told(self, words: str) -> None:
        """Print something."""
        typer.echo(words)


@contextmanager
def _listening(link: Link) -> Iterator[Callable[[Stop, bool], Heard]]:
    """Listen to a bus; each call of what this yields asks everybody, if it is to, and tells what has been heard."""
    from vrg.hal.can.bus import CanBus  # python-can is for who uses a bus

    lock = threading.Lock()
    troubles: dict[str, None] = {}

    def hear(frame: Frame) -> None:
        with lock:
            survey.hear(frame)

    def complain(words: str) -> None:
        troubles[words] = None

    bus = CanBus(link, hear, complain)
    survey = Survey(all_listeners(bus.send))
    bus.start()

    def look(stop: Stop, ask: bool) -> Heard:
        with lock:
            nodes = survey.nodes
        if not ask:
            return Heard(nodes, list(troubles))
        try:
            survey.greet()
            for found in nodes:
                # An answer may have to be waited for: a node that has fallen silent is not asked.
                if not stop.is_set() and time.monotonic() - found.heard < HEARTBEAT_TIMEOUT:
                    survey.ask(found)
        except RobotError as error:
            troubles.setdefault(str(error))
        return Heard(nodes, list(troubles))

    try:
        yield look
    finally:
        bus.stop()


def _look_for(look: Callable[[Stop, bool], Heard], stop: Stop, ask: bool, seconds: float) -> Heard:
    """Look again and again for a while."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0 and not stop.is_set():
        look(stop, ask)
        stop.wait(min(_ASK_PERIOD, left))
    return look(stop, ask)


def _table(heard: Heard, now: float) -> Group:
    """A row for each drive, and below them what is wrong, in whole words."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for name in ("protocol", "id", "serial", "firmware", "state", "turns", "turns/s", "V"):
        table.add_column(name, justify="right" if name in ("id", "turns", "turns/s", "V") else "left")
    wrong = [f"[red]{escape(words)}[/red]" for words in heard.troubles]
    for found in heard.nodes:
        silent = now - found.heard
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
