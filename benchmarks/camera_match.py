"""Mixed matches whose physical robots only a camera's pictures locate: how far off they are, and what it does to calls.

In one process, with CAN frames to emulated drives whose wheels are not as VRG believes. At each picture the truth is
drawn with a tag on each of these robots, distorted, blurred and noisy; the tags are found by the detector, and fixes go
the way of any other. `off` is the distance of the referee's pose of a robot to the truth, at the pictures. A call that
is doubtful is one whose number is nearer to its limit than it is known, as `vrg run why` tells; a call is wrong if its
number would be on the other side of the limit by the truth.
"""

import math
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, quantile, show

sys.path.sort(key=lambda folder: folder == str(Path(__file__).resolve().parent))  # there is a can.py there, too
sys.path.insert(0, str(Path(__file__).parents[1]))

from camera.scenes import looking, tags_on_field

from vrg.bus.messages import Fix
from vrg.bus.node import TIME_TOLERANCE, due_index
from vrg.config.loading import load_match
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.geometry import outline_distance
from vrg.launch.nodes.referee import open_journal
from vrg.localisation import sim
from vrg.localisation.sim import SimSettings
from vrg.playing.in_process import play
from vrg.runs.run_folder import RunFolder
from vrg.types import Pose
from vrg_locate.camera.detection import TagDetector
from vrg_locate.camera.field import FieldView, robot_at
from vrg_locate.camera.lens import Lens

SIDE, HEIGHT = 0.4, 0.3
"""m: of the tags, and above the floor. The robots are 0.6 m long."""
LENS = Lens(
    np.array([[1600.0, 0.0, 962.0], [0.0, 1600.0, 538.0], [0.0, 0.0, 1.0]]),
    np.array([-0.2, 0.05, 0.0004, -0.0003, 0.0]),
    (1920, 1080),
)
VIEW = FieldView(LENS, looking((0.0, 0.0, 16.5)), 0.0)
NOISE = 0.2
"""The standard deviation of a corner, pixels."""
LEAST = 0.005, math.radians(0.5)
"""The smallest standard deviations of a fix, m and rad, as in the source `camera`."""
PHYSICAL = {"ann": "way = 0.02\nbend = 2.0", "bob": "way = -0.02\nturn = 0.02"}
MATCH = """
name = "pictures"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = {seed}
lasers = false
[rules]
x = [-3.0, 3.0]
y = [-5.0, 5.0]
zone_depth = 1.5
passes = 1
[backends.can]
interface = "virtual"
channel = "pictures"
emulate = true
[backends.can.robots.ann]
left = [0]
right = [1]
ratio = 50.0
[backends.can.robots.bob]
left = [2]
right = [3]
ratio = 50.0
[localisation.overhead]
source = "sim"
rate = 15.0
delay = 0.1
jitter = 0.0
"""
PLAYERS = {
    "shark": (0.0, -4.3, 90.0),
    "ann": (-2.2, 4.3, -90.0),
    "bob": (-0.7, 4.3, -90.0),
    "cid": (0.7, 4.3, -90.0),
    "dan": (2.2, 4.3, -90.0),
}


class Pictures:
    """Takes pictures of robots and finds them there, in place of `SimulatedFixes`.

    Attributes:
        made: the one that was made last. truth: where each robot was, with the match times, s.
    """

    made: "Pictures"

    def __init__(self, settings: SimSettings, rng: np.random.Generator) -> None:
        self._settings, self._rng, self._due = settings, rng, -1
        self._detector = TagDetector()
        self._coming: list[tuple[float, float, tuple[Fix, ...]]] = []
        self.truth: dict[str, list[tuple[float, Pose]]] = {}
        self.tags = self.found = 0
        Pictures.made = self

    def capture(self, time: float, poses: Mapping[str, Pose]) -> None:
        """Take a picture, if one is due, and find the robots in it."""
        due = due_index(time, 1.0 / self._settings.rate)
        if due == self._due or not poses:
            return
        self._due, names = due, sorted(poses)
        for name in names:
            self.truth.setdefault(name, []).append((time, poses[name]))
        tags = [(number, poses[name], HEIGHT) for number, name in enumerate(names)]
        fixes = []
        for tag in self._detector.detect(tags_on_field(VIEW, tags, SIDE, self._rng)):
            located = VIEW.locate(tag.corners, HEIGHT, NOISE) if tag.number < len(names) else None
            if located is not None:
                robot = robot_at(located, Pose(0.0, 0.0, 0.0))
                deviations = max(robot.position, LEAST[0]), max(robot.heading, LEAST[1])
                fixes.append(Fix(names[tag.number], robot.pose, *deviations))
        self.tags += len(names)
        self.found += len(fixes)
        self._coming.append((time + self._settings.delay, time, tuple(fixes)))

    def arrived(self, now: float) -> list[tuple[float, tuple[Fix, ...]]]:
        """The fixes that have arrived by now."""
        found = [(time, fixes) for at, time, fixes in self._coming if at <= now + TIME_TOLERANCE]
        self._coming = [coming for coming in self._coming if coming[0] > now + TIME_TOLERANCE]
        return found

    def at(self, name: str, time: float) -> Pose:
        """Where a robot truly was."""
        return sim.pose_at(self.truth[name], time)


def match_text(seed: int) -> str:
    """The match file."""
    text = MATCH.format(seed=seed)
    text += "".join(f"[localisation.overhead.errors.{name}]\n{errors}\n" for name, errors in PHYSICAL.items())
    for name, (x, y, heading) in PLAYERS.items():
        role = "shark" if name == "shark" else "minnow"
        text += f'[[players]]\nname = "{name}"\nrole = "{role}"\nx = {x}\ny = {y}\nheading = {heading}\n'
        text += 'backend = "can"\nlocalisation = "fusion"\n' if name in PHYSICAL else ""
    return text


def played(seed: int) -> dict[str, Any]:
    """Play a match; the row of the table."""
    with tempfile.TemporaryDirectory() as home:
        file = Path(home) / "pictures.toml"
        file.write_text(match_text(seed))
        setup, folder = load_match(file), RunFolder(Path(home) / "run")
        folder.prepare()
        with open_journal(setup, folder) as journal:
            ending = play(setup, journal, limit=300.0)
        _, records = read_journal(folder.journal)
        pictures, off = Pictures.made, []
        for exhibit in read_evidence(folder.evidence):
            field = exhibit.tick.field
            for name in PHYSICAL:
                if name in field.poses and field.time >= 1.0:
                    here, there = field.poses[name], pictures.at(name, field.time)
                    off.append(math.dist((here.x, here.y), (there.x, there.y)))
        tags = [(record.time, call) for record in records for call in record.calls if call.rule == "tag"]
        own = [(time, call) for time, call in tags if set(call.players) & set(PHYSICAL)]
        size, limit = setup.player("ann").robot.size, 0.3
        wrong = doubtful = 0
        for time, call in own:
            true = [pictures.at(n, time) if n in PHYSICAL else p for n, p in zip(call.players, call.poses, strict=True)]
            gap = min(outline_distance(true[0], other, size, size) for other in true[1:])
            wrong += gap > limit
            judged = min(outline_distance(call.poses[0], other, size, size) for other in call.poses[1:])
            known = [call.uncertainty[name].ellipse[0] for name in call.players if name in call.uncertainty]
            doubtful += abs(judged - limit) < 2.0 * math.hypot(*known)
    return {
        "seed": seed,
        "ended": str(ending.state.winner or ending.state.halted),
        "played, s": round(ending.time, 1),
        "tags found, %": round(100.0 * pictures.found / pictures.tags, 2),
        "off rms, cm": round(100.0 * math.sqrt(sum(x * x for x in off) / len(off)), 2),
        "off 95 %, cm": round(100.0 * quantile(off, 0.95), 2),
        "tag calls": len(tags),
        "with physical": len(own),
        "doubtful": doubtful,
        "wrong by the truth": wrong,
    }


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--matches", type=int, default=3, help="the number of matches, with seeds from 0 on")
    options = parser.parse_args()
    sim.SimulatedFixes = Pictures  # type: ignore[misc, assignment]
    rows = [played(seed) for seed in range(1 if options.quick else options.matches)]
    show("mixed matches by pictures of 1920 x 1080 at 15 Hz", rows, [], as_json=options.json)


if __name__ == "__main__":
    main()
