"""How many decisions of whole matches a program that learns is given in a second.

A decision is one of all players of a match, 0.1 s of match time, with physics, rules, observations and rewards; actions
are random, and drawn before. `a processor-second` is by the time of all threads of this process, which others on the
machine disturb least; `by wall` is by real time. `motion alone` is the limit of the batch: its physics compiled in one
loop, without contacts, rules and observations. If mpe2 is installed (in an environment of its own: it brings another
pygame), its simple_tag with as many players is measured, too.
"""

import importlib.util
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from common import Cost, Stopwatch, arguments, median, reference, show

from vrg.config.loading import load_match, match_path
from vrg_learn.batch import motion
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.stepping import TICKS
from vrg_learn.compiled import HAS_NUMBA, compiled
from vrg_learn.environment import MatchEnvironment

GAMES = ("roboflag", "sharks-and-minnows")
Case = tuple[str, int, int, Callable[[], None]]
"""What is measured, the matches, the threads, and one step of all matches."""


def cases(quick: bool) -> Iterator[Case]:
    """Everything that is measured."""
    for game in GAMES:
        environment = MatchEnvironment(game, lasers=False)
        environment.reset(seed=0)
        actions = {agent: environment.action_space(agent).sample() for agent in environment.agents}
        yield f"{game}, one in this process", 1, 1, _stepping(environment, actions)
        setup = load_match(match_path(game))
        for matches in (1, 64) if quick else (1, 64, 1024):
            for threads in (1, 2) if matches > 1 else (1,):
                batch = Batch(setup, matches, threads=threads)
                batch.reset()
                yield f"{game}, batch", matches, threads, _driving(batch)
        batch = Batch(setup, 64, threads=1)
        for team in batch.teams[:2]:
            batch.play_by(slice(None), team, batch.strategies[0])
        batch.reset()
        yield f"{game}, batch, both teams by strategies", 64, 1, _driving(batch)
    yield "motion alone, 8 robots", 64, 1, _moving(64)
    if importlib.util.find_spec("mpe2"):
        yield "mpe2 simple_tag, 8 players", 1, 1, _tag()


def _stepping(environment: Any, actions: Any) -> Callable[[], None]:
    def step() -> None:
        environment.step(actions)
        if environment.over:
            environment.reset()

    return step


def _driving(batch: Batch) -> Callable[[], None]:
    rng = np.random.default_rng(0)
    shape = (16, batch.matches, len(batch.players), 2)
    actions = rng.uniform((-0.2, -1.0), (1.0, 1.0), shape).astype(np.float32)
    count = iter(range(10**9))
    return lambda: (batch.step(actions[next(count) % 16]), None)[1]


def _moving(matches: int) -> Callable[[], None]:
    setup = load_match(match_path("roboflag"))
    batch = Batch(setup, matches, threads=1)
    batch.reset()
    step, records = compiled(motion.advance), batch.records
    records.motions.targets[:] = 3.0
    records.motions.braking[:] = False
    still = np.zeros(matches, dtype=np.bool_)

    def move() -> None:
        records.motions.room[:] = 1e9
        step(0, matches, records.motions, records.robots, still, batch.walls, 0.02, TICKS)

    return move


def _tag() -> Callable[[], None]:
    from mpe2 import simple_tag_v3  # noqa: PLC0415 - it may be missing

    environment = simple_tag_v3.parallel_env(
        num_good=4, num_adversaries=4, num_obstacles=0, max_cycles=10**9, continuous_actions=True
    )
    environment.reset(seed=0)
    actions = {agent: environment.action_space(agent).sample() for agent in environment.agents}
    return lambda: (environment.step(actions), None)[1]


def measure(step: Callable[[], None], seconds: float) -> tuple[int, Cost]:
    """Step for so long; the steps, and what they cost."""
    for _ in range(3):
        step()
    watch, count = Stopwatch(), 0
    while watch.read().wall < seconds:
        step()
        count += 1
    return count, watch.read()


def main() -> None:
    """Print a table."""
    options = arguments(__doc__).parse_args()
    seconds, runs = (0.5, 1) if options.quick else (2.0, 3)
    rows = []
    for name, matches, threads, step in cases(options.quick):
        found = [(measure(step, seconds), reference()) for _ in range(runs)]
        rows.append(
            {
                "what": name,
                "matches": matches,
                "threads": threads,
                "a processor-second": median([count * matches / cost.cpu for (count, cost), _ in found]),
                "by wall": median([count * matches / cost.wall for (count, cost), _ in found]),
                "x reference": median([count * matches / cost.cpu * unit.cpu for (count, cost), unit in found]),
            }
        )
    show("Decisions of whole matches", rows, [f"numba: {'yes' if HAS_NUMBA else 'no'}"], as_json=options.json)


if __name__ == "__main__":
    main()
