"""The command `vrg camera`, which saves a picture of what a robot sees while a match runs."""

import queue
import time
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.codec import decode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import CameraRequest
from vrg.bus.session import Session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.official import sender
from vrg.commands.options import EndpointOption, KeysOption, NameOption, which_match
from vrg.commands.topic import arrivals_on, listening
from vrg.errors import BusError, ConfigError, MessageError
from vrg.hal.sensors.camera import Camera

LEASE = 2.0
"""The match time in s for which the world is asked for pictures at a time."""
RENEW = 0.5
"""The real time in s between two requests."""
PATIENCE = 10.0
"""The real time in s to wait for a picture."""


def camera(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Name of a robot, which is that of its player.")],
    file: Annotated[Path, typer.Argument(metavar="FILE.png", help="The file to write; it may exist already.")],
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
) -> None:
    """Save a picture of what the camera of a robot sees now."""
    if file.suffix.lower() != ".png":
        raise ConfigError([f"expected a file that ends in .png, got {file}"])
    name, endpoint = which_match(match, router)
    keys = Keys(name)
    with listening(endpoint, seats) as (stop, session):
        picture = _picture(session, keys, robot, stop)
    if picture is None:
        return
    stamp, taken = picture
    try:
        file.write_bytes(taken.data)
    except OSError as error:
        raise ConfigError([f"{file}: cannot be written: {error.strerror}: choose another place"]) from None
    width, height = taken.size
    typer.echo(f"{file}: what {robot} saw at match time {stamp:.1f} s, {width} x {height} pixels")


def _picture(session: Session, keys: Keys, robot: str, stop: Stop) -> tuple[float, Camera] | None:
    """The next picture of a robot with its stamp, or None if the command is stopped before it comes.

    Raises:
        BusError: none comes within PATIENCE.
    """
    topic = keys.sensor(Camera, robot)
    arrivals = arrivals_on(session, topic.key)
    mailbox, asked, deadline = Mailbox(sender()), 0.0, time.monotonic() + PATIENCE
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
        f"{robot}: no picture of its camera within {PATIENCE:g} s: is there a robot of this name, has its model a "
        "camera, and does the clock run? `vrg topic list` shows what there is"
    )
