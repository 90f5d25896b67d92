"""A bus that a command listens to."""

import threading
from dataclasses import dataclass

from vrg.bus.stopping import StopSignal
from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.frame import Frame
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT
from vrg.hal.can.link import Link, Medium
from vrg.hal.can.workshop.survey import Survey, all_listeners

ASK_PERIOD = 0.25
"""s between questions to the drives. Some speak only when they are asked, and are silent after HEARTBEAT_TIMEOUT."""


@dataclass(frozen=True)
class BusState:
    """The nodes of a bus, the troubles of the bus itself, in words, and the time of the look, in monotonic s."""

    nodes: list[AxisReport]
    troubles: list[str]
    at: float


class ListenedBus:
    """A bus that is listened to.

    Args:
        link: the bus. medium: what it belongs to. stop: ends each wait.

    Attributes:
        survey: who speaks there. clock: the time of the bus. stop: as given.
    """

    def __init__(self, link: Link, medium: Medium, stop: StopSignal) -> None:
        self.stop = stop
        self.clock = medium.clock
        self._lock = threading.Lock()
        self._troubles: dict[str, None] = {}
        self._bus = medium.bus(link, self._hear, self._complain)
        self.survey = Survey(all_listeners(self._bus.send, self.clock))

    def start(self) -> None:
        """Begin to listen.

        Raises:
            RobotError: the bus cannot be opened.
        """
        self._bus.start()

    def close(self) -> None:
        """Let go of the bus."""
        self._bus.stop()

    def wait(self, seconds: float) -> None:
        """Wait for some time, or until it is time to stop."""
        self.clock.wait(self.stop.is_set, seconds)

    def look(self, *, ask: bool) -> BusState:
        """Return the present state of the bus.

        Args:
            ask: ask everybody for what they do not say by themselves.
        """
        with self._lock:
            nodes = self.survey.nodes
        if ask:
            try:
                self.survey.greet()
                for found in nodes:
                    # An answer may have to be waited for: a node that has fallen silent is not asked.
                    if not self.stop.is_set() and self.clock.now() - found.heard < HEARTBEAT_TIMEOUT:
                        self.survey.ask(found)
            except RobotError as error:
                self._complain(str(error))
        return BusState(nodes, list(self._troubles), self.clock.now())

    def look_for(self, seconds: float, *, ask: bool = True) -> BusState:
        """Look again and again for a while; what has been heard at last."""
        end = self.clock.now() + seconds
        while (left := end - self.clock.now()) > 0 and not self.stop.is_set():
            self.look(ask=ask)
            self.wait(min(ASK_PERIOD, left))
        return self.look(ask=ask)

    def _hear(self, frame: Frame) -> None:
        with self._lock:
            self.survey.hear(frame)

    def _complain(self, words: str) -> None:
        self._troubles.setdefault(words)
