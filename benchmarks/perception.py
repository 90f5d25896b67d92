"""What a pursuer's perception costs, how good its estimates are, and interception theory beside brute force.

    time      what a tick of perception costs for a scan of 181 beams, with one intruder in sight
    error     the error of speed and heading of a fitted course by the number of sightings, with perfect and with noisy
              sensors
    match     how many times faster than real time a whole match of five robots runs in one process, with PyBullet and
              lasers; the intruders are slow and the first auction is long, so that everybody is in sight all the time
    theory    the largest difference between each function of interception and a brute force over random cases

An intruder of the size of an ATRV-Jr crosses the surveillance area of the thesis' match on random courses; one or two
pursuers stand at their posts. Sightings come from simulated scans, ten a second for each pursuer.
"""

import logging
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import numpy.typing as npt
from common import Stopwatch, arguments, median, quantile, reference, show

from vrg.agents.interception import intercept
from vrg.agents.perception.background import Snapshot, returns_of, snapshot, unusual
from vrg.agents.perception.clusters import clusters, sighting_of
from vrg.agents.perception.line import fitted
from vrg.agents.perception.scan import Scan, make_scan
from vrg.agents.perception.tracking import Tracker
from vrg.agents.pursuit import lion_move
from vrg.bus.messages import Sighting
from vrg.config.loading import load_match, match_path
from vrg.geometry import circumradius, wrap
from vrg.hal.models import robot_model
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors.rays import Edges, Fan, among_robots, cast
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.regions import Rectangle
from vrg.runs.run_folder import RunFolder
from vrg.segments import nearest_on_segment
from vrg.types import Pose

POSTS = (Pose(-7.0, -20.0, 0.0), Pose(3.0, -22.0, math.pi), Pose(-3.0, -26.0, 0.0))
MIDDLE = Rectangle(-5.0, -24.5, 1.0, -19.0)
SPEED = 0.7
COUNTS = (2, 3, 5, 10, 20, 40, 80)
MATCH_AIM = 40.0
"""Times real time, for a whole match with PyBullet."""
SLOW = "[rules]\nintruder_speed = 0.2\nlaunch_window = 1.0\nauction = 30.0"
"""The rules with which nobody is captured in the first half minute."""
AIM = 2000.0
"""us for a tick of perception."""
Floats = npt.NDArray[np.float64]


class Post:
    """A pursuer that stands at its post and looks at one intruder."""

    def __init__(self, pose: Pose, rng: np.random.Generator, *, noisy: bool) -> None:
        self._walls = Edges(load_map("courtyard").edges)
        self._discs = load_map("courtyard").discs
        self._model, self._intruder = robot_model("P2AT"), robot_model("ATRV-Jr")
        assert self._model.sensor(LaserSpec) is not None
        self._laser, self._ins = self._model.sensor(LaserSpec), self._model.sensor(InsSpec) or InsSpec()
        self._fan = Fan.of(self._laser.beams, self._laser.fov)
        self._pose, self._rng, self._noisy = pose, rng, noisy
        self.empty: Snapshot = snapshot([self.scan(None) for _ in range(5)])

    def scan(self, intruder: Pose | None) -> Scan:
        """What its laser sees, put on the map from where it measures itself to be."""
        edges = self._walls
        if intruder is not None:
            poses = np.array([[intruder.x, intruder.y, intruder.theta]])
            edges = among_robots(self._walls, [self._intruder], poses)
        x, y = self._pose.x + self._laser.x * math.cos(self._pose.theta), self._pose.y
        ranges = cast(x, y, self._pose.theta, self._fan, self._laser.range_max, edges, self._discs)
        believed = self._pose
        if self._noisy:
            nothing = ranges >= self._laser.range_max - 1e-9
            ranges = np.rint((ranges + self._rng.normal(0, self._laser.noise, ranges.shape)) / self._laser.resolution)
            ranges = np.where(nothing, self._laser.range_max, ranges * self._laser.resolution)
            dx, dy = self._rng.normal(0, self._ins.position_noise, 2)
            turn = self._rng.normal(0, self._ins.heading_noise)
            believed = Pose(self._pose.x + dx, self._pose.y + dy, self._pose.theta + turn)
        return make_scan(
            ranges, believed, mount=self._laser.x, angle_min=self._fan.first, angle_step=self._fan.step,
            range_max=self._laser.range_max,
        )  # fmt: skip

    def sightings(self, scan: Scan, time: float) -> list[Sighting]:
        """What it sees in a scan that was not there before."""
        radius = circumradius(self._intruder.size)
        found = clusters(scan, unusual(scan, [self.empty]))
        return [sighting_of(scan, beams, radius=radius, time=time) for beams in found]


def course(rng: np.random.Generator) -> tuple[Pose, float]:
    """Where an intruder is when it is half-way, in the middle of the area, with a random heading; and its speed."""
    x, y = rng.uniform(MIDDLE.x_min, MIDDLE.x_max), rng.uniform(MIDDLE.y_min, MIDDLE.y_max)
    return Pose(float(x), float(y), float(rng.uniform(-math.pi, math.pi))), SPEED


def errors(noisy: bool, posts: int, courses: int) -> dict[int, list[tuple[float, float]]]:
    """The errors of speed (m/s) and of heading (degrees) of each course, by the number of sightings."""
    found: dict[int, list[tuple[float, float]]] = {count: [] for count in COUNTS}
    for seed in range(courses):
        rng = np.random.default_rng([seed, posts])
        half_way, speed = course(rng)
        order = rng.permutation(len(POSTS))[:posts]
        guards = [Post(POSTS[i], rng, noisy=noisy) for i in order]
        seen: list[Sighting] = []
        for step in range(160):
            time = step * 0.1
            along = speed * (time - 8.0)
            here = Pose(
                half_way.x + along * math.cos(half_way.theta), half_way.y + along * math.sin(half_way.theta),
                half_way.theta,
            )  # fmt: skip
            if not -9.0 < here.x < 5.0 or not -28.0 < here.y < -16.0 or _near(here, guards):
                continue
            for guard in guards:
                seen += guard.sightings(guard.scan(here), time)
            if len(seen) >= COUNTS[-1]:
                break
        for count in COUNTS:
            if len(seen) >= count and len({s.time for s in seen[:count]}) > 1:
                vx, vy = fitted(seen[:count], time=seen[0].time, speed=0.5).velocity
                turn = abs(wrap(math.atan2(vy, vx) - half_way.theta))
                found[count].append((abs(math.hypot(vx, vy) - speed), math.degrees(turn)))
    return found


def _near(intruder: Pose, guards: list[Post]) -> bool:
    """Whether an intruder would touch a pursuer, which stands in its way."""
    return any(math.dist((intruder.x, intruder.y), (g._pose.x, g._pose.y)) < 1.0 for g in guards)


def show_errors(courses: int, *, as_json: bool) -> None:
    """Print the table of errors."""
    rows = []
    for noisy in (False, True):
        for posts in (1, 2):
            for count, pairs in errors(noisy, posts, courses).items():
                if not pairs:
                    continue
                speeds, headings = [p[0] for p in pairs], [p[1] for p in pairs]
                rows.append(
                    {
                        "sensors": "noisy" if noisy else "perfect", "pursuers": posts, "sightings": count,
                        "courses": len(pairs), "speed, m/s": round(median(speeds), 3),
                        "p90": round(quantile(speeds, 0.9), 3), "heading, deg": round(median(headings), 1),
                        "p90 ": round(quantile(headings, 0.9), 1),
                    }
                )  # fmt: skip
    show("Error of a fitted course", rows, [f"intruders at {SPEED} m/s"], as_json=as_json)


def show_time(rounds: int, *, as_json: bool) -> None:
    """Print what a tick of perception costs."""
    rng = np.random.default_rng(1)
    post = Post(POSTS[0], rng, noisy=True)
    others = [Post(pose, rng, noisy=True).empty for pose in POSTS[1:]]
    scans = [(post.scan(Pose(-6.0 + 0.1 * i, -19.0 - 0.05 * i, -0.5)), 0.1 * i) for i in range(40)]
    known = [((3.0, -22.0), 0.7), ((-3.0, -26.0), 0.7)]
    costs, units = [], []
    radius = circumradius(robot_model("ATRV-Jr").size)
    for _ in range(rounds):
        tracker, watch = Tracker(0.5), Stopwatch()
        for scan, time in scans:
            fresh = make_scan(
                scan.ranges, POSTS[0], mount=0.1, angle_min=scan.angle_min, angle_step=scan.angle_step, range_max=8.0
            )
            explained = returns_of(fresh, known)
            found = clusters(fresh, unusual(fresh, [post.empty, *others], explained), explained)
            tracker.update([sighting_of(fresh, beams, radius=radius, time=time) for beams in found], time, "post")
            tracker.tidy(time)
        costs.append(watch.read().cpu / len(scans))
        units.append(reference().cpu)
    ratio = median([cost / unit for cost, unit in zip(costs, units, strict=True)])
    us = 1e6 * median(costs)
    row = {
        "what": "a tick of perception, 181 beams, three snapshots",
        "us": round(us, 1),
        "x reference": ratio,
        "aim": AIM,
    }
    show("Perception", [row], [], as_json=as_json)


def show_match(rounds: int, *, as_json: bool) -> None:
    """Print how fast a whole match runs."""
    rows = []
    for engine in ("pybullet", "planar"):
        speeds, ratios = [], []
        for _ in range(rounds):
            speed = _speed(engine)
            speeds.append(speed)
            ratios.append(speed * reference().cpu)
        aim = f"{MATCH_AIM:g}: {'met' if median(speeds) >= MATCH_AIM else 'missed'}" if engine == "pybullet" else None
        rows.append({"engine": engine, "x real time": median(speeds), "x reference": median(ratios), "aim": aim})
    show("A match of three pursuers and two intruders", rows, [], as_json=as_json)


def _speed(engine: str) -> float:
    """Match seconds in a second of this process, from 2 s to 30 s of match time."""
    marks: list[tuple[float, float]] = []

    def pace(time: float) -> bool:
        if time >= (2.0 if not marks else 30.0):
            marks.append((time, process_time()))
        return len(marks) < 2

    text = match_path("pursuit-evasion-table-4-1").read_text(encoding="utf-8").replace("[rules]", SLOW)
    with tempfile.TemporaryDirectory() as name:
        path, folder = Path(name, "match.toml"), RunFolder(Path(name, "run"))
        path.write_text(text, encoding="utf-8")
        setup = load_match(path, engine=engine).at_rate(0)
        folder.prepare()
        with open_journal(setup, folder) as journal:
            in_process.play(setup, journal, pace=pace)
    (begin, before), (end, after) = marks
    return (end - begin) / (after - before)


def theory(cases: int) -> dict[str, tuple[float, str]]:
    """The largest difference of each function from its brute force, with its unit."""
    rng = np.random.default_rng(0)
    return {
        "intercept (eq. 4.4, with reach and k)": (_worst(cases, rng, _intercept), "s"),
        "lion_move": (_worst(cases, rng, _lion), "m"),
    }


def _worst(cases: int, rng: np.random.Generator, one: Callable[[np.random.Generator], float]) -> float:
    return max(one(rng) for _ in range(cases))


def _intercept(rng: np.random.Generator) -> float:
    """The difference between a meeting and the first time of a fine grid at which the target is within reach."""
    px, py, tx, ty = rng.uniform(-10, 10, 4)
    vx, vy = rng.uniform(-1.5, 1.5, 2)
    speed, reach, k = rng.uniform(0.2, 1.5), rng.uniform(0.0, 1.0) * (rng.random() < 0.5), rng.uniform(0.2, 1.0)
    met = intercept((px, py), speed, (tx, ty), (vx, vy), reach=reach, k=k)
    horizon = 400.0 if met is None else 1.05 * met.time + 0.1
    times = np.linspace(0.0, horizon, 20_001)
    apart = np.hypot(tx + vx * times - px, ty + vy * times - py) - reach - k * speed * times
    there = np.flatnonzero(apart <= 0.0)
    if met is None:
        return math.inf if there.size else 0.0
    if not there.size:
        return math.inf
    first, step = times[there[0]], times[1]
    return max(0.0, abs(met.time - first) - step)


def _lion(rng: np.random.Generator) -> float:
    """How much farther from the man the lion's move is than the best of many points that are within its reach."""
    centre, man = (0.0, 0.0), tuple(rng.uniform(-5, 5, 2))
    step, share = rng.uniform(0.05, 1.0), rng.random()
    aside = rng.uniform(-1.0, 1.0) * step
    length = math.hypot(*man)
    lion = (man[0] * share - man[1] / length * aside, man[1] * share + man[0] / length * aside)
    goal = lion_move(centre, lion, man, step)
    if math.dist(lion, goal) > step + 1e-9:
        return math.inf
    points = np.linspace(0.0, 1.0, 2001)[:, None] * np.array(man)
    reached = points[np.hypot(points[:, 0] - lion[0], points[:, 1] - lion[1]) <= step]
    if not reached.size:
        return math.dist(goal, nearest_on_segment(goal, centre, man)) if math.dist(lion, man) > 1.5 * step else 0.0
    best = float(np.hypot(reached[:, 0] - man[0], reached[:, 1] - man[1]).min())
    return max(0.0, math.dist(goal, man) - best)


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--only", choices=["time", "match", "error", "theory"])
    options = parser.parse_args()
    if options.only in (None, "time"):
        show_time(2 if options.quick else 15, as_json=options.json)
    if options.only in (None, "match"):
        logging.disable(logging.CRITICAL)
        show_match(1 if options.quick else 5, as_json=options.json)
    if options.only in (None, "error"):
        show_errors(5 if options.quick else 200, as_json=options.json)
    if options.only in (None, "theory"):
        cases = 300 if options.quick else 10_000
        rows = [
            {"function": name, "cases": cases, "largest difference": f"{worst:.2g} {unit}"}
            for name, (worst, unit) in theory(cases).items()
        ]
        show("Interception beside brute force", rows, [], as_json=options.json)


if __name__ == "__main__":
    main()
