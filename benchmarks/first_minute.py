"""What the default match of each game shows in its first minute, over many seeds, as somebody sees it who watches.

shown     the first call of what the game is about: a tag, a capture, a flag taken; the share within 60 s of match time
still     the longest time without a call in which no robot has moved
quiet     the longest time without a call
waited    the longest time for which the match has waited for something, such as a line-up

python benchmarks/first_minute.py                                # 100 seeds of each game, on the planar engine
python benchmarks/first_minute.py --engine pybullet --seeds 20
python benchmarks/first_minute.py --game sharks-and-minnows --rule slowest=0.8 --rule zone_depth=3.0
"""

import argparse
import json
import logging
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from common import arguments, show

from vrg.config.loading import check_match, load_match, match_path
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.run_folder import RunFolder
from vrg.testing.audience import ABOUT, SOON, MatchWatcher, Seen
from vrg.toml_text import with_value


class Case(NamedTuple):
    """A match: the name of the game or a match file, the engine, the seed, and other rules than those of its file."""

    match: str
    engine: str
    seed: int
    rules: Mapping[str, Any]


def seen(case: Case) -> Seen:
    """What is seen of a match."""
    logging.disable(logging.CRITICAL)
    setup = load_match(match_path(case.match), engine=case.engine, seed=case.seed)
    text = setup.text
    for name, value in case.rules.items():
        text = with_value(text, ("rules", name), value)
    setup = check_match(text, Path(setup.origin), Path(setup.base)).at_rate(0)
    audience = MatchWatcher(setup)
    with tempfile.TemporaryDirectory() as name:
        folder = RunFolder(Path(name) / "run")
        folder.prepare()
        with open_journal(setup, folder) as journal:
            in_process.play(setup, journal, watchers=[audience])
    return audience.seen


def row(game: str, engine: str, found: Sequence[Seen]) -> dict[str, Any]:
    """The figures of many matches of a game."""
    firsts = [one.first(ABOUT[game]) for one in found]
    lengths = sorted(one.length for one in found)
    return {
        "game": game, "engine": engine, "matches": len(found),
        "shown": f"{sum(first <= SOON for first in firsts)} of {len(found)}",
        "first, s": round(median(firsts), 1),
        "calls of it": f"{min(counts := [one.count(ABOUT[game]) for one in found])} to {max(counts)}",
        "still, s": round(max(one.still for one in found), 1),
        "still > 15 s": sum(one.still >= 15.0 for one in found),
        "quiet, s": round(max(one.quiet for one in found), 1),
        "waited, s": round(max(one.waited for one in found), 1),
        "length, s": f"{lengths[0]:.0f} to {lengths[-1]:.0f}, {median(lengths):.0f}",
        "1 to 3 min": sum(60.0 <= one.length <= 180.0 for one in found),
        "won by": ", ".join(f"{who} {n}" for who, n in sorted(Counter(str(one.winner) for one in found).items())),
    }  # fmt: skip


def main() -> None:
    """Measure, and print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="matches of each game, from seed 0 on")
    parser.add_argument("--engine", default="planar")
    parser.add_argument("--game", action="append", choices=[*ABOUT], help="one game; may be given several times")
    parser.add_argument("--match", help="a match file of the one --game, in place of its default match")
    parser.add_argument("--rule", action="append", type=_rule, default=[], metavar="NAME=VALUE", help="another rule")
    parser.add_argument("--jobs", type=int, default=2, help="matches at a time")
    options = parser.parse_args()
    rows, rules = [], dict(options.rule)
    with ProcessPoolExecutor(options.jobs) as pool:
        for game in options.game or ABOUT:
            seeds = range(2 if options.quick else options.seeds)
            cases = [Case(options.match or game, options.engine, seed, rules) for seed in seeds]
            found = list(pool.map(seen, cases))
            rows.append(row(game, options.engine, found))
    show(f"The first minute, {rules or 'by the match files'}", rows, [], as_json=options.json)


def _rule(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    try:
        return name, json.loads(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected NAME=VALUE, such as slowest=0.8, got {text!r}") from None


if __name__ == "__main__":
    main()
