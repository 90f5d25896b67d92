"""Messages that have arrived over a bus: refused, sounded as alarms, or kept until their node takes them in.

It knows no bus and no clock: `vrg.bus.session` feeds it from zenoh's threads, simulations of faults in simulated time.
For states and measurements the newest of each key is kept, for events all in their order. A message under a wrong key,
or with seats from a sender that may not publish there, is refused here, before a node receives it.
"""

import logging
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from vrg.bus.access import may_publish
from vrg.bus.codec import Header, header
from vrg.bus.flood import MAX_MESSAGE_RATE, FlowMeter
from vrg.bus.mailbox import QUEUE_LIMIT, Inlet, Mailbox, Numbers, Origin
from vrg.bus.messages import Message
from vrg.bus.topics import Qos
from vrg.bus.transport import OnArrival
from vrg.errors import MessageError, MisroutedError

log = logging.getLogger(__name__)

REFUSED_KEYS: Final = 1000
"""The number of keys for which refused messages are counted one by one."""

Arrive = Callable[[str, Callable[[], bytes], Origin], None]
"""A function that takes in a message: the key that it came on, what reads its bytes, and the way in which it came."""
_Event = tuple[Inlet[Message], Header, Origin]


class Arrivals:
    """The messages that have arrived over a bus. Messages may arrive on any thread, one at a time for each inlet.

    Args:
        now: returns a monotonic time, s.
        seats: True if every sender must be one that may publish on its key.

    Attributes:
        dropped: the number of events that were lost because `receive` was not called for too long, the oldest first, or
            that came in a flood.
        refused: how many messages came under a wrong key, or from a sender that may not publish there, by key. A
            message that several subscriptions would have been given counts for each.
    """

    def __init__(self, now: Callable[[], float], *, seats: bool = False) -> None:
        self.dropped = 0
        self.refused: Counter[str] = Counter()
        self._now, self._seats = now, seats
        self._queue: deque[_Event] = deque(maxlen=QUEUE_LIMIT)
        self._newest: dict[tuple[int, str], tuple[Inlet[Message], Header]] = {}
        self._events: list[tuple[Inlet[Message], OnArrival | None]] = []
        self._moving = threading.Lock()
        self._refusing = threading.Lock()
        self._held = False
        self._failed: Exception | None = None
        self._floods: set[str] = set()
        self._meters: dict[Mailbox, FlowMeter] = {}

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> list[tuple[Inlet[Message], Arrive]]:
        """The inlets of a mailbox, each with what takes in its messages.

        Args:
            on_arrival: called with the inlet when something has arrived for it, on the thread that has brought it.
        """
        meter = self._meters[mailbox] = FlowMeter()
        return [(inlet, self._entry(inlet, on_arrival, meter)) for inlet in mailbox.inlets]

    def receive(self) -> None:
        """Pass what has arrived to the inlets. Call `mailbox.handover` next.

        Raises:
            Exception: an alarm has failed.
        """
        if self._failed is not None:
            raise self._failed
        ready: list[_Event] = []
        if self._queue:
            held: list[_Event] = []
            with self._moving:
                while self._queue:
                    item = self._queue.popleft()
                    (held if self._held and _may_miss(item[0]) else ready).append(item)
                self._queue.extendleft(reversed(held))
        for inlet, head, origin in ready:
            inlet.offer_header(head, origin)
        for slot in list(self._newest):
            inlet, head = self._newest.pop(slot)
            inlet.offer_header(head)
        if self._seats:
            for mailbox, meter in self._meters.items():
                mailbox.flooded = meter.flooded(self._now())

    def admit(self, key: str, payload: bytes) -> Header:
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
            with self._refusing:  # each subscription may have a thread of its own
                counted = key if key in self.refused or len(self.refused) < REFUSED_KEYS else "other keys"
                self.refused[counted] += 1
                first = self.refused[counted] == 1
            if first:
                log.warning("refused a message: %s", error)
            raise
        return head

    def hold(self) -> None:
        """Let events wait, until it is known which of them were missed while the link was lost."""
        self._held = True

    def missable(self, *, alarms: bool) -> list[str]:
        """The key expressions of the events that may have been missed while the link was lost.

        Args:
            alarms: True for the inlets that have an alarm, False for the others.
        """
        return sorted({inlet.topic.key for inlet, _ in self._asked(alarms)})

    def catch_up(self, kept: Mapping[str, Iterable[tuple[str, bytes]]], *, alarms: bool) -> None:
        """Put the events that were missed before those that have come since. Alarms come first of all, then the others.

        Args:
            kept: what publishers keep, key and payload, by key expression, each in its publisher's order.
            alarms: as for `missable`. After False no event is held any more.
        """
        asked = self._asked(alarms)
        missed: list[_Event] = []
        for inlet, _ in asked:
            for key, payload in kept[inlet.topic.key]:
                try:
                    missed.append((inlet, self.admit(key, payload), Origin.ASKED))
                except MessageError:
                    continue
        with self._moving:
            waiting = [*missed, *(self._queue.popleft() for _ in range(len(self._queue)))]
            cut = max(0, len(waiting) - QUEUE_LIMIT)
            self.dropped += cut
            self._queue.extendleft(reversed(waiting[cut:]))
            self._held = alarms
        for inlet, on_arrival in asked:
            if on_arrival is not None:
                on_arrival(inlet)

    def _asked(self, alarms: bool) -> list[tuple[Inlet[Message], OnArrival | None]]:
        return [
            (inlet, on_arrival)
            for inlet, on_arrival in self._events
            if not inlet.topic.perishable and (inlet.alarm is not None) is alarms
        ]

    def _entry(self, inlet: Inlet[Message], on_arrival: OnArrival | None, meter: FlowMeter) -> Arrive:
        event = inlet.topic.qos is Qos.EVENT
        number, alarms = id(inlet), Numbers()

        def arrive(key: str, read: Callable[[], bytes], origin: Origin) -> None:
            if not inlet.admits(key):
                return
            # Only the newest counts of messages that are no events, and an emergency stop is always heard.
            if not meter.admits(key, self._now()) and event and inlet.alarm is None:
                self._drop(key)
                return
            try:
                head = self.admit(key, read())
            except MisroutedError:
                return
            except MessageError as error:
                inlet.refuse(error)
                return
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
        return arrive

    def _drop(self, key: str) -> None:
        """Count an event of a flood, and log the first one on its key."""
        self.dropped += 1
        if key not in self._floods and len(self._floods) < REFUSED_KEYS:
            self._floods.add(key)
            log.warning(
                "%s: expected at most %d messages a second: more events are dropped unread", key, MAX_MESSAGE_RATE
            )

    def _sound(self, inlet: Inlet[Message], head: Header) -> None:
        """Call an alarm on the thread of the arrival. The next `receive` raises its exceptions."""
        try:
            inlet.sound(head)
        except Exception as error:
            self._failed = error
            log.exception("an alarm has failed: %s", head.key)


def _may_miss(inlet: Inlet[Message]) -> bool:
    """True if an inlet waits for what it has missed while the link was lost. An alarm does not."""
    return inlet.topic.qos is Qos.EVENT and inlet.alarm is None and not inlet.topic.perishable
