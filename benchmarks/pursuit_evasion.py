"""How many intruders the pursuers capture, in many matches of pursuit-evasion in one process.

    capture   by the gain k of eq. 4.4, with perfect sensors and with noisy ones
    radio     by the share of messages that the radio loses, with a delay; --plot FILE draws the curve

Each is tried on the courses of the thesis' Table 4.1, where a seed changes the second intruder's start and all noise;
on random courses, of two intruders from random places around the area towards random places in its middle; on the same
with fast intruders, which drive FAST times as fast as the pursuers; and in examples/night_watch.toml, with four fast
intruders and a short radio. The same seeds are played in every row. The interval is Wilson's, for 95 %, over all
intruders.
"""

import json
import logging
import math
import random
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from common import arguments, show
from pursuers import BY_GAIN
from scipy.stats import binomtest

from vrg.config.loading import load_match, match_path
from vrg.games.pursuit_evasion import INTRUDERS, PURSUERS
from vrg.hal.models import robot_model
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.regions import Polygon
from vrg.runs.run_folder import RunFolder

HERE = Path(__file__).parent
WATCH = HERE.parent / "examples" / "night_watch.toml"
LOSSES = (0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0)
FAST = 1.4
"""The speed of fast intruders, in terms of the pursuers'."""
COURSES = ("table", "random", "fast", "watch")
LABELS = {
    "table": "Table 4.1",
    "random": "random courses",
    "fast": f"random courses, intruders {FAST} x as fast",
    "watch": "night watch",
}
INTRUDERS_IN = {"table": 2, "random": 2, "fast": 2, "watch": 4}

DELAY = 0.2
"""s that messages take in the second experiment."""


@dataclass(frozen=True)
class Trial:
    """One match.

    Args:
        courses: one of COURSES. engine: the physics engine. k: the gain of eq. 4.4.
        noise: noisy sensors. loss: the share of messages that are lost. delay: of messages, s. seed: of the match.
    """

    courses: str
    engine: str
    k: float
    noise: bool
    loss: float
    delay: float
    seed: int


def match_of(trial: Trial) -> str:
    """The text of the match file."""
    path = WATCH if trial.courses == "watch" else match_path("pursuit-evasion-table-4-1")
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    area = Polygon(tuple((x, y) for x, y in table["rules"]["area"]))
    rng = random.Random(trial.seed)
    for player in table["players"]:
        if player["role"] == "pursuer":
            player["strategy"] = str(HERE / BY_GAIN[trial.k])
        elif trial.courses in ("random", "fast"):
            player["x"], player["y"], player["heading"] = _course(area, table["players"], player, rng)
    slow = robot_model("P2AT").v_max
    speeds = {"intruder_speed": FAST * slow, "pursuer_speed": slow} if trial.courses == "fast" else {}
    top = {"name": "trial", "game": table["game"], "map": table["map"], "engine": trial.engine, "seed": trial.seed}
    parts = [
        _lines({**top, "noise": trial.noise}),
        "[radio]",
        _lines({**table.get("radio", {}), "loss": trial.loss, "delay": trial.delay}),
        *(f"[sensors.{kind}]\n{_lines(values)}" for kind, values in table.get("sensors", {}).items()),
        "[rules]",
        _lines({**table["rules"], **speeds}),
        *(f"[[players]]\n{_lines(player)}" for player in table["players"]),
    ]
    return "\n".join(parts)


def _lines(values: Mapping[str, Any]) -> str:
    """Values as lines of TOML, which writes texts, numbers, lists and truth as JSON does."""
    return "\n".join(f"{key} = {json.dumps(value)}" for key, value in values.items())


def _course(
    area: Polygon, players: Sequence[dict[str, Any]], own: dict[str, Any], rng: random.Random
) -> tuple[float, float, float]:
    """A random start around the area, and the heading in degrees to a random point in its middle."""
    x_min, y_min, x_max, y_max = area.bounds
    inner = area.shrunk(2.5)
    while True:
        x, y = rng.uniform(x_min - 2, x_max + 1), rng.uniform(y_min - 2, y_max + 2)
        a, b = rng.uniform(x_min, x_max), rng.uniform(y_min, y_max)
        room = all(math.dist((x, y), (p["x"], p["y"])) > 1.5 for p in players if p is not own)
        if room and 0.8 < area.distance(x, y) < 1.6 and inner.contains(a, b):
            return x, y, math.degrees(math.atan2(b - y, a - x))


def play(trial: Trial) -> tuple[int, int, float]:
    """Play a match; return how many were captured and escaped, and the time of play in s."""
    logging.disable(logging.CRITICAL)
    with tempfile.TemporaryDirectory() as name:
        path, folder = Path(name, "match.toml"), RunFolder(Path(name, "run"))
        path.write_text(match_of(trial), encoding="utf-8")
        setup = load_match(path).at_rate(0)
        folder.prepare()
        with open_journal(setup, folder) as journal:
            ending = in_process.play(setup, journal, limit=600.0)
    score = ending.state.score
    return score[PURSUERS], score[INTRUDERS], ending.state.total


def row_of(trials: Sequence[Trial], results: Sequence[tuple[int, int, float]], **cells: Any) -> dict[str, Any]:
    """One row: how many of all intruders were captured."""
    captured, escaped = (sum(column) for column in list(zip(*results, strict=True))[:2])
    expected = INTRUDERS_IN[trials[0].courses] * len(trials)
    interval = binomtest(captured, expected).proportion_ci(method="wilson")
    return {
        **cells,
        "matches": len(trials),
        "captured": captured,
        "escaped": escaped,
        "neither": expected - captured - escaped,
        "rate": round(captured / expected, 3),
        "95 %": f"{interval.low:.3f} to {interval.high:.3f}",
        "play, s": round(sum(time for _, _, time in results) / len(results), 1),
    }


def captures(kinds: Sequence[str], engine: str, seeds: int) -> Iterator[tuple[dict[str, Any], list[Trial]]]:
    """The rows of the first experiment."""
    for courses in kinds:
        for noise in (False, True):
            for k in sorted(BY_GAIN):
                cells = {"courses": courses, "sensors": "noisy" if noise else "perfect", "k": k}
                yield cells, [Trial(courses, engine, k, noise, 0.0, 0.0, seed) for seed in range(seeds)]


def radio(kinds: Sequence[str], engine: str, seeds: int) -> Iterator[tuple[dict[str, Any], list[Trial]]]:
    """The rows of the second experiment."""
    for courses in kinds:
        yield (
            {"courses": courses, "loss": 0.0, "delay, s": 0.0},
            [Trial(courses, engine, 1.0, True, 0.0, 0.0, seed) for seed in range(seeds)],
        )
        for loss in LOSSES:
            cells = {"courses": courses, "loss": loss, "delay, s": DELAY}
            yield cells, [Trial(courses, engine, 1.0, True, loss, DELAY, seed) for seed in range(seeds)]


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw the share of captured intruders over the share of lost messages."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only who draws waits for it

    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    for courses, marker in zip(COURSES, "os^D", strict=True):
        shown = [row for row in rows if row["courses"] == courses and row["delay, s"] > 0]
        if not shown:
            continue
        x = [100 * row["loss"] for row in shown]
        low, high = zip(*(map(float, row["95 %"].split(" to ")) for row in shown), strict=True)
        axes.plot(x, [100 * row["rate"] for row in shown], marker=marker, label=LABELS[courses])
        axes.fill_between(x, [100 * v for v in low], [100 * v for v in high], alpha=0.2)
    axes.set(xlabel=f"lost messages, % (all delayed by {DELAY} s)", ylabel="captured intruders, %", ylim=(0, 101))
    axes.grid(True, color="0.9")
    axes.legend(loc="lower left")
    figure.savefig(path, dpi=130)


def main() -> None:
    """Run an experiment and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("experiment", choices=["capture", "radio"])
    parser.add_argument("--seeds", type=int, default=200, help="matches in each row")
    parser.add_argument("--engine", default="pybullet")
    parser.add_argument("--courses", nargs="*", choices=COURSES, default=COURSES)
    parser.add_argument("--jobs", type=int, default=2, help="matches at a time")
    parser.add_argument("--plot", type=Path, help="where to draw the curve of `radio`")
    options = parser.parse_args()
    seeds = 2 if options.quick else options.seeds
    plan = list({"capture": captures, "radio": radio}[options.experiment](options.courses, options.engine, seeds))
    rows = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for done, (cells, trials) in enumerate(plan, 1):
            results = list(pool.map(play, trials, chunksize=4))
            rows.append(row_of(trials, results, **cells))
            print(f"{done} of {len(plan)}: {rows[-1]}", file=sys.stderr, flush=True)
    show(f"Pursuit-evasion, {options.engine}: {options.experiment}", rows, [], as_json=options.json)
    if options.plot is not None and options.experiment == "radio":
        draw(rows, options.plot)


if __name__ == "__main__":
    main()
