"""The commands `vrg topic list`, `echo` and `hz`, which show what goes over the bus of a running match."""

import json
import math
import queue
import sys
import time
from collections import Counter, defaultdict, deque
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer

from vrg.bus.codec import decode
from vrg.bus.session import Session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys, key_matches
from vrg.commands.groups import CommandGroup, MatchOptions
from vrg.commands.matches import connected, which_match
from vrg.commands.options import JsonOption, lasting
from vrg.errors import MessageError
from vrg.hal.sensors import message_class
from vrg.names import name_of
from vrg.seats.seat import Seat, SeatKind

QUEUE_LENGTH = 1000
"""The number of messages that wait to be taken."""
QUIET = 3.0
"""The real time in s without a message after which `echo` reports that none has arrived."""

app = CommandGroup(no_args_is_help=True)

KeyArgument = Annotated[
    str, typer.Argument(metavar="KEY", help="Key below vrg/<match>/, such as clock or robot/*/state.")
]
CountOption = Annotated[int | None, typer.Option("--count", "-n", min=1, help="Stop after this many lines.")]


def _bus(on: MatchOptions) -> tuple[Keys, str]:
    name, endpoint = which_match(on)
    return Keys(name), endpoint


def _full_key(keys: Keys, key: str) -> str:
    return key if key.startswith(f"{keys.root}/") else f"{keys.root}/{key}"


def _plain(keys: Keys, key: str, payload: bytes) -> dict[str, Any]:
    """A message as plain data. A message that does not fit its key becomes its key, the error and its size."""
    topic = keys.topic_of(key, message_class)
    try:
        if topic is None:
            raise MessageError(f"{key}: the key map has no such key")
        received = decode(payload, topic.type, key)
    except MessageError as error:
        return {"key": key, "error": str(error), "bytes": len(payload)}
    body = msgspec.to_builtins(received.body)
    head = {"sender": received.sender, "stamp": received.stamp, "sequence": received.sequence}
    return {"key": key, **head, **body}


class Newest(queue.Queue[tuple[str, bytes]]):
    """A queue that forgets its oldest item for a new one where it is full, and never blocks who puts one in."""

    def _init(self, maxsize: int) -> None:
        self.queue = deque(maxlen=QUEUE_LENGTH)


def listening(endpoint: str, typed_keys: Path | None) -> AbstractContextManager[tuple[Stop, Session]]:
    """A session that listens to a running match; see `connected`."""
    return connected(endpoint, typed_keys, Seat(SeatKind.OFFICIAL), Seat(SeatKind.WINDOW))


def arrivals_on(session: Session, *expressions: str) -> queue.Queue[tuple[str, bytes]]:
    """The queue of arrivals on key expressions: key and payload. If it is read too slowly, the oldest is dropped."""
    arrivals = Newest()
    for expression in expressions:
        session.watch_raw(expression, lambda key, payload: arrivals.put((key, payload)))
    return arrivals


@app.command("list")
def list_topics(
    on: MatchOptions,
    seconds: Annotated[float, lasting("How long to listen, real time.", 0.1, 60)] = 2.0,
    as_json: JsonOption = False,
) -> None:
    """List the keys that carry messages now, with their type, rate and size, and the nodes that are alive."""
    keys, endpoint = _bus(on)
    counts: Counter[str] = Counter()
    sizes: Counter[str] = Counter()

    def arrived(key: str, payload: bytes) -> None:
        counts[key] += 1
        sizes[key] += len(payload)

    with listening(endpoint, on.keys) as (stop, session):
        session.watch_raw(f"{keys.root}/**", arrived)
        stop.wait(seconds)
        nodes = sorted("/".join(map(name_of, key.split("/")[3:5])) for key in session.alive(keys.alive()))
    rows = []
    for key in sorted(counts):
        topic = keys.topic_of(key, message_class)
        kind = topic.type.__name__ if topic else "unknown"
        rows.append({"key": key, "type": kind, "hz": counts[key] / seconds, "bytes": sizes[key] // counts[key]})
    if as_json:
        typer.echo(json.dumps({"topics": rows, "nodes": nodes}))
        return
    for row in rows:
        typer.echo(f"{row['key']:<44} {row['type']:<14} {row['hz']:7.1f} Hz {row['bytes']:6d} B")
    typer.echo(f"nodes: {', '.join(nodes) or 'none'}")


@app.command()
def echo(key: KeyArgument, on: MatchOptions, count: CountOption = None, as_json: JsonOption = False) -> None:
    """Print messages as they come."""
    keys, endpoint = _bus(on)
    shown = 0
    quiet_at = time.monotonic() + QUIET
    with listening(endpoint, on.keys) as (stop, session):
        arrivals = arrivals_on(session, _full_key(keys, key))
        while not stop.is_set() and (count is None or shown < count):
            try:
                message = _plain(keys, *arrivals.get(timeout=0.1))
            except queue.Empty:
                if not shown and time.monotonic() > quiet_at:
                    quiet_at = math.inf
                    typer.echo(f"nothing on {_full_key(keys, key)} yet: `vrg topic list` shows what there is", err=True)
                continue
            shown += 1
            text = json.dumps(message)
            typer.echo(text if as_json or not sys.stdout.isatty() else json.dumps(message, indent=1))


@app.command()
def hz(key: KeyArgument, on: MatchOptions, count: CountOption = None, as_json: JsonOption = False) -> None:
    """Measure each second how often messages arrive, in real time: a line for each key."""
    keys, endpoint = _bus(on)
    expression = _full_key(keys, key)
    times: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=10_000))
    if "*" not in expression:
        times[expression]  # a single key is shown before anything has come

    def arrived(key: str, _payload: bytes) -> None:
        if key_matches(expression, key):
            times[key].append(time.monotonic())

    reports = 0
    with listening(endpoint, on.keys) as (stop, session):
        session.watch_raw(expression, arrived)
        while not stop.wait(1.0) and (count is None or reports < count):
            since = time.monotonic() - 1.0
            for of, came in sorted(times.copy().items()):
                row = _rate(of, [t for t in list(came) if t > since])
                typer.echo(json.dumps(row) if as_json else _rate_words(row))
            if not times and not as_json:
                typer.echo(f"{expression}: nothing has come yet")
            reports += 1


def _rate(key: str, times: Sequence[float]) -> dict[str, Any]:
    """How often messages came in a second, and the longest time between two of them; `times` are in s."""
    gaps = [b - a for a, b in pairwise(times)]
    return {"key": key, "hz": len(times), "gap_max_ms": round(max(gaps) * 1e3, 2) if gaps else None}


def _rate_words(row: Mapping[str, Any]) -> str:
    gap = "no gap to measure" if row["gap_max_ms"] is None else f"longest gap {row['gap_max_ms']} ms"
    return f"{row['key']}: " + (f"{row['hz']} Hz, {gap}" if row["hz"] else "nothing came in the last second")
