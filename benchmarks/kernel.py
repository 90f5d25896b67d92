"""How many times as fast whole matches are with the compiled kernel as without it.

Each case of speed.py is played with the kernel and without it, in turns, on the same seeds, by processor time. Each
player can read its laser whenever it decides (against.write_reader), as else nobody computes what lasers would show.
"""

import logging
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from unittest.mock import patch

import against
from common import Stopwatch, arguments, median, show, write_match

import vrg
from vrg.hal.sim.compiled import kernel

CASES = [("planar", 8, False), ("planar", 64, False), ("planar", 8, True), ("mujoco", 8, False), ("mujoco", 8, True)]
"""The engine, the number of robots, and whether each player reads its laser."""
USERS = ("engines.engine", "engines.planar", "engines.traction", "engines.mujoco", "sensors.odometry", "sensors.rays")


@contextmanager
def without_kernel() -> Iterator[None]:
    """Compute as where nothing was compiled."""
    with ExitStack() as stack:
        for name in USERS:
            stack.enter_context(patch.object(import_module(f"vrg.hal.sim.{name}"), "kernel", None))
        yield


def cost(engine: str, robots: int, lasers: bool, seed: int) -> float:
    """The processor time of a match, s."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_match(folder, robots, engine=engine, lasers=lasers)
        reader = against.write_reader(folder)
        players = dict.fromkeys(("sharks", "minnows"), f"{folder}/{reader}") if lasers else {}
        watch = Stopwatch()
        vrg.play(folder / "match.toml", players, seed=seed, record=False, sandbox=False, runs=folder)
        return watch.read().cpu


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    options = parser.parse_args()
    if kernel is None:
        raise SystemExit("kernel: it is not compiled: `make setup` does that where there is a C compiler")
    logging.disable(logging.WARNING)
    cost("planar", 8, False, 0)  # what is imported, or made once
    rows = []
    for engine, robots, lasers in CASES:
        ratios = []
        for seed in range(1 if options.quick else 5):
            with_it = cost(engine, robots, lasers, seed)
            with without_kernel():
                ratios.append(cost(engine, robots, lasers, seed) / with_it)
            print(f"{engine} {robots} {lasers}: {ratios[-1]:.2f}", file=sys.stderr)
        read = "each player reads its own" if lasers else "none"
        row = {"engine": engine, "robots": robots, "lasers": read, "times as fast": median(ratios)}
        rows.append(row | {"from": min(ratios), "to": max(ratios)})
    show("Whole matches with the compiled kernel", rows, [], as_json=options.json)


if __name__ == "__main__":
    main()
