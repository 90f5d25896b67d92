"""Emulated drives on a real or virtual bus: the thin shell around them, one thread, one bus."""

import errno
import logging
from collections.abc import Callable, Sequence

import can

from vrg.bus.stopping import StopSignal
from vrg.errors import RobotError
from vrg.hal.can.bus import can_message, frame_of
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.opening import open_bus
from vrg.hal.can.troubles import describe_error, errno_of
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.system import boot_time

log = logging.getLogger(__name__)

_REOPEN = 0.1
"""s between tries to open an interface that has gone; a real drive stays on its wires too."""
_LONGEST = 0.1
"""s between looks at `stop`."""


def run_drives(
    link: Link, drives: Sequence[EmulatedDrive], stop: StopSignal, *, ready: Callable[[], None] = lambda: None
) -> None:
    """Be these drives until `stop` is set. If the interface goes down or away, wait until it is back.

    Args:
        link: how to reach the bus. drives: all of them are on it.
        stop: ends this. ready: called once they are on the bus.

    Raises:
        RobotError: there is no such interface to begin with.
    """
    bus: can.BusABC | None = open_bus(link)
    ready()
    try:
        while not stop.is_set():
            try:
                bus = bus or open_bus(link)
                _serve(bus, drives, stop)
            except (can.CanError, OSError, RobotError) as error:
                log.info("%s: %s", link, describe_error(error))
                if bus is not None and errno_of(error) in (errno.ENODEV, errno.ENXIO, errno.EBADF):
                    _shut(bus)
                    bus = None
                # Motors go on while no order can be sent.
                for drive in drives:
                    drive.step(boot_time())
                stop.wait(_REOPEN)
    finally:
        if bus is not None:
            _shut(bus)


def _serve(bus: can.BusABC, drives: Sequence[EmulatedDrive], stop: StopSignal) -> None:
    while not stop.is_set():
        pause = min(drive.due for drive in drives) - boot_time()
        message = bus.recv(max(0.0, min(pause, _LONGEST)))
        now = boot_time()
        if message is not None and not message.is_error_frame:
            frame = frame_of(message)
            for drive in drives:
                _send(bus, drive.receive(frame, now))
        for drive in drives:
            if drive.due <= now:
                _send(bus, drive.step(now))


def _send(bus: can.BusABC, frames: Sequence[Frame]) -> None:
    for frame in frames:
        try:
            bus.send(can_message(frame))
        except can.CanOperationError as error:
            # A drive whose bus is full loses its frame, and goes on.
            if errno_of(error) != errno.ENOBUFS:
                raise


def _shut(bus: can.BusABC) -> None:
    try:
        bus.shutdown()
    except (can.CanError, OSError) as error:
        log.debug("closing the bus: %s", error)
