"""What it costs a match that its strategies decide in processes of their own, sealed and not.

The same match and seed is played in one process and in lockstep, in turns, as fast as possible. `of one process` is the
ratio of the real times, and the number to compare between machines; `ms a decision` is the real time between two
decisions of all players, and so the round trip to all of them and back.
"""

import logging
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from common import arguments, median, show, write_match
from msgspec import structs

from vrg.agents.player import PERIOD
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.nodes.referee import open_journal
from vrg.launch.sandbox.seal import missing
from vrg.playing import in_process
from vrg.playing.strategies import Strategies
from vrg.runs.run_folder import RunFolder

WAYS = ("one process", "lockstep", "lockstep, sealed")
ROBOTS = 8


def play(way: str, server: ForkServer, engine: str, seconds: float, seed: int) -> tuple[float, float, bytes]:
    """Play a match for some match time; the match seconds that were measured, the real time, and the journal."""
    began = ended = (0.0, 0.0)

    def pace(now: float) -> bool:
        nonlocal began, ended
        ended = now, time.perf_counter()
        if now < 1.0:
            began = ended
        return now < seconds

    with tempfile.TemporaryDirectory() as name:
        setup = write_match(Path(name), ROBOTS, engine=engine, lasers=False, seed=seed)
        apart = None
        if way != WAYS[0]:
            apart = Strategies(server, every=True, deadline=60.0)
            setup = structs.replace(setup, sandbox=way == WAYS[2])
        folder = RunFolder(Path(name))
        folder.prepare()
        with open_journal(setup, folder) as journal:
            in_process.play(setup, journal, pace=pace, logs=folder.logs, apart=apart)
        return ended[0] - began[0], ended[1] - began[1], folder.journal.read_bytes()


@contextmanager
def quiet() -> Iterator[None]:
    logging.disable(logging.WARNING)
    yield
    logging.disable(logging.NOTSET)


def main() -> None:
    """Run the benchmark, and print its table."""
    options = arguments(__doc__).parse_args()
    seconds, rounds = (5.0, 1) if options.quick else (60.0, 3)
    ways = [way for way in WAYS if "sealed" not in way or missing() is None]
    rows: list[dict[str, Any]] = []
    with fork_server() as server, quiet():
        for engine in ("planar", "pybullet"):
            runs: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
            for seed in range(rounds):
                journals = set()
                for way in ways:
                    played, took, journal = play(way, server, engine, seconds, seed)
                    runs[way].append((played, took))
                    journals.add(journal)
                    print(f"{engine}, {way}: {played / took:.1f}x", file=sys.stderr)
                if len(journals) > 1:
                    raise SystemExit(f"{engine}, seed {seed}: the journals differ")
            for way in ways:
                speeds = [played / took for played, took in runs[way]]
                ratios = [a[1] / b[1] * b[0] / a[0] for a, b in zip(runs[WAYS[0]], runs[way], strict=True)]
                rows.append(
                    {
                        "engine": engine,
                        "strategies": way,
                        "x real time": median(speeds),
                        "of one process": median(ratios),
                        "ms a decision": 1000.0 * PERIOD / median(speeds),
                    }
                )
    show("a match of 8 players", rows, ["the journals of all ways are the same, byte for byte"], as_json=options.json)


if __name__ == "__main__":
    main()
