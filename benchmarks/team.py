"""How well pursuers know where intruders are: each alone, and as a team that tells its sightings over the radio.

Matches of pursuit-evasion are played by the shipped players in the planar world, with noisy sensors. What each pursuer
has seen is then told again to trackers: of one pursuer alone; of the team; of the team over a radio that loses 30 % of
the messages, delays the others by 0.1 to 0.5 s and so puts them out of order, and doubles 10 %; and of the team as if
all errors were independent. So all rows rest on the same sightings. Pursuers know their own poses by INS, or by the
fusion of their odometry with a poor camera.

Known is the share of the time in which an intruder in play is known to within KNOWN, of all pursuers and intruders.
Errors are distances to the truth now and in 3 s, wherever a course is within NEAR of it. Consistency is the normalised
estimation error squared (Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and
Navigation, 2001, section 5.4): where the covariance is right, its median is 1.39, and 95 % are below 5.99.
"""

import logging
import math
import random
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, show

import vrg.games.pursuit_evasion.pursuer as playing
from vrg.agents.perception.line import TrackedLine, squared_distance
from vrg.agents.perception.tracking import Tracker
from vrg.agents.strategy import View
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Sighting
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.config.loading import load_match, match_path
from vrg.games.pursuit_evasion import CROSSING, INTRUDER
from vrg.games.pursuit_evasion.watch import USUAL_SPEED, IntruderDetector
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.run_folder import RunFolder
from vrg.types import Vector

KNOWN, NEAR = 0.5, 1.5
"""m."""
AHEAD = 3.0
"""s."""
CAMERA = '[localisation.overhead]\nsource = "sim"\nrate = 5.0\nposition = 0.2\nheading = 5.0\n\n[rules]'
"""0.2 m and 5 degrees, five times a second."""
TICK = 0.1
"""The match time in s between two decisions."""


@dataclass
class Watched:
    """A match as it was seen.

    Args:
        seen: by the number of the tick, the sightings of each pursuer, by its name.
        truth: by the number of the tick, the place (m) and velocity (m/s) of each intruder in play.
        pursuers: the names of those who have looked.
    """

    seen: dict[int, dict[str, list[Sighting]]] = field(default_factory=lambda: defaultdict(dict))
    truth: dict[int, dict[str, tuple[Vector, Vector]]] = field(default_factory=dict)
    pursuers: set[str] = field(default_factory=set)


class Recorded(IntruderDetector):
    """The perception of a pursuer, which notes what it has seen."""

    watched = Watched()

    def look(self, view: View, *, standing: bool) -> None:
        """Look, and note it."""
        super().look(view, standing=standing)
        self.watched.pursuers.add(view.me.name)
        if self.fresh:
            self.watched.seen[round(view.time / TICK)][view.me.name] = self.fresh


class Truth(Node):
    """Notes where the intruders in play are."""

    kind = "watcher"

    def __init__(self, keys: Keys) -> None:
        super().__init__("truth", Mailbox(), TICK)
        self._poses = self.mailbox.subscribe(keys.poses)
        self._referee = self.mailbox.subscribe(keys.referee_state)

    def tick(self, tick: Tick) -> None:
        """Take in the newest poses."""
        poses, referee = self._poses.latest, self._referee.latest
        if poses is None or referee is None:
            return
        there = {p.name for p in referee.body.players if p.role == INTRUDER and p.state == CROSSING}
        Recorded.watched.truth[round(poses.stamp / TICK)] = {
            b.name: (
                (b.pose.x, b.pose.y),
                (b.twist.v * math.cos(b.pose.theta), b.twist.v * math.sin(b.pose.theta)),
            )
            for b in poses.body.bodies
            if b.name in there
        }


def watch(seed: int, *, camera: bool) -> Watched:
    """Play a match, and return what was seen."""
    text = match_path("pursuit-evasion").read_text(encoding="utf-8").replace("seed = 0", f"seed = {seed}")
    if camera:
        text = text.replace("[rules]", CAMERA)
        text = text.replace('role = "pursuer"', 'role = "pursuer"\nlocalisation = "fusion"')
    Recorded.watched = Watched()
    with tempfile.TemporaryDirectory() as name:
        path, folder = Path(name, "match.toml"), RunFolder(Path(name, "run"))
        path.write_text(text, encoding="utf-8")
        setup = load_match(path, engine="planar").at_rate(0)
        folder.prepare()
        with open_journal(setup, folder) as journal:
            in_process.play(setup, journal, limit=600.0, watchers=[Truth(setup.keys)])
    return Recorded.watched


@dataclass(frozen=True)
class Radio:
    """How sightings come to the others.

    Args:
        team: False if each is alone. bad: True if messages are lost, late and doubled.
        sources: False if trackers are not told who has seen what.
    """

    team: bool = True
    bad: bool = False
    sources: bool = True

    def delays(self, rng: random.Random) -> list[float]:
        """The times in s after which a message arrives: once, twice or never."""
        if not self.team:
            return []
        if not self.bad:
            return [TICK]
        if rng.random() < 0.3:
            return []
        return [rng.uniform(0.1, 0.5) for _ in range(2 if rng.random() < 0.1 else 1)]


ROWS = {
    "alone": Radio(team=False),
    "team": Radio(),
    "team, bad radio": Radio(bad=True),
    "team, as if independent": Radio(sources=False),
}


@dataclass
class Results:
    """The numbers of one row, each of one pursuer, intruder and tick; see the module."""

    known: list[bool] = field(default_factory=list)
    now: list[float] = field(default_factory=list)
    later: list[float] = field(default_factory=list)
    nees: list[float] = field(default_factory=list)
    nees_later: list[float] = field(default_factory=list)

    def judge(self, lines: Sequence[TrackedLine], place: Vector, velocity: Vector, time: float) -> None:
        """Compare what is known with where an intruder is."""
        line = min(lines, key=lambda each: math.dist(each.at(time), place), default=None)
        self.known.append(line is not None and math.dist(line.at(time), place) < KNOWN)
        if line is None or math.dist(line.at(time), place) >= NEAR:
            return
        for ahead, errors, nees in ((0.0, self.now, self.nees), (AHEAD, self.later, self.nees_later)):
            x, y = line.at(time + ahead)
            off = x - place[0] - ahead * velocity[0], y - place[1] - ahead * velocity[1]
            errors.append(math.hypot(*off))
            nees.append(squared_distance(off, line.covariance_at(time + ahead)))


def replay(watched: Watched, radio: Radio, results: Results, seed: int) -> None:
    """Tell the trackers of all pursuers what was seen."""
    rng = random.Random(seed)
    trackers = {name: Tracker(USUAL_SPEED) for name in sorted(watched.pursuers)}
    coming: list[tuple[int, str, str, list[Sighting]]] = []
    last: dict[str, Vector] = {}
    for tick, truth in sorted(watched.truth.items()):
        time = tick * TICK
        for who, scan in sorted(watched.seen.get(tick, {}).items()):
            coming.append((tick, who, who, scan))
            for whom in sorted(set(trackers) - {who}):
                coming += [(tick + round(delay / TICK), whom, who, scan) for delay in radio.delays(rng)]
        for name, tracker in trackers.items():
            for due, whom, who, scan in coming:
                if due <= tick and whom == name:
                    tracker.update(scan, time, who if radio.sources else None)
            tracker.tidy(time)
            for gone in last.keys() - truth.keys():  # the referee tells who is out of play
                tracker.tracks = [t for t in tracker.tracks if math.dist(t.line.at(time), last[gone]) > 1.0]
            lines = [track.line for track in tracker.tracks if track.line.last > track.line.first]
            for place, velocity in truth.values():
                results.judge(lines, place, velocity, time)
        coming = [each for each in coming if each[0] > tick]
        last = {name: place for name, (place, _) in truth.items()}


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--matches", type=int, default=30, help="the number of matches, with seeds from 0 on")
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    playing.IntruderDetector = Recorded  # type: ignore[misc]
    count, rows = 2 if options.quick else options.matches, []
    for poses, camera in (("INS", False), ("poor camera", True)):
        matches = [watch(seed, camera=camera) for seed in range(count)]
        for words, radio in ROWS.items():
            results = Results()
            for seed, match in enumerate(matches):
                replay(match, radio, results, seed)
            rows.append(row_of(poses, words, results))
    show(f"Where intruders are, {count} matches", rows, [], as_json=options.json)


def row_of(poses: str, words: str, r: Results) -> dict[str, Any]:
    """One row of the table."""
    return {
        "own pose": poses,
        "who": words,
        "known, %": round(100 * float(np.mean(r.known)), 1),
        "error, cm": round(100 * float(np.median(r.now)), 1),
        "rms": round(100 * math.sqrt(float(np.mean(np.square(r.now)))), 1),
        "in 3 s, cm": round(100 * float(np.median(r.later)), 1),
        "90 %": round(100 * float(np.quantile(r.later, 0.9)), 1),
        "NEES": round(float(np.median(r.nees)), 2),
        "< 5.99, %": round(100 * float(np.mean(np.array(r.nees) < 5.99)), 1),
        "NEES in 3 s": round(float(np.median(r.nees_later)), 2),
        "< 5.99, % ": round(100 * float(np.mean(np.array(r.nees_later) < 5.99)), 1),
    }


if __name__ == "__main__":
    main()
