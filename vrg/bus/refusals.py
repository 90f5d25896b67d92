"""The router's refusals in words: the seat, and what it tried.

Zenoh has no other way to tell it than its own log, which names each decision of the access control at the level
`trace`, whether it allows or refuses. So the router's process reads that log through a pipe, keeps the refusals, and
writes them to its own log, as many as cannot fill a disk.
"""

import logging
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

from vrg.bus.mailbox import is_power_of_ten

log = logging.getLogger(__name__)

FILTER = "warn,zenoh::net::routing::interceptor=trace,zenoh::net::routing::hat=off"
"""The filter of zenoh's log. Below `hat` it complains about the end of subscriptions that were refused before."""
REFUSAL_WINDOW = 10.0
"""The real time in s for which the following numbers hold."""
MAX_LINES = 50
"""The number of lines that are written about one seat; what comes beyond it is only counted."""
LONGEST_KEY = 200
"""The number of characters of a key that are written."""
MAX_REMEMBERED = 2000
"""The number of sessions, and of different refusals, that are remembered."""

_DECISION = re.compile(
    rb"(?P<thread>ThreadId\(\d+\)) \S+::access_control: (?:Using cached result: )?(?P<session>[0-9a-f]+)"
    rb"(?: on \S+)? is unauthorized to (?P<action>.+?) \((?P<flow>\w+)\) on (?P<key>\S+)"
)
_INTERCEPTED = re.compile(rb"(?P<thread>ThreadId\(\d+\)) \S+::interceptor: Msg intercepted!")
_NAME = re.compile(rb"([0-9a-f]+) on \S*?CertCommonName\(([^)]*)\)")
_OTHER = re.compile(r"(?:WARN|ERROR|INFO)\s+(?:\S+ )?ThreadId\(\d+\) (?P<place>[\w:]+): (?P<text>.*)")
_ACTIONS = {
    ("Put", "ingress"): "may not publish on {key}: dropped",
    ("Delete", "ingress"): "may not publish on {key}: dropped",
    ("Declare Subscriber", "ingress"): "may not listen to {key}: refused",
    ("Query", "ingress"): "may not ask for {key}: refused",
    ("Reply", "ingress"): "may not answer for {key}: dropped",
    ("Declare Queryable", "ingress"): "may not answer for {key}: refused",
    ("Liveliness Token", "ingress"): "may not be present as {key}: refused",
    ("Liveliness Query", "ingress"): "may not look who is present as {key}: refused",
    ("Declare Liveliness Subscriber", "ingress"): "may not look who is present as {key}: refused",
    ("Put", "egress"): "may not hear {key}: withheld",
    ("Reply", "egress"): "may not hear {key}: withheld",
}
"""The refused actions, in words. Others are part of the ordinary routing, and no act of a seat."""


class Refusals:
    """Makes lines for people out of zenoh's log.

    Args:
        now: the real time of some clock, s.
    """

    def __init__(self, now: float) -> None:
        self._names: dict[str, str] = {}
        self._pending: dict[bytes, tuple[bytes, ...]] = {}
        self._counts: dict[tuple[str, str], int] = {}
        self._rest = b""
        self._since = now
        self._written: dict[str, int] = {}
        self._unlisted: dict[str, int] = {}

    def read(self, data: bytes, now: float) -> list[str]:
        """Take in the next bytes of zenoh's log, and return the lines to write. The bytes may end within a line."""
        texts = self._turn(now)
        *whole, self._rest = (self._rest + data).split(b"\n")
        for line in whole:
            if b" is authorized to " in line:
                continue
            entry = self._line(line)
            if entry is None:
                continue
            who, words = entry
            if self._written.get(who, 0) >= MAX_LINES:
                self._unlisted[who] = self._unlisted.get(who, 0) + 1
                continue
            self._written[who] = self._written.get(who, 0) + 1
            texts.append(f"{who} {words}")
        return texts

    def end(self) -> list[str]:
        """Return the lines to write at the end of zenoh's log: what was not listed in the last window."""
        unlisted, self._written, self._unlisted = self._unlisted, {}, {}
        return [
            f"{who}: {n} further refusals within {REFUSAL_WINDOW:g} s were not listed" for who, n in unlisted.items()
        ]

    def _turn(self, now: float) -> list[str]:
        """Begin a new window where the old one is over, and tell what was not listed in the old one."""
        if now - self._since < REFUSAL_WINDOW:
            return []
        self._since = now
        return self.end()

    def _learn(self, line: bytes) -> None:
        """Remember whose session it is."""
        named = _NAME.search(line)
        if named is not None:
            if len(self._names) >= MAX_REMEMBERED:
                self._names.clear()
            self._names[named[1].decode()] = named[2].decode(errors="replace")

    def _line(self, line: bytes) -> tuple[str, str] | None:
        """The seat that is refused, and what is refused, if a line reports it."""
        # To look for a few bytes is much quicker than to try an expression, and a flood must not slow the router down.
        if b"CertCommonName(" in line:
            self._learn(line)
        if b" is unauthorized to " in line and (decision := _DECISION.search(line)) is not None:
            if len(self._pending) >= MAX_REMEMBERED:
                self._pending.clear()
            self._pending[decision["thread"]] = decision.group("session", "action", "flow", "key")
            return None
        if b"Msg intercepted!" in line and (intercepted := _INTERCEPTED.search(line)) is not None:
            return self._refused(intercepted["thread"])
        other = _OTHER.search(line.decode(errors="replace"))
        return None if other is None else _other_words(other["place"], other["text"])

    def _refused(self, thread: bytes) -> tuple[str, str] | None:
        # Zenoh names what it has refused in the line before this one, on the same thread.
        pending = self._pending.pop(thread, None)
        if pending is None:
            return None
        session, action, flow, key = (part.decode(errors="replace") for part in pending)
        words = _ACTIONS.get((action, flow))
        if words is None:
            return None
        who, what = self._names.get(session, f"session {session}"), words.format(key=key[:LONGEST_KEY])
        if len(self._counts) >= MAX_REMEMBERED:
            self._counts.clear()
        count = self._counts[(session, what)] = self._counts.get((session, what), 0) + 1
        if not is_power_of_ten(count):
            return None
        return who, what if count == 1 else f"{what} ({count} times by now)"


def _other_words(place: str, text: str) -> tuple[str, str]:
    text = text.split(" Hint: ", maxsplit=1)[0].rstrip(". ")
    if "did not match any configured ACL subject" in text:
        return "a process", "has connected whose certificate is of no seat of this match: it may do nothing"
    if place.startswith("zenoh_link_tls"):
        return "a process", f"was not let in: {text}"
    return "zenoh:", text


@contextmanager
def refusals_logged() -> Iterator[None]:
    """Log what a router in this process refuses, until the context ends. It must begin before the router does.

    Zenoh writes its log to the standard output, so in this context nothing else can.
    """
    # Zenoh's lines would otherwise have colours.
    os.environ["NO_COLOR"] = "1"
    kept = os.dup(1)
    incoming, outgoing = os.pipe()
    os.dup2(outgoing, 1)
    os.close(outgoing)
    reader = threading.Thread(target=_pump, args=(incoming, log.warning), daemon=True)
    reader.start()
    try:
        # Zenoh takes the variable of the environment of this process, which may switch off what is read here.
        os.environ["RUST_LOG"] = FILTER
        zenoh.init_log_from_env_or(FILTER)
        yield
    finally:
        # The pipe ends as soon as its last writer is gone.
        os.dup2(kept, 1)
        os.close(kept)
        reader.join(1.0)


def _pump(incoming: int, write: Callable[[str, str], None]) -> None:
    refusals = Refusals(time.monotonic())
    while data := os.read(incoming, 1 << 16):
        for line in refusals.read(data, time.monotonic()):
            write("%s", line)
    for line in refusals.end():
        write("%s", line)
    os.close(incoming)
