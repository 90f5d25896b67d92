"""The part of a process in the graph of ROS 2: what it publishes, as tokens and messages on a session of the bus."""

import itertools
import logging
import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, Final

from vrg.bus.mailbox import is_power_of_ten
from vrg.bus.session import Session
from vrg.errors import MessageError
from vrg_ros.cdr import Message, decode, encode
from vrg_ros.wire import Identity, Kind, Qos, any_type_key, attachment, data_key, gid_of

log = logging.getLogger(__name__)

QUEUE_LENGTH: Final = 4
"""The messages of a topic that are kept until they are taken. The newest counts; others may be of another type."""
FLOODED: Final = 30
"""The calls at which QUEUE_LENGTH messages wait, beyond those at which fewer do, from which on it is logged that they
come too fast; that is over when as many are made up for."""
MAX_MESSAGE_SIZE: Final = 4096
"""The bytes of the longest message that is decoded, of most types."""
SHOWN: Final = 300
"""The characters of a problem that are logged."""


class Publisher:
    """One topic that is published: its key, its number in the graph, and how many messages there have been."""

    def __init__(self, number: int, topic: str, of: str, qos: Qos, domain: int) -> None:
        self.number, self.of, self.qos = number, of, qos
        self.key = data_key(domain, topic, of)
        self.sequence = 0
        self.message: Message | None = None
        """The newest message, which may be sent again, and its bytes."""
        self.payload = b""
        self.gid = b""
        """The id of the endpoint; it is another one on a new session."""


class RosNode:
    """A node of the graph.

    Args:
        session: with the router. domain: ROS_DOMAIN_ID. name: of the node. namespace: such as `/courtyard`.
        wall: the time of day in ns since 1970, for the attachments of messages.
    """

    def __init__(
        self, session: Session, domain: int, name: str, namespace: str = "", wall: Callable[[], int] = time.time_ns
    ) -> None:
        self._session, self._domain, self._name, self._namespace, self._wall = session, domain, name, namespace, wall
        self._numbers = itertools.count(1)
        self._publishers: dict[str, Publisher] = {}
        self._left_out: Counter[str] = Counter()
        self.problems: dict[str, str] = {}
        """The problem of the last message of a topic that was left out."""
        session.declare_alive(lambda zid: self._identity(zid).token)

    def advertise(self, topic: str, of: str, lasting: bool = False) -> Publisher:
        """Show in the graph that a topic is published, and find out who subscribes to it. Idempotent; see `publish`."""
        publisher = self._publishers.get(topic)
        if publisher is not None:
            return publisher
        qos = Qos(transient=True, depth=1) if lasting else Qos()
        publisher = self._publishers[topic] = Publisher(next(self._numbers), topic, of, qos, self._domain)

        def token(zid: str) -> str:
            found = self._identity(zid).endpoint(Kind.PUBLISHER, publisher.number, topic, of, qos)
            publisher.gid = gid_of(found)
            return found

        self._session.declare_alive(token)
        if not lasting:
            self._session.wanted(publisher.key)  # so those who wait for the first message are known by then
        return publisher

    def publish(self, topic: str, of: str, message: Message, lasting: bool = False) -> None:
        """Publish a message.

        Args:
            topic: with its leading slash. of: the type, such as `nav_msgs/Odometry`.
            lasting: it is kept for those who come later (transient local).

        Raises:
            ValueError: the message is not of that type.
        """
        self._send(self.advertise(topic, of, lasting), message)

    def wanted(self, topic: str, of: str) -> bool:
        """True if anybody subscribes to a topic, which does not last; it is advertised then."""
        return self._session.wanted(self.advertise(topic, of).key)

    def offer(self, topic: str, of: str, make: Callable[[], Sequence[Message]]) -> None:
        """Publish the messages that `make` returns, if anybody subscribes to the topic.

        Args, Raises: see `publish`.
        """
        if self.wanted(topic, of):
            for message in make():
                self._send(self._publishers[topic], message)

    def subscribe(
        self, topic: str, of: str, longest: int = MAX_MESSAGE_SIZE, *, floods: bool = False
    ) -> Callable[[], dict[str, Any] | None]:
        """Hear a topic.

        Args:
            topic: with its leading slash. of: the type, such as `geometry_msgs/Twist`.
            longest: the bytes of the longest message that is decoded.
            floods: True logs that messages come much faster than they are taken.

        Returns:
            a function that returns the newest message that has arrived since the last call; None if none has. What
            cannot be decoded is left out, and logged.
        """
        number = next(self._numbers)
        self._session.declare_alive(
            lambda zid: self._identity(zid).endpoint(Kind.SUBSCRIBER, number, topic, of, Qos(depth=1))
        )
        own = data_key(self._domain, topic, of)
        # Those of a distribution without hashes, or with another definition, have another last chunk.
        take = self._session.collect_raw(f"{own.rpartition('/')[0]}/*", QUEUE_LENGTH)

        full, flooded = 0, False

        def newest() -> dict[str, Any] | None:
            nonlocal full, flooded
            found = take()
            full = min(full + 1, FLOODED) if len(found) == QUEUE_LENGTH else max(full - 1, 0)
            before, flooded = flooded, full == FLOODED or (flooded and full > 0)
            if floods and flooded and not before:
                log.warning("%s: %s comes much faster than it can count: only the newest of a tick does", topic, of)
            for key, data in reversed(found):
                try:
                    if key != own:
                        raise MessageError(f"expected the definition of Jazzy and later, got {key.rpartition('/')[2]}")
                    if len(data) > longest:
                        raise MessageError(f"expected {longest} bytes at most, got {len(data)}")
                    return decode(of, data)
                except MessageError as error:
                    self.complain(topic, error)
            return None

        return newest

    def commands(self, topic: str) -> Callable[[], dict[str, Any] | None]:
        """Hear commands to a robot, of type geometry_msgs/Twist or TwistStamped.

        Returns:
            a function that returns the newest twist that has arrived since the last call; None if none has.
        """
        plain = self.subscribe(topic, "geometry_msgs/Twist", floods=True)
        stamped = self.subscribe(topic, "geometry_msgs/TwistStamped", floods=True)

        def newest() -> dict[str, Any] | None:
            found, other = plain(), stamped()
            return found if other is None else other["twist"]

        return newest

    def overheard(self, topic: str) -> Callable[[], bool]:
        """Listen for what others publish on a topic that this node publishes, too.

        Returns:
            a function that returns True if any has published a message of any type since the last call.
        """
        take = self._session.collect_raw(any_type_key(self._domain, topic), 1, own=False)
        return lambda: bool(take())

    def complain(self, topic: str, problem: object) -> None:
        """Log a message of a topic that is left out: the 1st, the 10th, the 100th and so on."""
        self._left_out[topic] += 1
        self.problems[topic] = str(problem)[:SHOWN]
        if is_power_of_ten(count := self._left_out[topic]):
            log.warning("%s: a message is dropped (number %d): %s", topic, count, self.problems[topic])

    def _send(self, publisher: Publisher, message: Message) -> None:
        publisher.sequence += 1
        if publisher.message is not message:
            publisher.message, publisher.payload = message, encode(publisher.of, message)
        attached = attachment(publisher.sequence, self._wall(), publisher.gid)
        self._session.put_raw(publisher.key, publisher.payload, attached, kept=publisher.qos.transient)

    def _identity(self, zid: str) -> Identity:
        return Identity(self._domain, zid, 0, self._namespace, self._name)
