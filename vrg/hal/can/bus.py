"""A CAN bus by python-can, with a receive thread of its own. It knows frames, and nothing of motors.

Met in practice, and worked around here: after an interface went down `recv` returns None for ever and the bus still
calls itself active, so health is not judged by the absence of errors; after an interface was deleted the socket stays
dead for good; a full transmit queue is an error at once, whatever the time-out; the receive queue overflows silently.
"""

import contextlib
import errno
import logging
import math
import threading
import time
from collections.abc import Callable, Iterable

import can

from vrg.errors import RobotError
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.link import IDLE_TIMEOUT, SEND_TIMEOUT, Link
from vrg.hal.can.opening import frame_time, open_bus, restart, takes_fd
from vrg.hal.can.sending import Echoes, TokenBucket
from vrg.hal.can.troubles import NoFdError, describe_error, describe_error_frame, errno_of, is_full
from vrg.hal.clock import REAL_CLOCK, MonotonicClock
from vrg.system import boot_time

log = logging.getLogger(__name__)
# python-can tells of every socket that it makes, and logs the errors that it raises as well.
logging.getLogger("can").setLevel(logging.CRITICAL)

_RETRY = 0.6e-3
"""s until a frame is tried again that found the queue full."""
_WALL_CLOCK = frozenset({"socketcan", "udp_multicast"})
"""Interfaces whose time stamps are the time of day; others count from the start of the machine or of an adapter."""
_ECHOING = frozenset({"udp_multicast", "gs_usb", "cantact"})
"""Interfaces that give a sender its own frames back."""
_QUIET = frozenset({"socketcan", "pcan", "virtual"})
"""Interfaces that do not, unless they are told to."""
_TRIED, _ECHO_TIMEOUT = 2, 0.2
"""The first frames that are sent, questions all, and the s within which an adapter of another kind has given them back
if it is one that does: nobody else sends just these."""


class CanBus:
    """One bus.

    Args:
        link: how to reach the bus.
        on_frame: called with every data and remote frame of others, on the receive thread.
        on_trouble: called with what is wrong with the bus, in words, on the receive thread.
        on_quiet: called on the receive thread, when nothing was received for a moment that passes the filters, with the
            monotonic time in s up to which all that was on the bus has been heard.
    """

    def __init__(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = lambda _: None,
        on_quiet: Callable[[float], None] = lambda _: None,
    ) -> None:
        self.link = link
        self._on_frame = on_frame
        self._on_trouble = on_trouble
        self._on_quiet = on_quiet
        self._bus: can.BusABC | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._heard_until = 0.0
        self._wanted: list[Filter] | None = None
        told = link.interface in _ECHOING or bool(link.adapter.get("receive_own_messages"))
        self._echoing: bool | None = told or (False if link.interface in _QUIET else None)
        self._tried: dict[tuple[int, bytes], bool] = {}
        self._tried_at = -math.inf
        self._echoes = Echoes()
        self._echo_lock = threading.Lock()
        self._fd = False
        self._stamps = Stamps() if link.interface in _WALL_CLOCK else None
        self._bucket = TokenBucket(0.0)
        self._pace_lock = threading.Lock()

    def start(self) -> None:
        """Open the bus and begin to listen. Idempotent.

        Raises:
            RobotError: there is no such interface or channel, with what to do.
        """
        if self._bus is not None:
            return
        bus = open_bus(self.link)
        self._filter(bus)
        self._fd = takes_fd(self.link)
        self._bucket = TokenBucket(frame_time(self.link))
        # A new event for each thread, so that one that is late to end is not revived.
        self._stopping = threading.Event()
        self._bus = bus
        name = f"can {self.link}"
        self._thread = threading.Thread(target=self._receive, args=(bus, self._stopping), name=name, daemon=True)
        self._thread.start()

    def listen_to(self, wanted: Iterable[Filter] | None) -> None:
        """Drop all frames but those that one of the filters lets through; the kernel does it where it can.

        Error frames still arrive. This holds when the bus is started again; None hears everything again.
        """
        self._wanted = None if wanted is None else list(wanted)
        if self._bus is not None:
            self._filter(self._bus)

    def _filter(self, bus: can.BusABC) -> None:
        # Elsewhere python-can would drop error frames too.
        if self.link.interface == "socketcan":
            wanted = [] if self._wanted is None else self._wanted
            filters = [{"can_id": f.id, "can_mask": f.mask, "extended": f.extended} for f in wanted]
            bus.set_filters(filters or None)  # type: ignore[arg-type]

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send within SEND_TIMEOUT s or never: nothing is queued here to be sent late.

        Args:
            urgent: it switches a motor off, and does not wait for those that are under way; see `TokenBucket`.

        Raises:
            RobotError: it could not be sent, with the reason.
        """
        # On a bus without CAN FD such a frame is an error to all other nodes.
        if frame.fd and not self._fd:
            raise NoFdError(f"{self.link}: CAN FD is switched off on this interface")
        deadline = time.monotonic() + SEND_TIMEOUT
        while self._bucket.frame_time and (delay := self._reserve(urgent)) > 0:
            if time.monotonic() + delay > deadline:
                raise RobotError(f"{self.link}: more frames wait to be sent than the bus carries in {SEND_TIMEOUT:g} s")
            time.sleep(delay)
        while True:
            bus = self._bus
            if bus is None:
                raise RobotError(f"{self.link}: expected an open bus, this one is closed")
            try:
                self._put(bus, frame)
                return
            except Exception as error:
                # Drivers of adapters raise what they like. Other programs fill the queue too; it is emptied within
                # milliseconds, unless no node takes the frames.
                if not is_full(error) or time.monotonic() > deadline:
                    raise RobotError(f"{self.link}: {describe_error(error)}") from None
            time.sleep(_RETRY)

    def _reserve(self, urgent: bool) -> float:
        """Take a place for a frame; s to wait before it is asked again, if there is none."""
        with self._pace_lock:
            now = time.monotonic()
            delay = 0.0 if urgent else self._bucket.delay(now)
            if delay <= 0:
                self._bucket.sent(now)
            return delay

    def _put(self, bus: can.BusABC, frame: Frame) -> None:
        if self._echoing is False:
            bus.send(can_message(frame))
            return
        # It may come back before `send` returns, and who receives it must not wait for that.
        with self._echo_lock:
            now = time.monotonic()
            self._echoes.sent(frame, now)
            if len(self._tried) < _TRIED:
                self._tried[frame.id, frame.data], self._tried_at = False, now
        try:
            bus.send(can_message(frame))
        except BaseException:
            with self._echo_lock:
                self._echoes.unsent(frame)
            raise

    def restart(self) -> str | None:
        """Bring the controller back if it is bus-off; see `vrg.hal.can.opening.restart`."""
        return restart(self.link)

    def stop(self) -> None:
        """Close the bus. Idempotent. Waits for the receive thread, so hold no lock that its callbacks want."""
        self._stopping.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        bus, self._bus = self._bus, None
        if bus is not None:
            # A deleted interface makes even closing fail; the socket is gone anyway.
            with contextlib.suppress(can.CanError, OSError):
                bus.shutdown()

    def _receive(self, bus: can.BusABC, stopping: threading.Event) -> None:
        while not stopping.is_set():
            try:
                message = bus.recv(IDLE_TIMEOUT)
            except Exception as error:
                # Drivers of adapters raise what they like; a thread that died of it would not be missed.
                if stopping.is_set():
                    return
                self._on_trouble(f"{self.link}: {describe_error(error)}")
                if stopping.wait(IDLE_TIMEOUT) or errno_of(error) in (errno.ENODEV, errno.EBADF):
                    return
                continue
            try:
                if message is None:
                    self._on_quiet(boot_time())
                elif message.is_error_frame:
                    self._error_frame(message)
                else:
                    self._take(frame_of(message, self._stamps))
            except Exception as error:
                # The listener has failed: the motors must stop, and the error must be seen.
                log.exception("%s: a frame could not be handled: %s", self.link, message)
                self._on_trouble(f"{self.link}: a frame could not be handled: {error!r}")

    def _take(self, frame: Frame) -> None:
        """Pass a frame on, unless it is one of our own, or no filter accepts it.

        A listener that receives only frames of others must know that time passes, and that nothing waits to be heard.
        """
        if not self._is_echo(frame) and (self._wanted is None or any(f.passes(frame) for f in self._wanted)):
            self._heard_until = frame.at
            self._on_frame(frame)
        elif frame.at - self._heard_until >= IDLE_TIMEOUT:
            self._heard_until = frame.at
            self._on_quiet(frame.at)

    def _is_echo(self, frame: Frame) -> bool:
        """True if this is one of our own frames that comes back."""
        if self._echoing is False:
            return False
        with self._echo_lock:
            now = time.monotonic()
            back = self._echoes.returns(frame, now)
            if back and (frame.id, frame.data) in self._tried:
                self._tried[frame.id, frame.data] = True
            if self._echoing is None and len(self._tried) == _TRIED:
                if all(self._tried.values()):
                    log.info("%s: the adapter echoes the frames that it sends: the echoes are dropped", self.link)
                    self._echoing = True
                elif now - self._tried_at > _ECHO_TIMEOUT:
                    self._echoing = False
            return back

    def _error_frame(self, message: can.Message) -> None:
        words = describe_error_frame(message.arbitration_id, bytes(message.data))
        if words:
            self._on_trouble(f"{self.link}: {words}")
        else:
            log.info("%s: error frame: class 0x%x, data %s", self.link, message.arbitration_id, message.data.hex())


class RealMedium:
    """The buses and the time of this computer."""

    clock: MonotonicClock = REAL_CLOCK

    bus = CanBus


def can_message(frame: Frame) -> can.Message:
    """A frame as python-can wants it."""
    return can.Message(
        arbitration_id=frame.id,
        data=frame.data,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_fd=frame.fd,
        bitrate_switch=frame.fd,
        check=False,
    )


class Stamps:
    """Tells from the stamps of frames, which are times of day, how long they have waited to be read.

    By this, old heartbeats are not taken for new ones after a freeze. The time of day may be set meanwhile: then, for
    SETTLE s, a frame is as old as it can be by the clock before and by the clock after, whichever is less. Both clocks
    are of this computer and read at one instant, so there is no delay to filter, as `vrg.bus.clock_tracker` does.
    """

    STEP, SETTLE = 0.01, 1.0

    def __init__(self) -> None:
        self._offset = self._before = math.inf
        self._set_at = -math.inf

    def age(self, stamp: float, wall: float, now: float) -> float:
        """The age of a frame, s.

        Args:
            stamp: the time of day at which it was on the bus, s. wall: the time of day, now: the monotonic time, s.
        """
        offset = wall - now
        if abs(offset - self._offset) > self.STEP:
            self._before, self._set_at = self._offset, now
        self._offset = offset
        if now - self._set_at < self.SETTLE:
            offset = min(offset, self._before)
        return max(0.0, now + offset - stamp)


def frame_of(message: can.Message, stamps: Stamps | None = None) -> Frame:
    """The frame that python-can has received.

    Args:
        stamps: the source of its age; without it the frame counts as new.
    """
    now = boot_time()
    waited = stamps.age(message.timestamp, time.time(), now) if stamps is not None and message.timestamp else 0.0
    return Frame(
        message.arbitration_id,
        bytes(message.data),
        message.is_remote_frame,
        message.is_extended_id,
        now - waited,
        message.is_fd,
    )
