"""A node's connection to the bus: a client of one router.

Callbacks of zenoh's only put what has arrived aside, as a publication from inside a callback can hang; and they sound
alarms. `vrg.bus.arrivals` has what becomes of it there.
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

from vrg.bus.arrivals import Arrivals, Arrive
from vrg.bus.codec import encode
from vrg.bus.configuration import check_endpoint, client_settings, router_settings
from vrg.bus.mailbox import Mailbox, Numbers, Origin, Outgoing
from vrg.bus.messages import Message
from vrg.bus.router_link import RouterLink, brief, kept_events, subscription
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Qos, Topic, router_alive
from vrg.bus.transport import OnArrival
from vrg.errors import BusError, CredentialsError, MessageError, MisroutedError
from vrg.seats.credentials import Credentials

log = logging.getLogger(__name__)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
ASKING: Final = 1.0
"""The longest real time in s to wait for the events that were missed while the link was lost."""
JOINING: Final = 1.0
"""The real time in s to wait for a router that may not be there."""
LIVELINESS_TIMEOUT: Final = 1.0
"""The longest real time in s to wait for the router's answer to who is alive."""


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
                    f"start one with `vrg node router`, or name another with --router ({brief(error)})"
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
    from vrg.seats.handshake import refusal  # noqa: PLC0415 - the library of encryption is loaded only in this case

    refused = refusal(endpoint, credentials)
    if refused is not None:
        raise CredentialsError(
            f"the router at {endpoint} and the seat {credentials.common_name} ({credentials.folder}) do not accept "
            f"each other: {refused}"
        )


class Session:
    """The transport over zenoh: publishes what nodes have put into their mailboxes, and brings to them what arrives.

    Args:
        raw: a session of zenoh's that is connected. connect: opens another one after the link was lost.
        seats: True if every sender must be one that may publish on its key.

    Attributes:
        instance: distinguishes the senders of this process from those of the same names in other processes.
    """

    def __init__(self, raw: zenoh.Session, connect: Callable[[], zenoh.Session], *, seats: bool = False) -> None:
        self.instance = uuid.uuid4().hex[:8]
        self._arrivals = Arrivals(time.monotonic, seats=seats)
        self._senders: dict[str, str] = {}
        self._link = RouterLink(raw, connect, lost=self._arrivals.hold, back=self._catch_up)

    @property
    def dropped(self) -> int:
        """The number of lost events; see `Arrivals`."""
        return self._arrivals.dropped

    @property
    def refused(self) -> Counter[str]:
        """How many messages were refused, by key; see `Arrivals`."""
        return self._arrivals.refused

    @property
    def connected(self) -> bool:
        """True if the session is connected to a router now."""
        return self._link.connected

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Subscribe to all topics of a mailbox. `on_arrival` is called on a thread of zenoh's."""
        for inlet, arrive in self._arrivals.attach(mailbox, on_arrival):
            self._subscribe(inlet.topic, arrive)

    def receive(self) -> None:
        """Pass what has arrived to the inlets. Call `mailbox.handover` next.

        Raises:
            BaseException: the link to the router cannot be kept, or an alarm has failed.
        """
        self._link.check()
        self._arrivals.receive()

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Publish messages in the given order."""
        for out in outgoing:
            message = out.message
            sender = self._senders.get(message.sender)
            if sender is None:
                sender = self._senders[message.sender] = f"{message.sender}/{self.instance}"
            payload = encode(message, sender)
            topic = out.topic
            self._link.put(message.key, topic.qos, payload, perishable=topic.perishable, urgent=topic.urgent)

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

    def declare_alive(self, key: str | Callable[[str], str]) -> None:
        """Hold a liveliness token until the session ends.

        Args:
            key: the token's, or a function that makes it of the id of zenoh's session, which a new link changes.
        """
        self._link.declare(
            lambda raw: raw.liveliness().declare_token(key if isinstance(key, str) else key(str(raw.info.zid())))
        )

    def put_raw(self, key: str, payload: bytes, attachment: bytes, *, kept: bool = False) -> None:
        """Publish bytes that are no message of the match, as for programs of another kind.

        Args:
            kept: True keeps them for those who subscribe later. They are lost while the link is.
        """
        self._link.put(key, Qos.STATE if kept else Qos.LATEST, payload, attachment=attachment)

    def wanted(self, key: str) -> bool:
        """True if anybody subscribes to a key of bytes that are not kept."""
        return self._link.wanted(key)

    def alive(self, expression: str) -> set[str]:
        """The keys of the liveliness tokens that are held now.

        Raises:
            BusError: the router has not answered, or the link to it is lost: it is not known which nodes are alive.
        """
        found = set()
        try:
            for reply in self._link.raw.liveliness().get(expression, timeout=LIVELINESS_TIMEOUT):
                if reply.ok is None:
                    raise BusError(f"expected the router to say who is alive within {LIVELINESS_TIMEOUT:g} s")
                found.add(str(reply.ok.key_expr))
        except zenoh.ZError as error:
            raise BusError(f"the link to the router was lost ({brief(error)})") from None
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
                news = numbers.is_new(self._arrivals.admit(key, payload), _origin(sample))
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

    def collect_raw(self, expression: str, limit: int, *, own: bool = True) -> "Collected":
        """Keep what arrives from now on until it is taken, at most `limit` messages; beyond it the oldest are dropped.

        No Python runs when a message arrives. So who listens to everything never holds up the bus, however busy it is.
        The messages are as they came, also those under a wrong key. Messages that were not yet taken when the link was
        lost are dropped.

        Args:
            own: False leaves out what this session publishes.
        """
        return Collected(self._link, expression, limit, None if own else zenoh.Locality.REMOTE)

    def close(self) -> None:
        """Undeclare everything and close the connection. Idempotent."""
        self._link.close()

    def _subscribe(self, topic: Topic[Message], arrive: Arrive) -> None:
        def on_sample(sample: zenoh.Sample) -> None:
            arrive(str(sample.key_expr), sample.payload.to_bytes, _origin(sample))

        self._link.declare(subscription(topic.key, topic.qos, on_sample))

    def _catch_up(self, raw: zenoh.Session) -> None:
        """Ask for the events that were missed while the link was lost, for alarms first of all."""
        for alarms in (True, False):
            try:
                kept = kept_events(raw, self._arrivals.missable(alarms=alarms), ASKING)
            except zenoh.ZError:
                if self._link.connected:
                    raise  # otherwise events would wait for ever
                return
            if not self._link.connected:
                return  # what was missed is asked for again when the link is back
            read = {of: [(str(s.key_expr), s.payload.to_bytes()) for s in found] for of, found in kept.items()}
            self._arrivals.catch_up(read, alarms=alarms)


class Collected:
    """What arrives, until it is taken; see `Session.collect_raw`."""

    def __init__(self, link: RouterLink, expression: str, limit: int, origin: zenoh.Locality | None) -> None:
        self._link, self._expression, self._limit, self._origin = link, expression, limit, origin
        self._rings: deque[zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]] = deque(maxlen=1)
        link.declare(self._declare)

    def __call__(self) -> list[tuple[str, bytes]]:
        """Take the messages: key and payload, in the order of arrival."""
        found: list[tuple[str, bytes]] = []
        for ring in tuple(self._rings):
            try:
                while len(found) < self._limit and (sample := ring.try_recv()) is not None:
                    found.append((str(sample.key_expr), sample.payload.to_bytes()))
            except zenoh.ZError:
                break  # the link was lost
        return found

    def close(self) -> None:
        """Keep nothing more. It is called once."""
        self._link.withdraw(self._declare, self._rings)  # which a session that comes up meanwhile fills
        self._rings.clear()

    def _declare(self, raw: zenoh.Session) -> zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]:
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(self._limit)
        self._rings.append(raw.declare_subscriber(self._expression, ring, allowed_origin=self._origin))
        return self._rings[0]


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
def joined(endpoint: str, stop: StopSignal | None = None) -> Iterator["Session"]:
    """Connect to the router at an endpoint, and if there is none yet, run one there until the context ends.

    Raises:
        BusError: there is none, and the endpoint cannot be listened on.
    """
    with ExitStack() as stack:
        try:
            session = stack.enter_context(open_session(endpoint, patience=JOINING, stop=stop))
        except BusError:
            try:
                stack.enter_context(open_router(endpoint))
            except BusError as error:
                raise BusError(
                    f"expected a router at {endpoint}, or an address and a free port of this machine at which one can "
                    f"be opened ({error})"
                ) from None
            session = stack.enter_context(open_session(endpoint, stop=stop))
        yield session


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
                f"Choose another endpoint with --router ({brief(error)})"
            ) from None
        stack.callback(raw.close)
        if open_entrance is not None:
            open_entrance()
        token = raw.liveliness().declare_token(router_alive(os.getpid()))
        yield
        token.undeclare()  # type: ignore[no-untyped-call]
