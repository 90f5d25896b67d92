"""A CAN bus by python-can, with a receive thread of its own. It knows frames, and nothing of motors.

Met in practice, and worked around here: after an interface went down `recv` returns None for ever and the bus still
calls itself active, so nobody judges health by the absence of errors; after an interface was deleted the socket stays
dead for good; a full transmit queue is an error at once, whatever the time-out; the receive queue overflows silently.
"""

import contextlib
import errno
import logging
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import can

from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link

log = logging.getLogger(__name__)
# python-can tells of every socket that it makes, and logs the errors that it raises as well.
logging.getLogger("can").setLevel(logging.CRITICAL)

RECEIVE_BUFFER = 1 << 20
"""The size of the receive buffer in bytes: it holds some 4000 frames, where the default holds 278."""
_POLL = 0.05
"""s between looks at the bus when nothing arrives."""
_WALL_CLOCK = frozenset({"socketcan", "udp_multicast"})
"""Interfaces whose time stamps are the time of day; others count from the start of the machine or of an adapter."""
_ECHOING = frozenset({"udp_multicast"})
"""Interfaces that give a sender its own frames back."""

_FATAL_CLASSES = {
    0x00000001: "transmit time-out",
    0x00000010: "transceiver error",
    0x00000020: "no node acknowledges: is another one switched on, and the bus terminated?",
    0x00000040: "bus-off: the controller has given up after too many errors",
}
"""Classes of error frames (linux/can/error.h) after which nothing can be relied on."""
_CONTROLLER_CLASS = 0x00000004
_CONTROLLER = {
    0x01: "receive overflow in the controller: frames were lost",
    0x02: "transmit overflow in the controller: frames were lost",
    0x10: "error-passive: too many receive errors",
    0x20: "error-passive: too many transmit errors",
}
"""What the second byte of a controller's error frame may say, by its bits."""


class CanBus:
    """One bus.

    Args:
        link: how to reach the bus.
        on_frame: called with every data and remote frame of others, on the receive thread.
        on_trouble: called with what is wrong with the bus, in words, on the receive thread.
        on_quiet: called on the receive thread when nothing has come for a moment.
    """

    def __init__(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = lambda _: None,
        on_quiet: Callable[[], None] = lambda: None,
    ) -> None:
        self.link = link
        self._on_frame = on_frame
        self._on_trouble = on_trouble
        self._on_quiet = on_quiet
        self._bus: can.BusABC | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._filters: list[can.typechecking.CanFilter] | None = None
        self._echoes: Counter[tuple[int, bytes, bool]] = Counter()
        self._echo_lock = threading.Lock()

    def start(self) -> None:
        """Open the bus and begin to listen. Idempotent.

        Raises:
            RobotError: there is no such interface or channel; says what to do.
        """
        if self._bus is not None:
            return
        bus = open_bus(self.link)
        if self._filters is not None:
            bus.set_filters(self._filters)
        # A new event for each thread, so that one that is late to end is not revived.
        self._stopping = threading.Event()
        self._bus = bus
        name = f"can {self.link}"
        self._thread = threading.Thread(target=self._receive, args=(bus, self._stopping), name=name, daemon=True)
        self._thread.start()

    def listen_to(self, wanted: Iterable[tuple[int, int]] | None) -> None:
        """Let the kernel drop all but 11-bit identifiers with `identifier & mask == id & mask`, of pairs (id, mask).

        Error frames still arrive. This holds when the bus is started again; None hears everything again.
        """
        self._filters = None
        if wanted is not None:
            self._filters = [{"can_id": id_, "can_mask": mask, "extended": False} for id_, mask in wanted]
        if self._bus is not None:
            self._bus.set_filters(self._filters)

    def send(self, frame: Frame) -> None:
        """Send now or never: what cannot go out at once is dropped; nothing is queued here to be sent late.

        Raises:
            RobotError: it could not be sent; says why.
        """
        bus = self._bus
        if bus is None:
            raise RobotError(f"{self.link}: expected an open bus, this one is closed")
        try:
            if self.link.interface in _ECHOING:
                with self._echo_lock:
                    bus.send(message_of(frame))
                    self._echoes[frame.id, frame.data, frame.remote] += 1
            else:
                bus.send(message_of(frame))
        except (can.CanError, OSError, ValueError) as error:
            raise RobotError(f"{self.link}: {describe_error(error)}") from None

    def stop(self) -> None:
        """Close the bus. Idempotent. Waits for the receive thread, so hold no lock that its callbacks want."""
        self._stopping.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        bus, self._bus = self._bus, None
        if bus is not None:
            # A deleted interface makes even closing fail; the socket is gone all the same.
            with contextlib.suppress(can.CanError, OSError):
                bus.shutdown()

    def _receive(self, bus: can.BusABC, stopping: threading.Event) -> None:
        while not stopping.is_set():
            try:
                message = bus.recv(_POLL)
            except Exception as error:
                # Drivers of adapters raise what they like; a thread that died of it would be missed by nobody.
                if stopping.is_set():
                    return
                self._on_trouble(f"{self.link}: {describe_error(error)}")
                if stopping.wait(_POLL) or errno_of(error) in (errno.ENODEV, errno.EBADF):
                    return
                continue
            try:
                if message is None:
                    self._on_quiet()
                elif message.is_error_frame:
                    self._error_frame(message)
                elif not self._is_echo(frame := frame_of(message, stamped=self.link.interface in _WALL_CLOCK)):
                    self._on_frame(frame)
            except Exception as error:
                # Whoever listens has failed: the motors must stop, and somebody must see it.
                log.exception("%s: a frame could not be handled: %s", self.link, message)
                self._on_trouble(f"{self.link}: a frame could not be handled: {error!r}")

    def _is_echo(self, frame: Frame) -> bool:
        """Whether this is one of our own frames that comes back."""
        if self.link.interface not in _ECHOING:
            return False
        key = (frame.id, frame.data, frame.remote)
        with self._echo_lock:
            if key not in self._echoes:
                return False
            self._echoes[key] -= 1
            if not self._echoes[key]:
                del self._echoes[key]
        return True

    def _error_frame(self, message: can.Message) -> None:
        words = describe_error_frame(message.arbitration_id, bytes(message.data))
        if words:
            self._on_trouble(f"{self.link}: {words}")
        else:
            log.info("%s: error frame: class 0x%x, data %s", self.link, message.arbitration_id, message.data.hex())


def open_bus(link: Link) -> can.BusABC:
    """Open a bus by python-can.

    Raises:
        RobotError: there is no such interface or channel; says what to do.
    """
    options: dict[str, Any] = {} if link.bitrate is None else {"bitrate": link.bitrate}
    try:
        bus = can.Bus(interface=link.interface, channel=link.channel, ignore_config=True, **options)
    except (can.CanError, OSError, ValueError, ImportError, NotImplementedError) as error:
        raise RobotError(f"{link}: {_explain_open(link, error)}") from None
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        # Root may exceed net.core.rmem_max; who may not gets as much as there is.
        try:
            raw.setsockopt(socket.SOL_SOCKET, getattr(socket, "SO_RCVBUFFORCE", 33), RECEIVE_BUFFER)
        except OSError:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return bus


def _explain_open(link: Link, error: Exception) -> str:
    number = errno_of(error)
    if link.interface == "socketcan" and number == errno.ENODEV:
        make = f"`ip link add {link.channel} type vcan && ip link set {link.channel} up` as root, or scripts/with-vcan"
        hint = f"; a virtual one comes by {make}" if link.channel.startswith("vcan") else "; `ip link` lists them"
        return f"no such CAN interface on this machine{hint}"
    if link.interface == "socketcan" and number == errno.EAFNOSUPPORT:
        return "this machine's kernel has no CAN: see scripts/with-vcan"
    return f"cannot be opened by python-can's interface {link.interface!r}: {error}"


def describe_error(error: Exception) -> str:
    """What an error of python-can means for who uses the bus."""
    number = errno_of(error)
    if number == errno.ENETDOWN:
        return "the interface is down"
    if number in (errno.ENODEV, errno.ENXIO, errno.EBADF):
        return "the interface is gone"
    if number == errno.ENOBUFS:
        return "the transmit queue is full: nobody takes the frames off the bus"
    return str(error) or type(error).__name__


def describe_error_frame(error_class: int, data: bytes) -> str | None:
    """What an error frame says, in words; None where it is no reason to stop."""
    found = [words for bit, words in _FATAL_CLASSES.items() if error_class & bit]
    if error_class & _CONTROLLER_CLASS and len(data) > 1:
        found += [words for bit, words in _CONTROLLER.items() if data[1] & bit]
    return "; ".join(found) or None


def errno_of(error: Exception) -> int | None:
    """The system's number of an error; python-can hides it in an attribute of its own, or in the cause."""
    for candidate in (getattr(error, "error_code", None), getattr(error, "errno", None)):
        if isinstance(candidate, int):
            return candidate
    cause = error.__cause__ or error.__context__
    return errno_of(cause) if isinstance(cause, Exception) else None


def message_of(frame: Frame) -> can.Message:
    """A frame as python-can wants it."""
    return can.Message(
        arbitration_id=frame.id,
        data=frame.data,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        check=False,
    )


def frame_of(message: can.Message, *, stamped: bool = True) -> Frame:
    """What python-can has received.

    Args:
        stamped: its time stamp is the time of day at which it was on the bus; otherwise it counts as new.
    """
    # The kernel's stamp tells how long a frame has waited to be read: after a freeze, old heartbeats are not taken for
    # new ones. A clock that is set meanwhile makes a frame at most older, never newer than now.
    waited = max(0.0, time.time() - message.timestamp) if stamped and message.timestamp else 0.0
    return Frame(
        message.arbitration_id,
        bytes(message.data),
        message.is_remote_frame,
        message.is_extended_id,
        time.monotonic() - waited,
    )
