"""A node's connection to the bus: a client of one router.

Callbacks of zenoh's only put what has arrived aside, as a publication from inside a callback can hang; and they sound
alarms. What came under a wrong key, or with seats from a sender that may not publish there, is refused here, before a
node hears of it.
"""

import json
import logging
import os
import threading
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, Final

import zenoh

from vrg.bus.access import may_publish
from vrg.bus.codec import Header, encode, header
from vrg.bus.configuration import check_endpoint, client_settings, router_settings
from vrg.bus.credentials import Credentials
from vrg.bus.flood import MAX_MESSAGE_RATE, FlowMeter
from vrg.bus.link import RouterLink, kept_events, subscription
from vrg.bus.mailbox import QUEUE_LIMIT, Inlet, Mailbox, Numbers, Origin, Outgoing
from vrg.bus.messages import Message
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Qos, router_alive
from vrg.bus.transport import OnArrival
from vrg.errors import BusError, CredentialsError, MessageError, MisroutedError

log = logging.getLogger(__name__)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
ASKING: Final = 1.0
"""The longest real time in s to wait for the events that were missed while the link was lost."""
LIVELINESS_TIMEOUT: Final = 1.0
"""The longest real time in s to wait for the router's answer to who is alive."""
REFUSED_KEYS: Final = 1000
"""The number of keys for which refused messages are counted one by one."""


def configuration(settings: dict[str, Any]) -> zenoh.Config:
    """Zenoh's own form of settings, such as `vrg.bus.configuration.client_settings` makes."""
    return zenoh.Config.from_json5(json.dumps(settings))


@contextmanager
def open_session(
    endpoint: str = DEFAULT_ENDPOINT,
    *,
    patience: float = 10.0,
    stop: StopSignal | None = None,
    credentials: Credentials | None = None,
    shared_memory: bool = True,
) -> Iterator["Session"]:
    """Connect to the router at `endpoint`; try for `patience` seconds of real time.

    Args:
        credentials: those of the seat of this process, if the router lets only seats in.
        shared_memory: False for a process that may make none, because it is sealed.

    Raises:
        BusError: no router answers there, or `endpoint` is no endpoint.
        CredentialsError: the router does not let this seat in, or is not the one of this match.
        KeyboardInterrupt: `stop` was set while trying.
    """
    check_endpoint(endpoint, credentials)
    stop = stop or threading.Event()
    deadline = time.monotonic() + patience
    settings = configuration(client_settings(endpoint, credentials, shared_memory=shared_memory))
    while True:
        try:
            raw = zenoh.open(settings)
            break
        except zenoh.ZError as error:
            if credentials is not None:
                _check_handshake(endpoint, credentials)
            if time.monotonic() >= deadline:
                seats = "" if credentials is None else " with seats"
                raise BusError(
                    f"expected a router{seats} at {endpoint}, but none answered in {patience:g} s: "
                    f"start one with `vrg node router`, or name another with --router ({_brief(error)})"
                ) from None
            if stop.wait(0.1):
                raise KeyboardInterrupt from None
    session = Session(raw, lambda: zenoh.open(settings), seats=credentials is not None)
    try:
        yield session
    finally:
        session.close()


def _check_handshake(endpoint: str, credentials: Credentials) -> None:
    """Find out why a router cannot be reached.

    Raises:
        CredentialsError: it is there, but it and this seat do not accept each other.
    """
    from vrg.bus.handshake import refusal  # noqa: PLC0415 - the library of encryption is loaded only in this case

    refused = refusal(endpoint, credentials)
    if refused is not None:
        raise CredentialsError(
            f"the router at {endpoint} and the seat {credentials.common_name} ({credentials.folder}) do not accept "
            f"each other: {refused}"
        )


def _brief(error: OSError | zenoh.ZError) -> str:
    """The text of zenoh's error, without the places in zenoh's own source."""
    return str(error).split(" at ")[0]


class Session:
    """The transport over zenoh: publishes what nodes have put into their mailboxes, and brings to them what arrives.

    Args:
        raw: a session of zenoh's that is connected. connect: opens another one after the link was lost.
        seats: True if every sender must be one that may publish on its key.

    Attributes:
        instance: distinguishes the senders of this process from those of the same names in other processes.
        dropped: the number of events that were lost because `receive` was not called for too long, the oldest first, or
            that came in a flood.
        refused: how many messages came under a wrong key, or from a sender that may not publish there, by key. A
            message that several subscriptions would have been given counts for each.
    """

    def __init__(self, raw: zenoh.Session, connect: Callable[[], zenoh.Session], *, seats: bool = False) -> None:
        self.instance = uuid.uuid4().hex[:8]
        self.dropped = 0
        self.refused: Counter[str] = Counter()
        self._seats = seats
        self._senders: dict[str, str] = {}
        self._queue: deque[tuple[Inlet[Message], Header, Origin]] = deque(maxlen=QUEUE_LIMIT)
        self._newest: dict[tuple[int, str], tuple[Inlet[Message], Header]] = {}
        self._events: list[tuple[Inlet[Message], OnArrival | None]] = []
        self._moving = threading.Lock()
        self._refusing = threading.Lock()
        self._held = False
        self._failed: Exception | None = None
        self._floods: set[str] = set()
        self._meters: dict[Mailbox, FlowMeter] = {}
        self._link = RouterLink(raw, connect, lost=self._hold, back=self._catch_up)

    @property
    def connected(self) -> bool:
        """True if the session is connected to a router now."""
        return self._link.connected

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Subscribe to all topics of a mailbox. `on_arrival` is called on a thread of zenoh's."""
        meter = self._meters[mailbox] = FlowMeter()
        for inlet in mailbox.inlets:
            self._subscribe(inlet, on_arrival, meter)

    def receive(self) -> None:
        """Pass what has arrived to the inlets. Call `mailbox.handover` next.

        Raises:
            BaseException: the link to the router cannot be kept, or an alarm has failed.
        """
        self._link.check()
        if self._failed is not None:
            raise self._failed
        ready: list[tuple[Inlet[Message], Header, Origin]] = []
        held: list[tuple[Inlet[Message], Header, Origin]] = []
        with self._moving:
            while self._queue:
                item = self._queue.popleft()
                (held if self._held and self._may_miss(item[0]) else ready).append(item)
            self._queue.extendleft(reversed(held))
        for inlet, head, origin in ready:
            inlet.offer_header(head, origin)
        for slot in list(self._newest):
            inlet, head = self._newest.pop(slot)
            inlet.offer_header(head)
        if self._seats:
            for mailbox, meter in self._meters.items():
                mailbox.flooded = meter.flooded(time.monotonic())

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Publish messages in the given order."""
        for out in outgoing:
            message = out.message
            sender = self._senders.get(message.sender)
            if sender is None:
                sender = self._senders[message.sender] = f"{message.sender}/{self.instance}"
            payload = encode(message, sender)
            self._link.put(message.key, out.topic.qos, payload, perishable=out.topic.perishable)

    def wait_for_listener(self, key: str, qos: Qos, patience: float) -> bool:
        """Wait until a process subscribes to `key`; return False if none does within `patience` seconds."""
        deadline = time.monotonic() + patience
        while (left := deadline - time.monotonic()) > 0:
            try:
                if self._has_listener(key, qos, left):
                    return True
            except zenoh.ZError:  # the link was lost
                _wait(lambda: self._link.connected, deadline - time.monotonic())
        return False

    def _has_listener(self, key: str, qos: Qos, patience: float) -> bool:
        """True if a process subscribes to `key`, within `patience` seconds and while the link stays the same."""
        raw = self._link.raw
        self._link.prepare(key, qos)
        with raw.declare_publisher(key) as probe:
            # The stub says bool, the library returns a MatchingStatus.
            def matches() -> bool:
                return bool(getattr(probe.matching_status, "matching", False))

            _wait(lambda: matches() or self._link.raw is not raw, patience)
            return matches()

    def declare_alive(self, key: str) -> None:
        """Hold a liveliness token until the session ends."""
        self._link.declare(lambda raw: raw.liveliness().declare_token(key))

    def alive(self, expression: str) -> set[str]:
        """The keys of the liveliness tokens that are held now.

        Raises:
            BusError: the router has not answered, or the link to it is lost: it is not known which nodes are alive.
        """
        found = set()
        try:
            for reply in self._link.raw.liveliness().get(expression, timeout=LIVELINESS_TIMEOUT):
                if reply.ok is None:
                    raise BusError(f"expected the router to tell who is alive within {LIVELINESS_TIMEOUT:g} s")
                found.add(str(reply.ok.key_expr))
        except zenoh.ZError as error:
            raise BusError(f"the link to the router was lost ({_brief(error)})") from None
        if not self._link.connected:
            raise BusError("the link to the router was lost")
        return found

    def watch_raw(
        self,
        expression: str,
        arrived: Callable[[str, bytes], None],
        *,
        history: bool = True,
        only: Collection[str] | None = None,
    ) -> None:
        """Call `arrived(key, payload)` for each message, without decoding it, on a thread of zenoh's.

        Args:
            history: True asks for the last messages on keys of states, too.
            only: the keys that matter; None for all that fit.
        """

        numbers = Numbers()

        def on_sample(sample: zenoh.Sample) -> None:
            key = str(sample.key_expr)
            if only is not None and key not in only:
                return
            payload = sample.payload.to_bytes()
            try:
                news = numbers.is_new(self._admit(key, payload), _origin(sample))
            except MisroutedError:
                return
            except MessageError:
                news = True  # the caller finds out what is wrong with it
            if news or sample.attachment is None:
                arrived(key, payload)

        late = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
        self._link.declare(
            lambda raw: (
                zenoh.ext.declare_advanced_subscriber(raw, expression, on_sample, history=late)
                if history
                else raw.declare_subscriber(expression, on_sample)
            )
        )

    def collect_raw(self, expression: str, limit: int) -> Callable[[], list[tuple[str, bytes]]]:
        """Keep what arrives from now on until it is taken, at most `limit` messages; beyond it the oldest are dropped.

        No Python runs when a message arrives. So who listens to everything never holds up the bus, however busy it is.
        The messages are as they came, also those under a wrong key. What was not yet taken when the link was lost is
        dropped.

        Returns:
            a function that takes the messages: key and payload, in the order of arrival.
        """
        rings: deque[zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]] = deque(maxlen=1)

        def declare(raw: zenoh.Session) -> zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]:
            rings.append(raw.declare_subscriber(expression, zenoh.handlers.RingChannel(limit)))
            return rings[0]

        self._link.declare(declare)

        def take() -> list[tuple[str, bytes]]:
            found: list[tuple[str, bytes]] = []
            for ring in tuple(rings):
                try:
                    while len(found) < limit and (sample := ring.try_recv()) is not None:
                        found.append((str(sample.key_expr), sample.payload.to_bytes()))
                except zenoh.ZError:
                    break  # the link was lost
            return found

        return take

    def close(self) -> None:
        """Undeclare everything and close the connection. Idempotent."""
        self._link.close()

    def _admit(self, key: str, payload: bytes) -> Header:
        """The header of a message that came on a key.

        Raises:
            MisroutedError: it was meant for another key, or its sender may not publish on this one; it is counted.
            MessageError: it is no message.
        """
        try:
            head = header(payload, key)
            if self._seats and not may_publish(head.sender, key):
                raise MisroutedError(key, key, head.sender)
        except MisroutedError as error:
            with self._refusing:  # each subscription has a thread of zenoh's
                counted = key if key in self.refused or len(self.refused) < REFUSED_KEYS else "other keys"
                self.refused[counted] += 1
                first = self.refused[counted] == 1
            if first:
                log.warning("refused a message: %s", error)
            raise
        return head

    def _drop(self, key: str) -> None:
        """Count an event of a flood, and log the first one on its key."""
        self.dropped += 1
        if key not in self._floods and len(self._floods) < REFUSED_KEYS:
            self._floods.add(key)
            log.warning(
                "%s: expected at most %d messages a second: more events are dropped unread", key, MAX_MESSAGE_RATE
            )

    def _subscribe(self, inlet: Inlet[Message], on_arrival: OnArrival | None, meter: FlowMeter) -> None:
        event = inlet.topic.qos is Qos.EVENT
        number, alarms = id(inlet), Numbers()

        def on_sample(sample: zenoh.Sample) -> None:
            key = str(sample.key_expr)
            if not inlet.admits(key):
                return
            # Of what is no event the newest counts, and an emergency stop is always heard.
            if not meter.admits(key, time.monotonic()) and event and inlet.alarm is None:
                self._drop(key)
                return
            try:
                head = self._admit(key, sample.payload.to_bytes())
            except MisroutedError:
                return
            except MessageError as error:
                inlet.refuse(error)
                return
            origin = _origin(sample)
            if inlet.alarm is not None and (alarms.is_new(head, origin) or origin is Origin.LIVE):
                self._sound(inlet, head)
            if event:
                with self._moving:
                    self.dropped += len(self._queue) == QUEUE_LIMIT
                    self._queue.append((inlet, head, origin))
            else:
                self._newest[(number, key)] = (inlet, head)
            if on_arrival is not None:
                on_arrival(inlet)

        if event:
            self._events.append((inlet, on_arrival))
        self._link.declare(subscription(inlet.topic.key, inlet.topic.qos, on_sample))

    def _sound(self, inlet: Inlet[Message], head: Header) -> None:
        """Call an alarm on a thread of zenoh's. What it raises is raised by the next `receive`."""
        try:
            inlet.sound(head)
        except Exception as error:
            self._failed = error
            log.exception("an alarm has failed: %s", head.key)

    @staticmethod
    def _may_miss(inlet: Inlet[Message]) -> bool:
        """True if an inlet waits for what it has missed while the link was lost. An alarm does not."""
        return inlet.topic.qos is Qos.EVENT and inlet.alarm is None and not inlet.topic.perishable

    def _hold(self) -> None:
        """Let events wait, until it is known which of them were missed while the link was lost."""
        self._held = True

    def _catch_up(self, raw: zenoh.Session) -> None:
        """Put the events that were missed before those that have come since, and alarms first of all."""
        inlets = [(inlet, on_arrival) for inlet, on_arrival in self._events if not inlet.topic.perishable]
        for alarms in (True, False):
            asked = [pair for pair in inlets if (pair[0].alarm is not None) is alarms]
            try:
                kept = kept_events(raw, sorted({inlet.topic.key for inlet, _ in asked}), ASKING)
            except zenoh.ZError:
                if self._link.connected:
                    raise  # otherwise events would wait for ever
                return
            missed = [
                (inlet, head, Origin.ASKED)
                for inlet, _ in asked
                for sample in kept[inlet.topic.key]
                if (head := self._header_of(sample)) is not None
            ]
            if not self._link.connected:
                return  # what was missed is asked for again when the link is back
            with self._moving:
                waiting = [*missed, *(self._queue.popleft() for _ in range(len(self._queue)))]
                cut = max(0, len(waiting) - QUEUE_LIMIT)
                self.dropped += cut
                self._queue.extendleft(reversed(waiting[cut:]))
                self._held = alarms
            for inlet, on_arrival in asked:
                if on_arrival is not None:
                    on_arrival(inlet)

    def _header_of(self, sample: zenoh.Sample) -> Header | None:
        """The header of a message that was asked for; None if it is none, or not for its key."""
        try:
            return self._admit(str(sample.key_expr), sample.payload.to_bytes())
        except MessageError:
            return None


def _origin(sample: zenoh.Sample) -> Origin:
    """The origin of a sample that was not asked for."""
    return Origin.LIVE if sample.attachment is None else Origin.REPEATED


def _wait(condition: Callable[[], bool], patience: float) -> bool:
    deadline = time.monotonic() + patience
    pause = threading.Event()
    while not condition():
        if time.monotonic() >= deadline:
            return False
        pause.wait(0.01)
    return True


@contextmanager
def open_router(
    endpoint: str = DEFAULT_ENDPOINT,
    *,
    upstream: str | None = None,
    credentials: Credentials | None = None,
    access: dict[str, Any] | None = None,
) -> Iterator[None]:
    """Serve as the router that every process of a match connects to, until the context ends.

    Args:
        upstream: the endpoint of another router. The two are linked, and linked again whenever the link was lost, so
            that the clients of both hear one another.
        credentials: those of the seat `router`; None lets everybody in.
        access: who may do what, as `vrg.bus.access.rules` makes it; None lets everybody do everything.

    Raises:
        BusError: the endpoint is taken or cannot be listened on.
    """
    check_endpoint(endpoint, credentials)
    with ExitStack() as stack:
        try:
            listeners, open_entrance = [endpoint], None
            if credentials is not None:
                from vrg.bus.entrance import doors, entrance  # noqa: PLC0415 - only routers load asyncio

                listeners = doors()
                open_entrance = stack.enter_context(entrance(endpoint, listeners))
            raw = zenoh.open(configuration(router_settings(listeners, credentials, access, upstream=upstream)))
        except (OSError, zenoh.ZError) as error:
            raise BusError(
                f"cannot serve a router at {endpoint}: is another one running there? "
                f"Choose another endpoint with --router ({_brief(error)})"
            ) from None
        stack.callback(raw.close)
        if open_entrance is not None:
            open_entrance()
        token = raw.liveliness().declare_token(router_alive(os.getpid()))
        yield
        token.undeclare()  # type: ignore[no-untyped-call]
