"""The part of a process in the graph of ROS 2: what it publishes, as tokens and messages on a session of the bus."""

import itertools
import logging
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from vrg.bus.session import Session
from vrg.errors import MessageError
from vrg.ros.cdr import Message, decode, encode
from vrg.ros.wire import Identity, Kind, Qos, attachment, data_key, gid_of

log = logging.getLogger(__name__)

KEPT: Final = 16
"""The messages of a topic that are kept until they are taken."""


class Publisher:
    """One topic that is published: its key, its number in the graph, and how many messages there have been."""

    def __init__(self, number: int, topic: str, of: str, qos: Qos, domain: int) -> None:
        self.number, self.topic, self.of, self.qos = number, topic, of, qos
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
        self._warned: set[tuple[str, str]] = set()
        session.declare_alive(lambda zid: self._identity(zid).token)

    def publish(self, topic: str, of: str, message: Message, lasting: bool = False) -> None:
        """Publish a message.

        Args:
            topic: with its leading slash. of: the type, such as `nav_msgs/Odometry`.
            lasting: it is kept for those who come later (transient local).

        Raises:
            ValueError: the message is not of that type.
        """
        self._send(self._publisher(topic, of, lasting), message)

    def offer(self, topic: str, of: str, make: Callable[[], Sequence[Message]], lasting: bool = False) -> None:
        """Publish the messages that `make` returns, if anybody subscribes to the topic, or they are lasting.

        Args, Raises: see `publish`.
        """
        publisher = self._publisher(topic, of, lasting)
        if lasting or self._session.wanted(publisher.key):
            for message in make():
                self._send(publisher, message)

    def subscribe(self, topic: str, of: str) -> Callable[[], list[dict[str, Any]]]:
        """Hear a topic.

        Args:
            topic: with its leading slash. of: the type, such as `geometry_msgs/Twist`.

        Returns:
            a function that takes the messages that have come since the last call, at most KEPT.
        """
        number = next(self._numbers)
        self._session.declare_alive(
            lambda zid: self._identity(zid).endpoint(Kind.SUBSCRIBER, number, topic, of, Qos(depth=1))
        )
        own = data_key(self._domain, topic, of)
        # Those of a distribution without hashes, or with another definition, have another last chunk.
        take = self._session.collect_raw(f"{own.rpartition('/')[0]}/*", KEPT)

        def messages() -> list[dict[str, Any]]:
            found = []
            for key, data in take():
                try:
                    if key != own:
                        raise MessageError(f"expected the definition of Jazzy and later, got {key.rpartition('/')[2]}")
                    found.append(decode(of, data))
                except MessageError as error:
                    if (topic, str(error)) not in self._warned:
                        self._warned.add((topic, str(error)))
                        log.warning("%s: a message is ignored: %s", topic, error)
            return found

        return messages

    def commands(self, topic: str) -> Callable[[], list[dict[str, Any]]]:
        """Hear commands to a robot, of type geometry_msgs/Twist or TwistStamped.

        Returns:
            a function that takes the twists that have come since the last call.
        """
        plain = self.subscribe(topic, "geometry_msgs/Twist")
        stamped = self.subscribe(topic, "geometry_msgs/TwistStamped")
        return lambda: [*plain(), *(message["twist"] for message in stamped())]

    def _send(self, publisher: Publisher, message: Message) -> None:
        publisher.sequence += 1
        if publisher.message is not message:
            publisher.message, publisher.payload = message, encode(publisher.of, message)
        told = attachment(publisher.sequence, self._wall(), publisher.gid)
        self._session.put_raw(publisher.key, publisher.payload, told, kept=publisher.qos.transient)

    def _publisher(self, topic: str, of: str, lasting: bool) -> Publisher:
        found = self._publishers.get(topic)
        if found is None:
            found = self._publishers[topic] = self._advertise(topic, of, lasting)
        return found

    def _advertise(self, topic: str, of: str, lasting: bool) -> Publisher:
        qos = Qos(transient=True, depth=1) if lasting else Qos()
        publisher = Publisher(next(self._numbers), topic, of, qos, self._domain)

        def token(zid: str) -> str:
            found = self._identity(zid).endpoint(Kind.PUBLISHER, publisher.number, topic, of, qos)
            publisher.gid = gid_of(found)
            return found

        self._session.declare_alive(token)
        return publisher

    def _identity(self, zid: str) -> Identity:
        return Identity(self._domain, zid, 0, self._namespace, self._name)
