"""What other machines and seats cost: how long a match takes to start, and how long its commands take to arrive.

A match of ten processes (router, world, referee, recorder and six players of Sharks and Minnows, engine `planar`) is
played in six ways: on one machine, on four, and at two sites with a router each, each without seats and with them (TLS,
certificates and access control). The machines are network namespaces of this computer with an sshd each, joined by a
bridge, as in the system tests; so there is no latency of a real network in the figures, and all share its processors.
Run it within `scripts/with-loopback`.

- Start: from `vrg play` until all robots move.
- Delay: for each player's tick, from the arrival of the world's clock to the arrival of the command that follows from
  it, both as heard by a process beside the world: two ways over the network, two through each router, and a decision.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from common import arguments, quantile, show

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.system.lab import Lab, laboratory
from vrg.bus.codec import header
from vrg.bus.session import open_session
from vrg.bus.topics import Keys, name_in
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind
from vrg.testing.processes.match import LiveMatch

PLAYERS = ("shark", "ann", "bob", "cid", "dee", "eve")
MATCH = """
name = "machines-{name}"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = 5
{seats}
{machines}

[rules]
x = [-30.0, 30.0]
y = [-95.0, 95.0]
zone_depth = 6.0
passes = 1
"""
WAYS = ("one machine", "four machines", "two sites")


def main() -> None:
    """Play the ways in turns, and print one table."""
    parser = arguments(__doc__)
    parser.add_argument("--listen", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.listen:
        listen(*options.listen)
        return
    turns, seconds = (1, 2.0) if options.quick else (3, 15.0)
    ways = WAYS[:2] if options.quick else WAYS
    starts: dict[tuple[str, bool], list[float]] = {}
    delays: dict[tuple[str, bool], list[float]] = {}
    with tempfile.TemporaryDirectory() as name, laboratory(Path(name) / "lab", "h1", "h2", "h3") as lab:
        for turn in range(turns):
            for way in ways:
                for seats in (False, True):
                    folder = Path(name) / f"{turn}-{way}-{seats}".replace(" ", "-")
                    folder.mkdir()
                    start, measured = play(folder, lab, way, seats, seconds)
                    starts.setdefault((way, seats), []).append(start)
                    delays.setdefault((way, seats), []).extend(measured)
    base = quantile(delays["one machine", False], 0.5)
    rows = [
        {
            "played": way,
            "seats": "yes" if seats else "no",
            "start, s": round(statistics.median(starts[way, seats]), 2),
            "delay p50, ms": round(1000 * quantile(delays[way, seats], 0.5), 2),
            "p99, ms": round(1000 * quantile(delays[way, seats], 0.99), 2),
            "p50 / one machine": round(quantile(delays[way, seats], 0.5) / base, 2),
            "p50 with seats / without": round(_median(delays, way, True) / _median(delays, way, False), 2)
            if seats
            else None,
            "commands": len(delays[way, seats]),
        }
        for way, seats in delays
    ]
    show("A match over machines", rows, [f"{turns} turns, {seconds:g} s of play each"], as_json=options.json)


def _median(delays: dict[tuple[str, bool], list[float]], way: str, seats: bool) -> float:
    return quantile(delays[way, seats], 0.5)


def play(folder: Path, lab: Lab, way: str, seats: bool, seconds: float) -> tuple[float, list[float]]:
    """Play one match; its start and its delays, s."""
    began = time.monotonic()
    with LiveMatch(folder, text_of(lab, way, seats), environment=lab.environment, movers=PLAYERS[1:]) as match:
        start = time.monotonic() - began
        return start, measured(match, seconds)


def measured(match: LiveMatch, seconds: float) -> list[float]:
    """The delays while so many seconds of match time go by, s, as a process of its own hears them."""
    command = [sys.executable, __file__, "--listen", match.endpoint, match.keys.match, str(match.seats or "")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as listener:
        match.observer.time_passes(seconds, "measuring")
        said, _ = listener.communicate(timeout=60.0)
    return [float(delay) for delay in json.loads(said)]


def listen(endpoint: str, name: str, folder: str) -> None:
    """Hear a match until the standard input ends, and print the delays."""
    clocks: dict[float, float] = {}
    drives: list[tuple[str, float, float]] = []

    def clock(key: str, payload: bytes) -> None:
        clocks.setdefault(header(payload, key).stamp, time.monotonic())

    def drive(key: str, payload: bytes) -> None:
        drives.append((name_in(key), header(payload, key).stamp, time.monotonic()))

    credentials = find_credentials(Path(folder), [Seat(SeatKind.OFFICIAL)]) if folder else None
    keys = Keys(name)
    with open_session(endpoint, credentials=credentials) as session:
        session.watch_raw(keys.clock.key, clock, history=False)
        session.watch_raw(keys.drive().key, drive, history=False)
        sys.stdin.read()
        print(json.dumps(list(delays_of(clocks, drives))))


def delays_of(clocks: dict[float, float], drives: Sequence[tuple[str, float, float]]) -> Iterator[float]:
    """The delay of the first command of each player at each match time, s."""
    seen = set()
    for player, stamp, arrived in drives:
        if (player, stamp) not in seen and stamp in clocks:
            seen.add((player, stamp))
            yield max(0.0, arrived - clocks[stamp])


def text_of(lab: Lab, way: str, seats: bool) -> str:
    """The match file of one way to play."""
    tables = lab.tables() if way != WAYS[0] else ""
    if way == WAYS[2]:
        tables = tables.replace('host = "h1"', 'host = "h1"\nrouter = true')
        for name in ("h2", "h3"):
            tables = tables.replace(f'host = "{name}"', f'host = "{name}"\nvia = "h1"')
    secured = f"seats = {str(seats).lower()}"
    text = MATCH.format(name="seats" if seats else "open", seats=secured, machines=tables)
    for number, player in enumerate(PLAYERS):
        shark = player == "shark"
        machine = f'machine = "h{number % 3 + 1}"\n' if tables else ""
        text += (
            f'\n[[players]]\nname = "{player}"\nrole = "{"shark" if shark else "minnow"}"\n{machine}'
            f"x = {0.0 if shark else 8.0 * (number - 3)}\ny = {-92.0 if shark else 92.0}\n"
            f"heading = {90.0 if shark else -90.0}\n"
        )
    return text


if __name__ == "__main__":
    main()
