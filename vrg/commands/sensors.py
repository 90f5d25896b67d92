"""The command `vrg sensors`, which shows what the sensors of a robot measure while a match runs."""

import time
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live

from vrg.bus.codec import Received, decode
from vrg.bus.messages import SensorMessage
from vrg.bus.names import chunk_of, name_of
from vrg.bus.topics import Keys
from vrg.commands.options import EndpointOption, KeysOption, NameOption, which_match
from vrg.commands.topic import arrivals_on, listening
from vrg.errors import MessageError
from vrg.hal.sensors import message_of
from vrg.ui.readings import Sensor, Watched, sensor_table

REDRAW = 0.25
"""The real time in s between two tables."""
QUIET = 3.0
"""The real time in s without a reading after which that is told."""


def sensors(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Name of a robot, which is that of its player.")],
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.5, help="Show one table after so long, real time, and end.")
    ] = None,
) -> None:
    """Show what the sensors of a robot measure now: those that the world simulates."""
    name, endpoint = which_match(match, router)
    keys, console = Keys(name), Console(highlight=False)
    watched, now, begun, told = Watched(), 0.0, time.monotonic(), False
    with listening(endpoint, seats) as (stop, session):
        arrivals = arrivals_on(session, f"{keys.root}/robot/{chunk_of(robot)}/sensor/**")
        with Live(console=console, auto_refresh=False, transient=False) as live:
            while not stop.wait(REDRAW if seconds is None else seconds):
                while not arrivals.empty():
                    read = _read(keys, *arrivals.get_nowait())
                    if read is not None:
                        watched.take(*read)
                        now = max(now, read[1].stamp)
                if watched.newest:
                    live.update(sensor_table(watched, robot, now), refresh=True)
                elif not told and time.monotonic() - begun > QUIET:
                    told = True
                    typer.echo(
                        f"{robot}: no reading yet. The world simulates the sensors of virtual robots, and of physical "
                        "ones those that they lack; `vrg topic list` shows what there is.",
                        err=True,
                    )
                if seconds is not None:
                    break
    if not watched.newest and seconds is not None:
        raise typer.Exit(1)


def _read(keys: Keys, key: str, payload: bytes) -> tuple[Sensor, Received[SensorMessage]] | None:
    """A reading with its sensor, or None for a message that cannot be read here."""
    topic = keys.topic_of(key, message_of)
    try:
        reading = None if topic is None else decode(payload, topic.type, key)
    except MessageError:
        return None
    if reading is None or not isinstance(reading.body, SensorMessage):
        return None
    *_, kind, sensor = key.split("/")
    return (kind, name_of(sensor)), Received(reading.key, reading.stamp, reading.sequence, reading.body, reading.sender)
