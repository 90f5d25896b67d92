"""Messages whose bodies are made when somebody reads one of them.

Where all nodes share a process, most messages of the world are never read: a node is given the newest reading of a
sensor, and few strategies look at each. A sender defers such messages (`vrg.bus.mailbox.Mailbox.defer`). A transport
that can do so lets those who only ask for the newest message find it there; where somebody takes each message, and over
processes, it is published like every other.
"""

from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from vrg.blame import DeferredError
from vrg.bus.codec import Received
from vrg.bus.messages import Message
from vrg.bus.topics import Topic

T = TypeVar("T", bound=Message)


class Deferred(Generic[T]):
    """Messages of one sender and one instant on some topics, of which all are made as soon as one is read.

    Args:
        topics: one for each message. stamp: the match time of the measurement, s. sender: as in `Received`.
        make: returns the bodies, in the order of the topics. What it returns must not depend on when it is called.
    """

    __slots__ = ("_made", "make", "sender", "stamp", "topics")

    def __init__(self, topics: Sequence[Topic[T]], stamp: float, make: Callable[[], Sequence[T]], sender: str) -> None:
        self.topics, self.stamp, self.make, self.sender = topics, stamp, make, sender
        self._made: dict[str, Received[T]] | None = None

    def of(self, key: str) -> Received[T]:
        """The message on a key. Its number tells nothing: it was not counted.

        Raises:
            KeyError: there is none on this key.
            DeferredError: it cannot be made.
        """
        if self._made is None:
            try:
                bodies = zip(self.topics, self.make(), strict=True)
                made = {topic.key: Received(topic.key, self.stamp, 0, body, self.sender) for topic, body in bodies}
            except Exception as error:
                raise DeferredError(self.sender, error) from error
            self._made = made
        return self._made[key]
