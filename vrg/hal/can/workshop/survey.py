"""Lists the nodes on a bus: every protocol listens, and the one that is surest of a frame takes it."""

import logging
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from vrg.errors import ConfigError, RobotError
from vrg.hal.can.axis import AxisReport, Send
from vrg.hal.can.frame import Frame
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.troubles import NoFdError
from vrg.hal.can.workshop.listener import REPEATS, Claim, Listener
from vrg.hal.clock import MonotonicClock
from vrg.registry import offered

log = logging.getLogger(__name__)


class _Considerate:
    """Sends the frames of one protocol, but for those that belong to nodes of another one."""

    def __init__(self, send: Send, listeners: Sequence[Listener[Any]]) -> None:
        self._send, self._listeners = send, listeners
        self.owner: Listener[Any] | None = None

    def __call__(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send it, or leave it."""
        if not any(other.owns(frame) for other in self._listeners if other is not self.owner):
            self._send(frame, urgent=urgent)


def all_listeners(send: Send, clock: MonotonicClock) -> list[Listener[Any]]:
    """A listener of each protocol; one that cannot be imported is left out, with the reason in the log."""
    found: list[Listener[Any]] = []
    for name in PROTOCOLS.names():
        try:
            protocol = PROTOCOLS.get(name)
            if protocol.listener is not None:
                considerate = _Considerate(send, found)
                considerate.owner = protocol.listener_type(considerate, clock)
                found.append(considerate.owner)
        except ConfigError as error:
            log.warning("%s", error)
    return found


def unheard() -> dict[str, str]:
    """The protocols whose drives cannot be found, or stopped, on a bus, by name; and why, in words."""
    found = {}
    for name in sorted({*PROTOCOLS.names(), *offered(PROTOCOLS.group)}):
        try:
            protocol = PROTOCOLS.get(name)
            if protocol.listener is None:
                found[name] = "it has no listener"
            else:
                _ = protocol.listener_type
        except ConfigError as error:
            found[name] = str(error)
    return found


def who_speaks(frames: Iterable[Frame], clock: MonotonicClock) -> str:
    """Describe the senders of these frames, in one line, without asking any of them."""
    survey = Survey(all_listeners(_be_silent, clock))
    for frame in frames:
        survey.hear(frame)
    return str(survey)


def _be_silent(frame: Frame, *, urgent: bool = False) -> None:
    """Send nothing."""


class Survey:
    """Listens to a bus.

    Args:
        listeners: one for each protocol. If several are equally sure of a frame, the first gets it.
    """

    def __init__(self, listeners: Sequence[Listener[Any]]) -> None:
        self._listeners = listeners
        self._alike: dict[tuple[int, bool], int] = {}

    @property
    def nodes(self) -> list[AxisReport]:
        """Everybody heard so far, by protocol and id."""
        found = [node for listener in self._listeners for node in listener.found.values()]
        return sorted(found, key=lambda node: (node.protocol, node.node))

    def hear(self, frame: Frame) -> None:
        """Take in one frame."""
        listener, claim = self._owner(frame)
        key = frame.id, frame.extended
        if listener is None:
            self._alike.pop(key, None)
            return
        if claim is Claim.LIKELY:
            self._alike[key] = self._alike.get(key, 0) + 1
            if self._alike[key] < REPEATS:
                return
        before = len(listener.found)
        listener.hear(frame)
        if len(listener.found) > before:
            self._judge_anew()

    def greet(self) -> None:
        """Ask everybody on the bus who they are.

        Raises:
            RobotError: a question could not be sent; the other protocols have asked theirs.
        """
        _each(listener.greet for listener in self._listeners)

    def ask(self, node: AxisReport) -> None:
        """Ask a node for all its values; see `Listener.ask`.

        Raises:
            RobotError: a question could not be sent.
        """
        for listener in self._listeners:
            if listener.found.get(node.node) is node:  # it may have turned out to be none
                listener.ask(node)

    def stop(self) -> None:
        """Switch every motor on the bus off, whatever its protocol.

        Raises:
            RobotError: it could not be sent; the other protocols have sent theirs.
        """
        _each(listener.stop for listener in self._listeners)

    def listener_of(self, node: AxisReport) -> Listener[Any]:
        """The protocol that a node speaks."""
        return next(listener for listener in self._listeners if listener.found.get(node.node) is node)

    def __str__(self) -> str:
        """The nodes, in one line."""
        words = []
        for listener in self._listeners:
            nodes = [str(node) for node in sorted(listener.found)]
            if nodes:
                words.append(f"{listener.title} node{'s' if len(nodes) > 1 else ''} {', '.join(nodes)}")
        return " and ".join(words) or "none"

    def _owner(self, frame: Frame) -> tuple[Listener[Any] | None, Claim]:
        """The listener that takes this frame, or None if none does, and how certain it is."""
        surest, claim = None, Claim.NONE
        for listener in self._listeners:
            mine = listener.claim(frame)
            if mine > claim:
                surest, claim = listener, mine
        return surest, claim

    def _judge_anew(self) -> None:
        """Drop nodes that were recognised by a frame which, as is known by now, is another protocol's.

        The telegram of a CANopen node that has not sent a heartbeat yet may look like an ODrive's heartbeat.
        """
        for listener in self._listeners:
            for number, frame in list(listener.known_by.items()):
                owner, _ = self._owner(frame)
                if owner is not None and owner is not listener:
                    listener.forget(number)


def _each(actions: Iterable[Callable[[], None]]) -> None:
    """Do everything, also after one of the actions has failed.

    Raises:
        RobotError: the first that went wrong. A bus without CAN FD has no drives that need it, so that is none.
    """
    wrong: list[RobotError] = []
    for act in actions:
        try:
            act()
        except NoFdError:
            continue
        except RobotError as error:
            wrong.append(error)
    if wrong:
        raise wrong[0]
