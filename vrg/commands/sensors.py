"""The command `vrg sensors`, which shows what the sensors of a robot measure while a match runs."""

import time
from typing import Annotated, Any

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
from vrg.ui.readings import Watched, sensor_table

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
    """Show what the sensors of a robot measure now: those that the world simulates.

    Where the output is no terminal, each reading is a line, or the table comes once after --seconds.
    """
    name, endpoint = which_match(match, router)
    keys, console = Keys(name), Console(highlight=False)
    watched, now, begun, told = Watched(), 0.0, time.monotonic(), False
    in_lines = seconds is None and not console.is_terminal
    with listening(endpoint, seats) as (stop, session):
        arrivals = arrivals_on(session, f"{keys.root}/robot/{chunk_of(robot)}/sensor/**", keys.clock.key)
        with Live(console=console, auto_refresh=False) as live:
            ended = False
            while not ended and not stop.wait(REDRAW):
                ended = seconds is not None and time.monotonic() - begun >= seconds
                while not arrivals.empty():
                    reading = _read(keys, *arrivals.get_nowait())
                    now = now if reading is None else max(now, reading.stamp)
                    if reading is not None and isinstance(reading.body, SensorMessage):
                        *_, kind, sensor = reading.key.split("/")
                        watched.take((kind, name_of(sensor)), reading)
                        if in_lines:
                            typer.echo(f"{reading.stamp:.2f} {kind} {name_of(sensor)}: {reading.body.words}")
                if watched.newest and (ended or console.is_terminal):
                    live.update(sensor_table(watched, robot, now), refresh=True)
                elif not watched.newest and not told and time.monotonic() - begun > QUIET:
                    told = True
                    typer.echo(
                        f"{robot}: no reading yet. The world simulates the sensors of virtual robots, and of physical "
                        "ones those that they lack; `vrg topic list` shows what there is.",
                        err=True,
                    )
    if not watched.newest and seconds is not None:
        raise typer.Exit(1)


def _read(keys: Keys, key: str, payload: bytes) -> Received[Any] | None:
    """A message, or None for one that cannot be read here."""
    topic = keys.topic_of(key, message_of)
    try:
        return None if topic is None else decode(payload, topic.type, key)
    except MessageError:
        return None
