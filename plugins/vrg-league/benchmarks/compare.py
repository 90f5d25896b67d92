"""How many games a second `vrg compare` plays, with one game at a time and with several, beside games in one process.

Two of the same strategy play Sharks and Minnows on the planar engine without lasers. The last row plays the same games
one after the other in this process, without the pool of processes, so the first row beside it is what the pool costs.
"""

import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from common import arguments, median, show
from msgspec import structs

from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup
from vrg.runs.run_folder import RunFolder
from vrg_league.conduct import Entrants, opened, workers_of
from vrg_league.contenders import contenders
from vrg_league.playing import judged, played

STRATEGY = "sharks-and-minnows"


def compared(setup: MatchSetup, games: int, jobs: int, *, ray: bool = False) -> float:
    """Play games as `vrg compare` does, or on a cluster of Ray on this computer; return how many a second."""
    both = Entrants(contenders([STRATEGY, STRATEGY]))
    with (
        tempfile.TemporaryDirectory() as name,
        opened(setup, both, both.pairings(), Path(name, "out"), games=games, play_all=True) as experiment,
    ):
        workers = workers_of(experiment, jobs, "local" if ray else None)
        began = time.perf_counter()
        experiment.run(workers, threading.Event())
        return games / (time.perf_counter() - began)


def alone(setup: MatchSetup, games: int) -> float:
    """Play and judge games in this process; return how many a second."""
    began = time.perf_counter()
    for number in range(games):
        with tempfile.TemporaryDirectory() as name:
            match, folder = structs.replace(setup, seed=number // 2), RunFolder(Path(name, "run"))
            judged(match, folder, played(match, folder, 3600.0))
    return games / (time.perf_counter() - began)


def rows_of(speeds: dict[str, Sequence[float]]) -> list[dict[str, Any]]:
    """A row for each way to play, beside one game at a time."""
    one = median(speeds["1 at a time"])
    return [
        {"games": way, "games/s": round(median(found), 3), "ratio to 1 at a time": round(median(found) / one, 2)}
        for way, found in speeds.items()
    ]


def main() -> None:
    """Run the benchmark and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--games", type=int, default=12, help="games in each measurement, an even number")
    parser.add_argument("--repeat", type=int, default=3, help="measurements, in turns")
    parser.add_argument("--jobs", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--ray", action="store_true", help="the same on a local cluster of Ray, too")
    options = parser.parse_args()
    games, repeat = (2, 1) if options.quick else (options.games, options.repeat)
    setup = load_match(match_path("sharks-and-minnows"), engine="planar", lasers=False)
    compared(setup, 2, 1)  # the server of processes loads
    speeds: dict[str, list[float]] = {}
    for _ in range(repeat):
        for jobs in sorted({1, *options.jobs}):
            speeds.setdefault(f"{jobs} at a time", []).append(compared(setup, games, jobs))
            if options.ray:
                speeds.setdefault(f"{jobs} at a time, Ray", []).append(compared(setup, games, jobs, ray=True))
        speeds.setdefault("in this process", []).append(alone(setup, games))
    show("vrg compare", rows_of(speeds), [], as_json=options.json)


if __name__ == "__main__":
    main()
