"""A process' link to the router: a zenoh session that is replaced by a new one whenever the link was lost.

Zenoh itself connects the old session again, under its old id. A router that still waits to send on a link that was cut
closes it for a quarter of the lease, and takes the new connection for one more link of the old session. Keys and
messages go by numbers on a link, and only the client renumbers them, so messages arrive under other keys than they
were published on, or are dropped (zenoh 1.10.2). A new session has a new id, and nothing that is left of the old one
belongs to it. Zenoh still connects the old one for the few milliseconds until it is closed here; nothing is published
on it any more, and receivers compare the key in each message besides.

The price is that zenoh's own memory of what was published is gone, too, so a link keeps the last messages itself and
publishes them again.

Here are also the ways around three other problems of zenoh: a session with callbacks that is not closed hangs the
interpreter at exit, closing inside a direct callback never returns, and advanced subscribers must be undeclared before
the session closes.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Collection
from datetime import timedelta
from typing import Any, Final, Protocol

import zenoh
import zenoh.ext

from vrg.bus.mailbox import is_power_of_ten
from vrg.bus.topics import Qos

log = logging.getLogger(__name__)

EVENTS_KEPT: Final = 64
"""The number of events of each key that are kept for subscribers that missed some while a link was lost."""
RECOVERY_PERIOD: Final = timedelta(seconds=1)
"""The time between two queries for events that were missed."""
REPUBLISHED: Final = b"again"
"""The attachment of an event that is published once more."""
CLOCK_CHECK_PERIOD: Final = 0.5
"""The real time in s between two looks at the clock. Time in which the process was frozen has none of them."""
DOUBTFUL: Final = 5
"""The number of beats before a loss in which events may have been published that did not arrive."""
EVENT_LIFESPAN: Final = 5.0
"""The real time in s after which an event that could not be published is of no use any more."""
RETRY: Final = 0.1
"""The real time in s between two attempts to connect."""

# With a heartbeat, a late subscriber would get all old events as if they were new. Periodic queries go only to
# publishers that it has heard already.
# The stub asks for a number, the library for a timedelta.
_RECOVER_EVENTS = zenoh.ext.RecoveryConfig(periodic_queries=RECOVERY_PERIOD, heartbeat=None)  # type: ignore[arg-type]
_RECOVER_STATE = zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)

Arrived = Callable[[zenoh.Sample], None]
_Publisher = zenoh.Publisher | zenoh.ext.AdvancedPublisher


BORROWED_TRIES = 100
"""How often something is undeclared that another thread is using, every 10 ms."""


def brief(error: OSError | zenoh.ZError) -> str:
    """The text of zenoh's error, without the places in zenoh's own source."""
    return str(error).split(" at ")[0].rstrip()


class Declared(Protocol):
    """Something that was declared on a zenoh session."""

    def undeclare(self) -> object:
        """Undeclare it."""


Recipe = Callable[[zenoh.Session], Declared]
"""A function that declares something on a session."""


class RouterLink:
    """One process' link to the router.

    Args:
        raw: the first session, which is connected. connect: opens another one; it raises ZError if it cannot.
        lost: called when the link is lost, and back: called with the new session when everything is declared on it and
            what was kept is published. Both are called on a thread of the link's.
    """

    def __init__(
        self,
        raw: zenoh.Session,
        connect: Callable[[], zenoh.Session],
        *,
        lost: Callable[[], None],
        back: Callable[[zenoh.Session], None],
    ) -> None:
        self._raw = raw
        self._connect = connect
        self._on_lost, self._on_back = lost, back
        self._recipes: list[Recipe] = []
        self._declared: list[Declared] = []
        self._publishers: dict[str, _Publisher] = {}
        self._matching: dict[str, bool] = {}
        """True for each key to which anybody subscribes."""
        self._kept: dict[str, tuple[Qos, deque[tuple[float, bytes]]]] = {}
        self._beats = deque([time.monotonic()], maxlen=DOUBTFUL)
        self._lock = threading.RLock()
        self._lost, self._closing = threading.Event(), threading.Event()
        self._up = True
        self._watched: zenoh.Session | None = None
        self._failure: BaseException | None = None
        self._watch(raw)
        self._keeper = threading.Thread(target=self._keep, name="link", daemon=True)
        self._keeper.start()

    @property
    def connected(self) -> bool:
        """True if the session is connected to a router now.

        Raises:
            BaseException: as for `check`.
        """
        self.check()
        try:
            return self._up and bool(self._raw.info.routers_zid())
        except zenoh.ZError:
            return False  # the session was just replaced

    @property
    def raw(self) -> zenoh.Session:
        """The newest session. It may be lost at any time."""
        return self._raw

    def check(self) -> None:
        """Make sure that the link is kept.

        Raises:
            BaseException: what has gone wrong in the link's thread.
        """
        if self._failure is not None:
            raise self._failure

    def declare(self, recipe: Recipe) -> None:
        """Declare something now, and on each new session."""
        with self._lock:
            self._recipes.append(recipe)
            if self._up:
                self._declared.append(recipe(self._raw))

    def withdraw(self, recipe: Recipe, declared: Collection[Declared]) -> None:
        """Declare what a recipe makes no more, and undeclare what it has made. Its session may be lost already."""
        with self._lock:
            self._recipes.remove(recipe)
            own = [item for item in self._declared if item in declared]
            self._declared = [item for item in self._declared if item not in own]
        for item in own:
            _undeclare(item)

    def put(
        self,
        key: str,
        qos: Qos,
        payload: bytes,
        *,
        perishable: bool = False,
        urgent: bool = False,
        attachment: bytes | None = None,
    ) -> None:
        """Publish a message.

        While the link is lost, a state waits for the next session, and so does an event, for EVENT_LIFESPAN at most.

        Args:
            perishable: True for an event that counts at once or never. urgent: True for what goes before the rest of
                what only the newest counts of; it must be the same for all messages on a key.
            attachment: of a message of another kind than the match's. It is lost while the link is, and waits for no
                subscriber: one that stands still would hold up the match.
        """
        if qos is Qos.LATEST:
            # It does not wait for a session that is being replaced: the next message makes up for this one.
            publisher = self._publishers.get(key) if self._up else None
            if publisher is not None:
                try:
                    publisher.put(payload, attachment=attachment)
                    return
                except (zenoh.ZError, RuntimeError) as error:  # "already borrowed", by the thread that undeclares it
                    log.debug("the session was replaced meanwhile: %s", error)
            elif not self._up:
                return
        with self._lock:
            if qos is not Qos.LATEST and not perishable and attachment is None:
                kept = self._kept.get(key)
                if kept is None:
                    kept = self._kept[key] = (qos, deque(maxlen=1 if qos is Qos.STATE else EVENTS_KEPT))
                kept[1].append((time.monotonic(), payload))
            if self._up:
                publisher = self._publisher(key, qos, waits=attachment is None, urgent=urgent)
                publisher.put(payload, attachment=attachment)

    def wanted(self, key: str) -> bool:
        """True if anybody subscribes to a key on which only the latest message counts. It costs next to nothing."""
        found = self._matching.get(key)
        return self._watch_matching(key) if found is None else found

    def _watch_matching(self, key: str) -> bool:
        """Keep up with who subscribes to a key, as zenoh finds it out; return whether anybody does."""
        with self._lock:
            matching = self._matching
            if not self._up or key in matching:  # another thread has asked meanwhile
                return matching.get(key, False)

            def changed(status: zenoh.MatchingStatus) -> None:
                matching[key] = status.matching

            try:
                publisher = self._publisher(key, Qos.LATEST)
                if isinstance(publisher, zenoh.ext.AdvancedPublisher):
                    return True  # the library tells nothing of these
                # Otherwise each listener has a thread of its own.
                at_once = zenoh.handlers.Callback(changed, indirect=False)
                self._declared.append(publisher.declare_matching_listener(at_once))
                # The stub says bool, the library returns a MatchingStatus. What the listener has heard is newer.
                return matching.setdefault(key, bool(getattr(publisher.matching_status, "matching", False)))
            except zenoh.ZError as error:
                log.debug("the session was replaced meanwhile: %s", error)
                return False

    def prepare(self, key: str, qos: Qos) -> None:
        """Declare the publisher of a key before its first message."""
        with self._lock:
            if self._up:
                self._publisher(key, qos)

    def close(self) -> None:
        """Undeclare everything and close the connection. Idempotent."""
        self._closing.set()
        self._lost.set()
        with self._lock:
            self._up = False
        if self._keeper is not threading.current_thread():
            self._keeper.join()
        self._shut()

    def _publisher(self, key: str, qos: Qos, *, waits: bool = True, urgent: bool = False) -> _Publisher:
        """The publisher of a key on the session of now; see `_declare_publisher`."""
        with self._lock:
            publisher = self._publishers.get(key)
            if publisher is None:
                publisher = _declare_publisher(self._raw, key, qos, waits=waits, urgent=urgent)
                self._publishers[key] = publisher
            return publisher

    def _watch(self, raw: zenoh.Session) -> None:
        def changed(event: zenoh.TransportEvent) -> None:
            if event.kind == zenoh.SampleKind.DELETE:
                self._lose(raw)

        self._watched = raw
        self._declared.append(raw.info.declare_transport_events_listener(changed))
        if not raw.info.routers_zid():
            self._lose(raw)

    def _lose(self, raw: zenoh.Session) -> None:
        """Publish nothing more on a session whose link was lost, and have it replaced."""
        if raw is self._watched:
            # In this order: a new session that is just being taken up looks at the second after it has set the first.
            self._lost.set()
            self._up = False

    def _keep(self) -> None:
        try:
            while not self._closing.is_set():
                if self._lost.wait(CLOCK_CHECK_PERIOD) and not self._closing.is_set():
                    self._renew(self._beats[0])
                self._beats.append(time.monotonic())
        except BaseException as error:  # a panic of zenoh's is no Exception; the node's own thread raises it
            self._failure = error

    def _renew(self, since: float) -> None:
        """Replace the session.

        Args:
            since: the monotonic time since which events may not have arrived, s.
        """
        log.warning("the link to the router was lost")
        self._watched, self._up = None, False
        self._on_lost()
        self._shut()
        attempts = 0
        while not self._closing.is_set():
            self._lost.clear()
            try:
                self._raw = self._connect()
                with self._lock:
                    self._watch(self._raw)
                    for recipe in self._recipes:
                        self._declared.append(recipe(self._raw))
                    self._publish_kept(since)
                    self._up = True
                    if self._lost.is_set():
                        self._up = False  # it was lost meanwhile
            except zenoh.ZError as error:
                attempts += 1
                if attempts > 1 and is_power_of_ten(attempts):
                    log.warning("no new link to the router after %d attempts: %s", attempts, brief(error))
                self._shut()
                self._closing.wait(RETRY)
                continue
            if not self._closing.is_set():
                log.warning("linked to the router again")
                self._on_back(self._raw)
            return

    def _publish_kept(self, since: float) -> None:
        oldest = max(since, time.monotonic() - EVENT_LIFESPAN)
        for key, (qos, kept) in self._kept.items():
            for at, payload in kept:
                if qos is Qos.STATE:
                    self._publisher(key, qos).put(payload)
                elif at >= oldest:
                    self._publisher(key, qos).put(payload, attachment=REPUBLISHED)

    def _shut(self) -> None:
        """Undeclare everything and close the session."""
        with self._lock:
            items: list[Any] = [*self._declared, *self._publishers.values()]
            self._declared, self._publishers, self._matching = [], {}, {}
        for item in items:
            _undeclare(item)
        if not self._raw.is_closed():
            self._raw.close()  # type: ignore[no-untyped-call]


def _undeclare(item: Declared) -> None:
    """Undeclare something, also where another thread is just using it: the library then refuses with a RuntimeError."""
    for _ in range(BORROWED_TRIES):
        try:
            item.undeclare()
        except zenoh.ZError as error:
            log.debug("undeclare: %s", error)
        except RuntimeError as error:
            log.debug("undeclare: %s", error)
            time.sleep(0.01)
            continue
        return
    log.warning("%s could not be undeclared: another thread uses it", type(item).__name__)


def _declare_publisher(
    raw: zenoh.Session, key: str, qos: Qos, *, waits: bool = True, urgent: bool = False
) -> _Publisher:
    """Declare the publisher of a key. Messages of which only the newest counts have their own queue, behind the rest.

    Args:
        waits: False drops what a subscriber is too slow for, in place of waiting for it. urgent: see `RouterLink.put`.
    """
    if qos is Qos.LATEST:
        priority = zenoh.Priority.DATA if urgent else zenoh.Priority.DATA_LOW
        return raw.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP, priority=priority)
    return zenoh.ext.declare_advanced_publisher(
        raw,
        key,
        congestion_control=zenoh.CongestionControl.BLOCK if waits else zenoh.CongestionControl.DROP,
        cache=zenoh.ext.CacheConfig(max_samples=1 if qos is Qos.STATE else EVENTS_KEPT),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=0.5, sporadic_heartbeat=None),
        publisher_detection=True,
    )


def subscription(expression: str, qos: Qos, arrived: Arrived) -> Recipe:
    """The recipe of a subscriber. `arrived` is called on a thread of zenoh's."""
    if qos is Qos.LATEST:
        return lambda raw: raw.declare_subscriber(expression, arrived)
    late = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
    return lambda raw: zenoh.ext.declare_advanced_subscriber(
        raw,
        expression,
        arrived,
        history=late if qos is Qos.STATE else None,
        recovery=_RECOVER_STATE if qos is Qos.STATE else _RECOVER_EVENTS,
    )


def kept_events(raw: zenoh.Session, expressions: list[str], patience: float) -> dict[str, list[zenoh.Sample]]:
    """Ask all publishers for the events that they keep, by key expression, each in its publisher's order.

    Args:
        patience: the real time in s to wait for an answer.
    """
    found: dict[str, list[zenoh.Sample]] = {expression: [] for expression in expressions}
    answered = []
    for expression, samples in found.items():
        done = threading.Event()
        answered.append(done)

        def take(reply: zenoh.Reply, samples: list[zenoh.Sample] = samples) -> None:
            if reply.ok is not None:
                samples.append(reply.ok)

        raw.get(
            f"{expression}/@adv/**",
            zenoh.handlers.Callback(take, done.set),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            timeout=patience,
        )
    for done in answered:
        done.wait(2.0 * patience)
    return found
