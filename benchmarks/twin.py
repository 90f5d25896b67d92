"""Whether many matches at once are the same game as one: every call of random matches beside the referee's.

With --planted it plants mistakes into the rules of the batch, one at a time, and tells after how many matches the
comparison has found each.
"""

import argparse
import sys
import time
import types
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from msgspec import structs

sys.path.insert(0, str(Path(__file__).parents[1] / "plugins" / "vrg-learn" / "tests"))
from batch import test_roboflag, test_sharks_and_minnows
from batch.refereeing import Wild, compare

from vrg.config.setup import MatchSetup
from vrg_learn import compiled
from vrg_learn.batch import matches, roboflag, sharks_and_minnows

AT_A_TIME, ROUNDS = 64, 250
"""The matches that are played at a time, and those after which others with another seed begin."""
SHARKS, FLAGS = "sharks-and-minnows", "roboflag"
PLANTED: Sequence[tuple[str, str, str]] = (
    (SHARKS, "t.points[SHARK] += t.roles[n] == MINNOW", "t.points[SHARK] += 1"),
    (SHARKS, "r.sizes, shark, n)", "r.sizes, n, shark)"),
    (SHARKS, "t.before[:] = m.poses\n    if over", "if over"),
    (SHARKS, "winner(left, t.number, s.rounds)", "winner(left, t.number - 1, s.rounds)"),
    (SHARKS, "t.roles[n], t.active[n] = SHARK, True\n    minnows_end", "t.active[n] = True\n    minnows_end"),
    (FLAGS, "if t.states[n] == NORMAL:\n            exposed", "if False:\n            exposed"),
    (FLAGS, "two = inside(start, end, (s.flag_places[1, 0], s.flag_places[1, 1]), s.zone)", "two = NEVER"),
    (FLAGS, "if s.sides[by] == team or t.states[by] == TAGGED:", "if s.sides[by] == team or t.after[by] == TAGGED:"),
    (FLAGS, "t.carriers[1 - team] = NO_ONE\n    t.states[:] = t.after", "pass\n    t.states[:] = t.after"),
    (FLAGS, "s.homes[team, 1]), s.home_reach) == NEVER", "s.homes[team, 1]), s.flag_reach) == NEVER"),
    (FLAGS, "decided = captured if sudden else", "decided = False if sudden else"),
)
"""The game, what stands in its module, and what stands there in place of it."""


def setups_of(game: str) -> list[MatchSetup]:
    """The matches of a game that are played: short ones, in which much happens."""
    if game == SHARKS:
        return [test_sharks_and_minnows.SETUP]
    setup = test_roboflag.SETUP
    return [
        structs.replace(setup, rules={**setup.rules, "round_time": time, "sudden_death": sudden, "captures": captures})
        for time, sudden, captures in ((30.0, 10.0, 1), (50.0, 20.0, 2), (20.0, 10.0, 1))
    ]


def run(game: str, total: int, seed: int) -> tuple[int, Counter[str], list[str]]:
    """Compare so many matches; return how many were, the calls in them, and the first differences."""
    drives = {SHARKS: test_sharks_and_minnows.drives, FLAGS: test_roboflag.drives}[game]
    played, calls = 0, Counter[str]()
    while played < total:
        setups = setups_of(game)
        ended = min(ROUNDS, total - played)
        found = compare(setups[seed % len(setups)], min(AT_A_TIME, ended), Wild(drives), ended=ended, seed=seed)
        played, seed = played + found.matches, seed + 1
        calls.update(found.calls)
        if found.differences:
            return played, calls, found.differences
        print(f"{game}: {played} matches, {calls.total()} calls, no difference", flush=True)
    return played, calls, []


def plant(game: str, old: str, new: str) -> None:
    """Let the batch play a game by rules with a mistake, which are compiled anew."""
    module = {SHARKS: sharks_and_minnows, FLAGS: roboflag}[game]
    source = Path(str(module.__file__)).read_text(encoding="utf-8")
    if source.count(old) != 1:
        raise SystemExit(f"{game}: expected once in {module.__file__}, found {source.count(old)} times: {old}")
    wrong = types.ModuleType(module.__name__)
    exec(compile(source.replace(old, new), str(module.__file__), "exec"), vars(wrong))
    matches.GAMES[game] = wrong.batched


def main() -> None:
    """Compare, or plant mistakes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--matches", type=int, default=200, help="of each game")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planted", action="store_true")
    options = parser.parse_args()
    if not options.planted:
        for game in (SHARKS, FLAGS):
            began = time.monotonic()
            played, calls, differences = run(game, options.matches, options.seed)
            print(
                f"{game}: {played} matches in {time.monotonic() - began:.0f} s, {dict(calls)}", *differences, sep="\n"
            )
        return
    machine_code = compiled._machine_code
    compiled._machine_code = lambda function, kept: machine_code(function, None)  # mistakes are not to be kept
    missed = 0
    for game, old, new in PLANTED:
        plant(game, old, new)
        played, _, differences = run(game, options.matches, options.seed)
        missed += not differences
        what = f"found before match {played + 1} had ended: {differences[0][:100]}" if differences else "NOT FOUND"
        print(f"{game}: {' '.join(new.split())}: {what}", flush=True)
    print(f"{len(PLANTED) - missed} of {len(PLANTED)} mistakes were found")


if __name__ == "__main__":
    main()
