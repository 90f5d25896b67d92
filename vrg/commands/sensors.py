"""The commands `vrg show sensors` and `camera`: what a robot measures and sees while a match runs."""

import queue
import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.live import Live

from vrg.bus.codec import Received, decode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import CameraRequest, SensorMessage, Stage
from vrg.bus.session import Session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import Attached, attached
from vrg.commands.official import sender
from vrg.commands.options import OutputOption, PlayerArgument, lasting, make_console, write_text
from vrg.commands.topic import arrivals_on, listening
from vrg.errors import BusError, ConfigError, LaunchError, MessageError
from vrg.hal.sensors import message_class
from vrg.hal.sensors.camera import Camera
from vrg.launch.first_state import first_state
from vrg.names import chunk_of, name_of
from vrg.registry import expected_one_of
from vrg.ui.readings import Watched, sensor_table

REDRAW = 0.25
"""The real time in s between two tables."""
QUIET = 3.0
"""The real time in s without a reading after which a hint is printed."""
LEASE = 2.0
"""The match time in s for which the world is asked for pictures at a time."""
RENEW = 0.5
"""The real time in s between two requests."""
PICTURE_TIMEOUT = 10.0
"""The real time in s to wait for a picture."""


def sensors(
    player: PlayerArgument,
    on: MatchOptions,
    seconds: Annotated[float | None, lasting("Show one table after this time, and end.", 0.5)] = None,
) -> None:
    """Show what the sensors of a robot measure now: those that the world simulates. The command ends with the match.

    If the output is not a terminal, each reading is a line, or with --for, one table is printed.
    """
    found, console = attached(on), make_console()
    watched, now, hinted = Watched(), 0.0, False
    in_lines = seconds is None and not console.is_terminal
    with listening(found.endpoint, on.keys) as (stop, session):
        _check_player(found, session, player, stop)
        begun = time.monotonic()
        readings = f"{found.keys.root}/robot/{chunk_of(player)}/sensor/**"
        arrivals = arrivals_on(session, readings, found.keys.clock.key, found.keys.referee_state.key)
        with Live(console=console, auto_refresh=False) as live:
            ended = False
            while not ended and not stop.wait(REDRAW):
                # A launcher that is gone has taken the router with it, and nothing tells of the end.
                ended = (seconds is not None and time.monotonic() - begun >= seconds) or not session.connected
                while not arrivals.empty():
                    reading = _read(found.keys, *arrivals.get_nowait())
                    now = now if reading is None else max(now, reading.stamp)
                    if reading is not None and isinstance(reading.body, SensorMessage):
                        *_, kind, sensor = reading.key.split("/")
                        watched.take((kind, name_of(sensor)), reading)
                        if in_lines:
                            typer.echo(f"{reading.stamp:.2f} {kind} {name_of(sensor)}: {reading.body.words}")
                    elif reading is not None and getattr(reading.body, "stage", None) is Stage.GAME_OVER:
                        ended = True
                if watched.newest and (console.is_terminal or (ended and not in_lines)):
                    live.update(sensor_table(watched, player, now), refresh=True)
                elif not watched.newest and not hinted and time.monotonic() - begun > QUIET:
                    hinted = True
                    typer.echo(
                        f"{player}: no reading yet. The world simulates the sensors of virtual robots, and of physical "
                        "ones those that they lack; `vrg topic list` shows what there is.",
                        err=True,
                    )
    if not watched.newest and seconds is not None:
        raise typer.Exit(1)


def camera(player: PlayerArgument, on: MatchOptions, output: OutputOption = None) -> None:
    """Save a picture of what the camera of a robot sees now, as PLAYER.png or another file that is named."""
    file = output or Path(f"{player}.png")
    if file.suffix.lower() != ".png":
        raise ConfigError(f"expected a file that ends in .png, got {file}")
    found = attached(on)
    with listening(found.endpoint, on.keys) as (stop, session):
        _check_player(found, session, player, stop)
        picture = _picture(session, found.keys, player, stop)
    if picture is None:
        return
    stamp, taken = picture
    write_text(file, taken.data)
    width, height = taken.size
    typer.echo(f"{file}: what {player} saw at match time {stamp:.1f} s, {width} x {height} pixels")


def _check_player(found: Attached, session: Session, player: str, stop: Stop) -> None:
    """Make sure that there is such a player. Where the set-up of the match is not known, the referee's state has them.

    Raises:
        LaunchError: there is none.
    """
    match = found.setup if found.setup.players else first_state(session, found.keys, stop)
    names = [] if match is None else [known.name for known in match.players]
    if names and player not in names:
        raise LaunchError(f"PLAYER: {expected_one_of(names, player)}")


def _read(keys: Keys, key: str, payload: bytes) -> Received[Any] | None:
    """A message, or None for one that cannot be read here."""
    topic = keys.topic_of(key, message_class)
    try:
        return None if topic is None else decode(payload, topic.type, key)
    except MessageError:
        return None


def _picture(session: Session, keys: Keys, robot: str, stop: Stop) -> tuple[float, Camera] | None:
    """The next picture of a robot with its stamp, or None if the command is stopped before it comes.

    Raises:
        BusError: none comes within PICTURE_TIMEOUT.
    """
    topic = keys.sensor(Camera, robot)
    arrivals = arrivals_on(session, topic.key)
    mailbox, asked, deadline = Mailbox(sender()), 0.0, time.monotonic() + PICTURE_TIMEOUT
    while not stop.is_set() and (now := time.monotonic()) < deadline:
        if now - asked >= RENEW:
            asked = now
            mailbox.publish(keys.camera_request(robot), CameraRequest(lease=LEASE))
            session.send(mailbox.collect())
        try:
            key, payload = arrivals.get(timeout=0.1)
            received = decode(payload, topic.type, key)
        except (queue.Empty, MessageError):
            continue
        return received.stamp, received.body
    if stop.is_set():
        return None
    raise BusError(
        f"{robot}: no picture from its camera within {PICTURE_TIMEOUT:g} s: does its model have a camera, and does the "
        "clock run? `vrg topic list` shows what there is"
    )
