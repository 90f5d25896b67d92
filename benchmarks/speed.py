"""How many times faster than real time a whole match runs in one process.

World, referee and all players of Sharks and Minnows in lockstep, with the journal on disk and without a recorder, over
a fixed stretch of play that leaves out construction and the first second. Each case is run beside a unit of the
reference workload (common.reference), in turns; `x reference` is match seconds for each unit's time, and the number to
compare between machines. `x real time` is by processor time of this process, which others on the machine disturb
least; `by wall` is by real time.
"""

import cProfile
import io
import logging
import pstats
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import against
from common import Cost, Stopwatch, arguments, median, reference, show, write_match
from msgspec import structs

from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.run_folder import RunFolder

ROBOTS = (8, 16, 32, 64)
ENGINE_NAMES = ("pybullet", "mujoco", "planar")
WARM_UP = 1.0
"""s of match time that are not counted: everybody arms, caches fill."""
AIMS = {("pybullet", 8, True): 15.0, ("planar", 8, False): 100.0}
"""Times real time."""


@dataclass
class Case:
    """One kind of match.

    Args:
        runs: (match seconds, what they cost, what a reference unit cost beside them).
    """

    engine: str
    robots: int
    lasers: bool
    runs: list[tuple[float, Cost, Cost]] = field(default_factory=list)

    @property
    def key(self) -> tuple[str, int, bool]:
        """For AIMS."""
        return self.engine, self.robots, self.lasers

    def row(self) -> dict[str, Any]:
        """Of the table."""
        speed = median([seconds / cost.cpu for seconds, cost, _ in self.runs])
        aim = AIMS.get(self.key)
        return {
            "engine": self.engine,
            "robots": self.robots,
            "lasers": "10 Hz, each player reads its own" if self.lasers else "none",
            "x real time": speed,
            "by wall": median([seconds / cost.wall for seconds, cost, _ in self.runs]),
            "us a tick": median([cost.cpu / seconds * 0.02 * 1e6 for seconds, cost, _ in self.runs]),
            "x reference": median([seconds / cost.cpu * unit.cpu for seconds, cost, unit in self.runs]),
            "aim": None if aim is None else f"{aim:.0f}x: {'met' if speed >= aim else 'missed'}",
        }


@contextmanager
def _match(case: Case, seed: int) -> Iterator[tuple[MatchSetup, Journal]]:
    with tempfile.TemporaryDirectory() as name:
        setup = write_match(Path(name), case.robots, engine=case.engine, lasers=case.lasers, seed=seed)
        if case.lasers:  # nobody computes what nobody reads
            reader = against.write_reader(Path(name))
            readers = [structs.replace(player, strategy=reader) for player in setup.players]
            setup = structs.replace(setup, players=readers)
        with open_journal(setup, RunFolder(Path(name))) as journal:
            yield setup, journal


def play(case: Case, seconds: float, seed: int, profile: cProfile.Profile | None = None) -> tuple[float, Cost]:
    """Play `seconds` of match time; (match seconds that were measured, fewer if the match ended, their cost)."""
    watch: Stopwatch | None = None
    began = ended = 0.0
    cost = Cost(0.0, 0.0)

    def pace(now: float) -> bool:
        nonlocal watch, began, ended, cost
        if watch is None:
            if now >= WARM_UP:
                began, watch = now, Stopwatch()
                if profile is not None:
                    profile.enable()
        elif now >= began + seconds - 1e-9:
            ended, cost = now, watch.read()
            return False
        else:
            ended = now
        return True

    with _match(case, seed) as (setup, journal):
        in_process.play(setup, journal, pace=pace)
        if profile is not None:
            profile.disable()
    if cost.wall == 0.0 and watch is not None:
        cost = watch.read()
    return ended - began, cost


def measure(cases: list[Case], seconds: float, rounds: int) -> None:
    """Every case in turn beside the reference, so many times over."""
    for round_ in range(rounds):
        for case in cases:
            before = reference()
            played, cost = play(case, seconds, seed=round_)
            after = reference()
            unit = Cost((before.wall + after.wall) / 2, (before.cpu + after.cpu) / 2)
            case.runs.append((played, cost, unit))
            print(f"{case.engine} {case.robots} {case.lasers}: {played / cost.cpu:.1f}x", file=sys.stderr)


def profiled(case: Case, seconds: float) -> str:
    """The twenty functions with most time of their own."""
    profile = cProfile.Profile()
    play(case, seconds, 0, profile)
    text = io.StringIO()
    pstats.Stats(profile, stream=text).sort_stats("tottime").print_stats(20)
    return text.getvalue()


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=ROBOTS)
    parser.add_argument("--engine", choices=ENGINE_NAMES, help="only this one")
    parser.add_argument("--lasers", choices=("yes", "no"), help="only with, or only without")
    parser.add_argument("--rounds", type=int, default=None)
    parser.add_argument("--against", metavar="COMMIT", help="play whole matches of two versions, in turns")
    parser.add_argument("--profile", metavar="FILE", type=Path, help="write the profile of the first case and end")
    options = parser.parse_args()
    logging.disable(logging.WARNING)
    engines = (options.engine,) if options.engine else ENGINE_NAMES
    if options.against:
        with tempfile.TemporaryDirectory() as folder:
            whole = against.cases(Path(folder), options.robots, engines)
            seeds, rounds = ((1,), 1) if options.quick else ((1, 2, 3), options.rounds or 3)
            notes = against.compare(options.against, whole, seeds, rounds)
        title = "Whole matches of two versions"
        show(title, [case.row() for case in whole], notes, as_json=options.json)
        return
    lasers = (options.lasers == "yes",) if options.lasers else (True, False)
    cases = [Case(e, n, with_) for n in options.robots for e in engines for with_ in lasers]
    seconds = 2.0 if options.quick else 30.0
    if options.profile:
        options.profile.write_text(profiled(cases[0], seconds))
        print(options.profile.read_text())
        return
    measure(cases, seconds, options.rounds or (1 if options.quick else 3))
    unit = median([unit.cpu for case in cases for _, _, unit in case.runs])
    notes = [f"{seconds:g} s of play a run, {len(cases[0].runs)} runs; a reference unit took {unit * 1e3:.0f} ms"]
    show("Whole match in one process", [case.row() for case in cases], notes, as_json=options.json)


if __name__ == "__main__":
    main()
