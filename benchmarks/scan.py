"""What one scan of 181 beams costs in the courtyard with 8 robots, and a reading of a sonar and of a camera beside it.

    world     LaserSimulation.sense: everything the world does for one scan, noise, resolution and message included
    cast      vrg.hal.sim.rays.cast alone
    numpy     every beam against every edge and circle as one numpy expression, without noise
    python    every beam against every edge and circle in a loop
    pybullet  rayTestBatch in the engine's own world, without noise
    sonar     SonarSimulation.sense: everything the world does for one reading of a ring of 16 transducers
    camera    CameraSimulation.sense: everything the world does for one picture of 320 x 240, drawn and encoded

In turns, many times over; `x cast` is the median ratio to the cast beside it, and `x world` the ratio to what the world
needs for one scan. `off` is the greatest difference
from cast in mm over all scans but for beams that graze a corner: the 1 % of largest differences is left out.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import pybullet
from common import Stopwatch, arguments, median, quantile, show

from vrg.hal.models import robot_model
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.sonar import SonarSpec
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.engines.engine import Floats, Start
from vrg.hal.sim.engines.pybullet import BulletEngine
from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors.base import Instant, Mounted, Surroundings
from vrg.hal.sim.sensors.camera import CameraSimulation
from vrg.hal.sim.sensors.laser import LaserSimulation
from vrg.hal.sim.sensors.rays import Edges, Fan, cast
from vrg.hal.sim.sensors.sonar import SonarSimulation
from vrg.hal.sim.shapes import box_edges
from vrg.types import Pose

P = TypeVar("P", bound=SensorSpec)
Result = TypeVar("Result")

AIM = 60.0
"""us for one scan in the world."""
ROBOTS = 8
HEIGHT = 0.2
"""m above ground of PyBullet's rays: where the other robots' bodies are."""
LAYOUTS = 8
"""Places of the robots, so that no single view decides."""


class Scene:
    """The courtyard with robots of one model at random free places in the field of Sharks and Minnows."""

    def __init__(self, seed: int) -> None:
        self.map = load_map("courtyard")
        self.model = robot_model("P2AT")
        assert self.model.sensor(LaserSpec) is not None
        self.mount: LaserSpec = self.model.sensor(LaserSpec)
        self.fan = Fan.of(self.mount.beams, self.mount.fov)
        self.poses = self._places(np.random.default_rng(seed))
        self.models = [self.model] * ROBOTS
        self.names = [f"robot{i}" for i in range(ROBOTS)]
        sizes = np.full((ROBOTS, 2), (self.model.length, self.model.width))
        self.segments = np.concatenate((self.map.edges, box_edges(np.hstack((self.poses, sizes)))))
        self.edges = Edges(self.segments)
        starts = zip(self.names, self.poses.tolist(), strict=True)
        self.engine = BulletEngine(self.map, [Start(name, self.model, Pose(*pose)) for name, pose in starts])
        self._tick = 0
        around, now = Surroundings(self.map, seed, noise=True), self._instant()
        self.lasers = LaserSimulation(around, self._mounted(LaserSpec), now)
        self.sonars = SonarSimulation(around, self._mounted(SonarSpec), now)
        self.cameras = CameraSimulation(around, self._mounted(CameraSpec), now)

    def _mounted(self, kind: type[P]) -> list[Mounted[P]]:
        return [Mounted(row, name, self.model, self._spec(kind)) for row, name in enumerate(self.names)]

    def _spec(self, kind: type[P]) -> P:
        spec = self.model.sensor(kind)
        assert spec is not None
        return spec

    @staticmethod
    def _places(rng: np.random.Generator) -> Floats:
        placed: list[tuple[float, float, float]] = []
        while len(placed) < ROBOTS:
            x, y, theta = rng.uniform(16.5, 25.5), rng.uniform(-31.5, -13.5), rng.uniform(-math.pi, math.pi)
            if all(math.dist((x, y), other[:2]) > 1.0 for other in placed):
                placed.append((x, y, theta))
        return np.array(placed)

    def sensor(self, row: int) -> tuple[float, float, float]:
        """Where a robot's range finder is."""
        x, y, theta = self.poses[row].tolist()
        return x + self.mount.x * math.cos(theta), y + self.mount.x * math.sin(theta), theta

    def others(self, row: int) -> Floats:
        """All edges but those of a robot's own body."""
        own = len(self.map.edges) + 4 * row
        return np.delete(self.segments, np.s_[own : own + 4], axis=0)

    def world(self) -> list[Floats]:
        """A scan of each robot as the world makes it."""
        every = self.mount.due_every(0.02)
        self._tick += every - self._tick % every
        said = self.lasers.sense(self._instant())
        return [scan.ranges.astype(np.float64) for _, _, scan in said if isinstance(scan, Laser)]

    def _instant(self) -> Instant:
        nothing = np.zeros((ROBOTS, 2))
        return Instant(
            self._tick,
            0.02,
            self.models,
            self.poses,
            nothing,
            nothing,
            [0] * ROBOTS,
            np.ones(ROBOTS),
            frozenset(self.names),
        )

    def sonar(self) -> None:
        """A reading of each robot's ring as the world makes it."""
        every = self._spec(SonarSpec).due_every(0.02)
        self._tick += every - self._tick % every
        assert len(self.sonars.sense(self._instant())) == ROBOTS

    def camera(self) -> None:
        """A picture of each robot's camera as the world makes it; not all are due at one tick."""
        said = 0
        for _ in range(self._spec(CameraSpec).due_every(0.02)):
            self._tick += 1
            said += len(self.cameras.sense(self._instant()))
        assert said == ROBOTS

    def cast(self) -> list[Floats]:
        """By our own geometry."""
        reach, discs = self.mount.range_max, self.map.discs
        return [cast(*self.sensor(row), self.fan, reach, self.edges, discs) for row in range(ROBOTS)]

    def numpy(self) -> list[Floats]:
        """All pairs at once."""
        return [self._all_pairs(*self.sensor(row), self.others(row)) for row in range(ROBOTS)]

    def _all_pairs(self, x: float, y: float, heading: float, segments: Floats) -> Floats:
        beams = self.fan.angles + heading
        ux, uy = np.cos(beams)[:, None], np.sin(beams)[:, None]
        x0, y0 = segments[:, 0] - x, segments[:, 1] - y
        dx, dy = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            across = ux * dy - uy * dx
            along = (x0 * dy - y0 * dx) / across
            share = (x0 * uy - y0 * ux) / across
        hit = (along > 0) & (share >= 0) & (share <= 1)
        nearest = np.where(hit, along, self.mount.range_max).min(axis=1)
        cx, cy, radius = self.map.discs[:, 0] - x, self.map.discs[:, 1] - y, self.map.discs[:, 2]
        middle = cx * ux + cy * uy
        square = radius * radius - cx * cx - cy * cy + middle * middle
        reach = middle - np.sqrt(np.maximum(square, 0.0))
        round_ = np.where((square >= 0) & (middle > 0), reach, self.mount.range_max).min(axis=1)
        found: Floats = np.minimum(np.minimum(nearest, round_), self.mount.range_max)
        return found

    def python(self) -> list[Floats]:
        """One pair at a time."""
        return [self._loop(*self.sensor(row), self.others(row)) for row in range(ROBOTS)]

    def _loop(self, x: float, y: float, heading: float, segments: Floats) -> Floats:
        edges = [(x0 - x, y0 - y, x1 - x0, y1 - y0) for x0, y0, x1, y1 in segments.tolist()]
        discs = [(cx - x, cy - y, radius) for cx, cy, radius in self.map.discs.tolist()]
        ranges = []
        for beam in (self.fan.angles + heading).tolist():
            ux, uy, best = math.cos(beam), math.sin(beam), self.mount.range_max
            for x0, y0, dx, dy in edges:
                across = ux * dy - uy * dx
                if across:
                    along = (x0 * dy - y0 * dx) / across
                    if 0 < along < best and 0 <= (x0 * uy - y0 * ux) / across <= 1:
                        best = along
            for cx, cy, radius in discs:
                middle = cx * ux + cy * uy
                square = radius * radius - cx * cx - cy * cy + middle * middle
                if square >= 0 and middle > 0:
                    best = min(best, middle - math.sqrt(square))
            ranges.append(best)
        return np.array(ranges)

    def pybullet(self) -> list[Floats]:
        """By the engine's rays. They begin outside the robot's own hull, which would stop them."""
        return [self._rays(*self.sensor(row)) for row in range(ROBOTS)]

    def _rays(self, x: float, y: float, heading: float) -> Floats:
        beams = self.fan.angles + heading
        near, reach = math.hypot(self.model.length, self.model.width), self.mount.range_max
        directions = np.stack((np.cos(beams), np.sin(beams), np.zeros(len(beams))), axis=1)
        at = np.array((x, y, HEIGHT))
        hits = pybullet.rayTestBatch(
            (at + near * directions).tolist(),
            (at + reach * directions).tolist(),
            physicsClientId=self.engine._client,
        )
        return near + np.array([hit[2] for hit in hits]) * (reach - near)


@dataclass
class Way:
    """One way to scan, or another sensor: us for a reading, ratios to the cast beside it, mm of difference from it."""

    name: str
    each: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    off: list[float] = field(default_factory=list)


def measure(scenes: list[Scene], rounds: int) -> list[Way]:
    """All ways in turns over all scenes; cast before and after each."""
    ways = [Way(name) for name in ("world", "cast", "numpy", "python", "pybullet", "sonar", "camera")]
    for round_ in range(rounds):
        scene = scenes[round_ % len(scenes)]
        for way in ways:
            if way.name in ("python", "camera") and round_ % 10:
                continue
            beside, exact = _time(scene.cast)
            took, ranges = _time(getattr(scene, way.name))
            way.each.append(took)
            way.ratios.append(took / beside)
            if round_ < len(scenes) and ranges is not None:
                way.off += np.abs(np.array(ranges) - np.array(exact)).ravel().tolist()
    return ways


def _time(scan: Callable[[], Result]) -> tuple[float, Result]:
    watch = Stopwatch()
    ranges = scan()
    return watch.read().wall / ROBOTS * 1e6, ranges


def main() -> None:
    """Run the benchmark, and print its table."""
    options = arguments(__doc__).parse_args()
    scenes = [Scene(seed) for seed in range(LAYOUTS)]
    measure(scenes, LAYOUTS)
    ways = measure(scenes, 80 if options.quick else 800)
    in_world = next(median(way.each) for way in ways if way.name == "world")
    rows = [
        {
            "way": way.name,
            "us a reading, p50": median(way.each),
            "p99": quantile(way.each, 0.99),
            "x cast": median(way.ratios),
            "x world": median(way.each) / in_world,
            "off, mm": quantile(way.off, 0.99) * 1e3 if way.off else None,
            "aim": f"{AIM:.0f} us: {'met' if median(way.each) <= AIM else 'missed'}" if way.name == "world" else None,
        }
        for way in ways
    ]
    edges = f"{len(scenes[0].segments)} edges and {len(scenes[0].map.discs)} circles, {ROBOTS} robots"
    show("One scan of 181 beams in the courtyard, and other sensors beside it", rows, [edges], as_json=options.json)
    for scene in scenes:
        scene.engine.close()
        scene.cameras.close()


if __name__ == "__main__":
    main()
