"""A node's connection to the bus: a zenoh client of one router.

This module works around four problems of zenoh that were met in practice: a session that is not closed hangs the
interpreter at exit, closing inside a callback never returns, advanced subscribers must be undeclared before the session
closes, and a publication from inside a callback can hang. So callbacks here only enqueue, and closing happens in one
place.
"""

import json
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import Any, TypeAlias

import zenoh
import zenoh.ext

from vrg.bus.codec import encode
from vrg.bus.configuration import check_endpoint, client_settings, router_settings
from vrg.bus.credentials import Credentials
from vrg.bus.mailbox import QUEUE_LIMIT, Inlet, Mailbox, Outgoing
from vrg.bus.messages import Message
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Qos, router_alive
from vrg.errors import BusError, CredentialsError

log = logging.getLogger(__name__)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
EVENTS_KEPT = 64
"""The number of events that a publisher keeps for subscribers that missed some while the router was away."""

RECOVERY_PERIOD = timedelta(seconds=1)
"""The time between two queries for events that were missed."""

# With a heartbeat, a late subscriber would get all old events as if they were new. Periodic queries go only to
# publishers that it has heard already.
# The stub asks for a number, the library for a timedelta.
_RECOVER_EVENTS = zenoh.ext.RecoveryConfig(periodic_queries=RECOVERY_PERIOD, heartbeat=None)  # type: ignore[arg-type]
_RECOVER_STATE = zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)

_Publisher = zenoh.Publisher | zenoh.ext.AdvancedPublisher
_Ring: TypeAlias = "zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]"
_Subscriber: TypeAlias = "zenoh.Subscriber[None] | zenoh.ext.AdvancedSubscriber[None] | _Ring"


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
    while True:
        try:
            raw = zenoh.open(configuration(client_settings(endpoint, credentials, shared_memory=shared_memory)))
            break
        except zenoh.ZError as error:
            if credentials is not None:
                _check_handshake(endpoint, credentials)
            if time.monotonic() >= deadline:
                seats = "" if credentials is None else " with seats"
                raise BusError(
                    f"expected a router{seats} at {endpoint}, but none answered in {patience:g} s: "
                    f"start one with `vrg router`, or name another with --router ({_brief(error)})"
                ) from None
            if stop.wait(0.1):
                raise KeyboardInterrupt from None
    session = Session(raw)
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


def _brief(error: zenoh.ZError) -> str:
    """The text of zenoh's error, without the places in zenoh's own source."""
    return str(error).split(" at ")[0]


class Session:
    """Publishes what nodes have put into their mailboxes, and brings to the mailboxes what arrives.

    Attributes:
        dropped: the number of events that were lost because `receive` was not called for too long. The oldest are
            dropped first.
    """

    def __init__(self, raw: zenoh.Session) -> None:
        self._raw = raw
        self._publishers: dict[str, _Publisher] = {}
        self._subscribers: list[_Subscriber] = []
        self._tokens: list[zenoh.LivelinessToken] = []
        self.dropped = 0
        self._queue: deque[tuple[Inlet[Message], str, bytes]] = deque(maxlen=QUEUE_LIMIT)
        self._newest: dict[tuple[int, str], tuple[Inlet[Message], bytes]] = {}

    @property
    def connected(self) -> bool:
        """Whether the session is connected to a router now."""
        return bool(self._raw.info.routers_zid())

    def attach(self, mailbox: Mailbox, on_arrival: Callable[[Inlet[Message]], None] | None = None) -> None:
        """Subscribe to all topics of a mailbox. `on_arrival` is called on a thread of zenoh's."""
        for inlet in mailbox.inlets:
            self._subscribe(inlet, on_arrival)

    def receive(self) -> None:
        """Pass what has arrived to the inlets. Call `mailbox.handover` next."""
        while self._queue:
            inlet, key, payload = self._queue.popleft()
            inlet.offer_bytes(key, payload)
        for slot in list(self._newest):
            inlet, payload = self._newest.pop(slot)
            inlet.offer_bytes(slot[1], payload)

    def send(self, outgoing: list[Outgoing]) -> None:
        """Publish messages in the given order."""
        for out in outgoing:
            message = out.message
            publisher = self._publishers.get(message.key)
            if publisher is None:
                publisher = self._publishers[message.key] = self._declare(message.key, out.topic.qos)
            publisher.put(encode(message.body, message.stamp, message.sequence))

    def wait_for_listener(self, key: str, qos: Qos, patience: float) -> bool:
        """Wait until a process subscribes to `key`; return False if none does within `patience` seconds."""
        if key not in self._publishers:
            self._publishers[key] = self._declare(key, qos)
        with self._raw.declare_publisher(key) as probe:
            # The stub says bool, the library returns a MatchingStatus.
            return _wait(lambda: bool(getattr(probe.matching_status, "matching", False)), patience)

    def declare_alive(self, key: str) -> None:
        """Hold a liveliness token until the session ends."""
        self._tokens.append(self._raw.liveliness().declare_token(key))

    def alive(self, expression: str) -> set[str]:
        """The keys of the liveliness tokens that are held now."""
        keys = set()
        for reply in self._raw.liveliness().get(expression, timeout=1.0):
            if reply.ok is not None:
                keys.add(str(reply.ok.key_expr))
        return keys

    def watch_alive(self, expression: str, changed: Callable[[str, bool], None]) -> None:
        """Call `changed(key, alive)` for each token now, and when one comes or goes, on a thread of zenoh's."""

        def on_sample(sample: zenoh.Sample) -> None:
            changed(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._subscribers.append(self._raw.liveliness().declare_subscriber(expression, on_sample, history=True))

    def watch_raw(self, expression: str, arrived: Callable[[str, bytes], None], *, history: bool = True) -> None:
        """Call `arrived(key, payload)` for each message, without decoding it, on a thread of zenoh's.

        Args:
            history: True asks for the last messages on keys of states, too.
        """

        def on_sample(sample: zenoh.Sample) -> None:
            arrived(str(sample.key_expr), sample.payload.to_bytes())

        if not history:
            self._subscribers.append(self._raw.declare_subscriber(expression, on_sample))
            return
        self._subscribers.append(
            zenoh.ext.declare_advanced_subscriber(
                self._raw,
                expression,
                on_sample,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
            )
        )

    def collect_raw(self, expression: str, limit: int) -> Callable[[], list[tuple[str, bytes]]]:
        """Keep what arrives from now on until it is taken, at most `limit` messages; beyond it the oldest are dropped.

        No Python runs when a message arrives. So who listens to everything never holds up the bus, however busy it is.

        Returns:
            a function that takes the messages: key and payload, in the order of arrival.
        """
        subscriber = self._raw.declare_subscriber(expression, zenoh.handlers.RingChannel(limit))
        self._subscribers.append(subscriber)

        def take() -> list[tuple[str, bytes]]:
            found: list[tuple[str, bytes]] = []
            while len(found) < limit and (sample := subscriber.try_recv()) is not None:
                found.append((str(sample.key_expr), sample.payload.to_bytes()))
            return found

        return take

    def close(self) -> None:
        """Undeclare everything and close the connection. Idempotent."""
        for item in [*self._subscribers, *self._publishers.values(), *self._tokens]:
            try:
                item.undeclare()  # type: ignore[no-untyped-call]
            except zenoh.ZError as error:
                log.debug("undeclare: %s", error)
        self._subscribers, self._publishers, self._tokens = [], {}, []
        if not self._raw.is_closed():
            self._raw.close()  # type: ignore[no-untyped-call]

    def _subscribe(self, inlet: Inlet[Message], on_arrival: Callable[[Inlet[Message]], None] | None) -> None:
        qos = inlet.topic.qos
        number = id(inlet)
        only_key = None if "*" in inlet.topic.key else inlet.topic.key

        def on_sample(sample: zenoh.Sample) -> None:
            key, payload = only_key or str(sample.key_expr), sample.payload.to_bytes()
            if qos is Qos.EVENT:
                self.dropped += len(self._queue) == QUEUE_LIMIT
                self._queue.append((inlet, key, payload))
            else:
                self._newest[(number, key)] = (inlet, payload)
            if on_arrival is not None:
                on_arrival(inlet)

        if qos is Qos.LATEST:
            self._subscribers.append(self._raw.declare_subscriber(inlet.topic.key, on_sample))
            return
        late = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
        self._subscribers.append(
            zenoh.ext.declare_advanced_subscriber(
                self._raw,
                inlet.topic.key,
                on_sample,
                history=late if qos is Qos.STATE else None,
                recovery=_RECOVER_STATE if qos is Qos.STATE else _RECOVER_EVENTS,
            )
        )

    def _declare(self, key: str, qos: Qos) -> _Publisher:
        if qos is Qos.LATEST:
            return self._raw.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)
        return zenoh.ext.declare_advanced_publisher(
            self._raw,
            key,
            congestion_control=zenoh.CongestionControl.BLOCK,
            cache=zenoh.ext.CacheConfig(max_samples=1 if qos is Qos.STATE else EVENTS_KEPT),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=0.5, sporadic_heartbeat=None),
            publisher_detection=True,
        )


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
    try:
        raw = zenoh.open(configuration(router_settings(endpoint, credentials, access, upstream=upstream)))
    except zenoh.ZError as error:
        raise BusError(
            f"cannot serve a router at {endpoint}: is another one running there? "
            f"Choose another endpoint with --router ({_brief(error)})"
        ) from None
    try:
        token = raw.liveliness().declare_token(router_alive(os.getpid()))
        yield
        token.undeclare()  # type: ignore[no-untyped-call]
    finally:
        raw.close()  # type: ignore[no-untyped-call]
