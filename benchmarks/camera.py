"""How well a camera above the field locates robots: PyBullet renders robots that drive about with tags on them.

The camera hangs above a field of 4 x 2.2 m, which its picture just holds. PyBullet's TinyRenderer renders its pictures
at twice their size. Then they get what a lens and a sensor add: distortion, blur (a Gaussian of 0.7 pixels), noise (3
of 256 steps), and in some cases the motion of the robots while the shutter is open. The place of the camera is measured
by six tags on the floor, as `vrg locate calibrate field` does, and the lens is taken as known. `ms` is the time to find
the tags in a picture and to locate them, on one picture after the other.
"""

import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pybullet
from common import Stopwatch, arguments, median, quantile, show

sys.path.insert(0, str(Path(__file__).parents[1]))

from camera.scenes import tag_picture

from vrg.geometry import wrap
from vrg.hal.sim.config import RobotSetup, WorldConfig
from vrg.hal.sim.world import World
from vrg.types import Pose, Twist
from vrg_locate.camera import cv2
from vrg_locate.camera.detection import CELLS, TagDetector
from vrg_locate.camera.field import FieldView, Place, fitted
from vrg_locate.camera.lens import Lens
from vrg_locate.camera.source import NOISE

FIELD = (4.0, 2.2)
EYE = np.array([0.15, -0.25, 3.3])
"""m; where the camera is. It looks at the middle of the field."""
HEIGHT = 0.25
"""m of the robots' tags above the floor."""
BODY = (0.36, 0.3, 0.24)
FLOOR = ((-1.8, -0.9), (0.0, -0.95), (1.8, -0.9), (1.8, 0.9), (0.0, 0.95), (-1.8, 0.9))
"""m; where the tags on the floor are. Their numbers follow those of the robots."""
BLUR, STEPS = 0.7, 3.0
SUPER = 2
"""The pixels rendered along one of the camera's."""
WIDER = 1.2
"""By how much the rendered picture is larger than the camera's, as its lens draws its corners inwards."""
SIZES = ((1280, 720), (1920, 1080))
Pixels = npt.NDArray[np.uint8]


def lens_of(size: tuple[int, int]) -> Lens:
    """The lens of a webcam that sees 72 degrees across."""
    focal = size[0] / 2 / math.tan(math.radians(36.0))
    matrix = np.array([[focal, 0.0, size[0] / 2 + 3.0], [0.0, focal, size[1] / 2 - 5.0], [0.0, 0.0, 1.0]])
    return Lens(matrix, np.array([-0.08, 0.02, 0.0004, -0.0003, 0.0]), size)


class Studio:
    """A floor, robots and tags, in a client of PyBullet of its own."""

    def __init__(self, folder: Path, robots: int, side: float) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._plates = [self._plate(folder, number, side) for number in range(robots + len(FLOOR))]
        box = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=[d / 2 for d in BODY],
            rgbaColor=(0.6, 0.1, 0.1, 1.0),
            physicsClientId=self._client,
        )
        self._bodies = [pybullet.createMultiBody(0, -1, box, physicsClientId=self._client) for _ in range(robots)]
        ground = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=(4.0, 3.0, 0.01),
            rgbaColor=(0.45, 0.45, 0.42, 1.0),
            physicsClientId=self._client,
        )
        pybullet.createMultiBody(0, -1, ground, (0.0, 0.0, -0.012), physicsClientId=self._client)
        for number, (x, y) in enumerate(FLOOR):
            self._put(self._plates[robots + number], Pose(x, y, 0.3 * number), 0.0)

    def _plate(self, folder: Path, number: int, side: float) -> int:
        half = side * (CELLS + 2) / CELLS / 2
        file = folder / f"{number}.png"
        cv2.imwrite(str(file), cv2.cvtColor(tag_picture(number, 32), cv2.COLOR_GRAY2BGR))
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=[(half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0), (-half, half, 0.0)],
            indices=[0, 2, 1, 0, 3, 2],
            uvs=[(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)],
            normals=[(0.0, 0.0, 1.0)] * 4,
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(0, -1, shape, physicsClientId=self._client)
        texture = pybullet.loadTexture(str(file), physicsClientId=self._client)
        pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=self._client)
        return body

    def _put(self, body: int, pose: Pose, height: float) -> None:
        turn = pybullet.getQuaternionFromEuler((0.0, 0.0, pose.theta))
        pybullet.resetBasePositionAndOrientation(body, (pose.x, pose.y, height), turn, physicsClientId=self._client)

    def place(self, poses: list[Pose]) -> None:
        """Put the robots, and the tags on them, where they are now."""
        for number, pose in enumerate(poses):
            self._put(self._bodies[number], pose, BODY[2] / 2)
            self._put(self._plates[number], pose, HEIGHT)

    def render(self, lens: Lens, place: Place) -> npt.NDArray[np.float32]:
        """What the lens draws, in grey, before sensor and shutter have spoilt it: shape (rows, columns)."""
        columns, rows = (round(SUPER * WIDER * length) for length in lens.size)
        focal = SUPER * lens.matrix[0, 0]
        near = 0.1
        right, upper = near * columns / 2 / focal, near * rows / 2 / focal
        _, _, rgba, _, _ = pybullet.getCameraImage(
            columns,
            rows,
            pybullet.computeViewMatrix(place.position, place.position + place.rotation[2], -place.rotation[1]),
            pybullet.computeProjectionMatrix(-right, right, -upper, upper, near, 20.0),
            lightDirection=(1.0, 2.0, 6.0),
            shadow=0,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        grey = cv2.cvtColor(np.asarray(rgba, np.uint8).reshape(rows, columns, 4), cv2.COLOR_RGBA2GRAY)
        soft = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), SUPER * 0.5)
        u, v = np.meshgrid(np.arange(lens.size[0]), np.arange(lens.size[1]))
        rays = lens.rays(np.column_stack([u.ravel(), v.ravel()]).astype(np.float64))
        at = (rays * focal + (columns / 2 - 0.5, rows / 2 - 0.5)).astype(np.float32).reshape(*u.shape, 2)
        return np.asarray(cv2.remap(soft, at[..., 0], at[..., 1], cv2.INTER_LINEAR), np.float32)

    def close(self) -> None:
        """End the client."""
        pybullet.disconnect(self._client)


class Driving:
    """Robots in the planar world, which wander about the field, each within its own part of it."""

    def __init__(self, robots: int, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.names = [f"r{number}" for number in range(robots)]
        across = math.ceil(robots / 2)
        self._homes = [
            (FIELD[0] * ((number % across + 0.5) / across - 0.5), FIELD[1] * (0.22 if number // across else -0.22))
            for number in range(robots)
        ]
        self._radii = [0.2 + 0.02 * (number % 6) for number in range(robots)]
        setups = tuple(
            RobotSetup(name=name, model="P2AT", pose=self._start(10 * x, 10 * y, radius))
            for name, (x, y), radius in zip(self.names, self._homes, self._radii, strict=True)
        )
        self._twists: dict[str, Twist] = {}
        # They are ten times as far apart there, so that none meets another.
        self._world = World(WorldConfig(map="open", engine="planar", seed=seed, lasers=False, robots=setups))

    def _start(self, x: float, y: float, radius: float) -> Pose:
        """A pose from which a robot that turns to the left drives around a point, m."""
        heading = self._rng.uniform(-3.0, 3.0)
        return Pose(x + radius * math.sin(heading), y - radius * math.cos(heading), heading)

    def poses(self) -> list[Pose]:
        """Where they are on the field."""
        found = []
        for name, (x, y) in zip(self.names, self._homes, strict=True):
            pose = self._world.pose(name)
            found.append(Pose(pose.x - 9 * x, pose.y - 9 * y, pose.theta))
        return found

    def go(self, ticks: int) -> None:
        """Drive on in circles, at 0.3 to 0.7 m/s."""
        for name, radius in zip(self.names, self._radii, strict=True):
            speed = self._rng.uniform(0.3, 0.7)
            self._twists[name] = Twist(speed, speed / radius)
        for _ in range(ticks):
            for name in self.names:
                self._world.drive(name, self._twists[name], armed=True)
            self._world.step()

    def close(self) -> None:
        """End the world."""
        self._world.close()


def trial(
    size: tuple[int, int], side: float, shutter: float, pictures: int, robots: int, seed: int = 1
) -> dict[str, Any]:
    """One row of the table: pictures of one size, with tags of one size and one shutter time, s."""
    lens, rng = lens_of(size), np.random.default_rng(seed)
    ahead = -EYE / np.linalg.norm(EYE)
    right = np.cross(ahead, (0.03, 1.0, 0.0))
    right /= np.linalg.norm(right)
    place = Place(np.array([right, np.cross(ahead, right), ahead]), EYE)
    detector, driving = TagDetector(), Driving(robots, seed)
    view: FieldView | None = None
    errors, turns, told, times, wide, there, found = [], [], [], [], [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(Path(folder), robots, side)
        try:
            for _ in range(pictures):
                driving.go(17)
                before, now = _shutter(driving, shutter)
                shades = []
                for share in np.linspace(0.0, 1.0, 3 if shutter else 1):
                    studio.place([_between(a, b, share) for a, b in zip(before, now, strict=True)])
                    shades.append(studio.render(lens, place))
                truths = [_between(a, b, 0.5 if shutter else 0.0) for a, b in zip(before, now, strict=True)]
                shade = cv2.GaussianBlur(np.mean(shades, axis=0), (0, 0), BLUR)
                grey = np.clip(shade + rng.normal(0.0, STEPS, shade.shape), 0, 255).astype(np.uint8)
                if view is None:
                    view = _calibrated(lens, grey, robots)
                watch = Stopwatch()
                seen = {tag.number: tag for tag in detector.detect(grey)}
                located = {n: view.locate(tag.corners, HEIGHT, NOISE) for n, tag in seen.items() if n < robots}
                times.append(1000 * watch.read().wall)
                there += sum(_is_seen(FieldView(lens, place), truth, side) for truth in truths)
                for number, one in located.items():
                    if one is None or not _is_seen(FieldView(lens, place), truths[number], side):
                        continue
                    found += 1
                    truth = truths[number]
                    errors.append(1000 * math.hypot(one.pose.x - truth.x, one.pose.y - truth.y))
                    turns.append(math.degrees(abs(wrap(one.pose.theta - truth.theta))))
                    told.append(1000 * one.position)
                    wide.append(seen[number].side)
        finally:
            studio.close()
            driving.close()
    return {
        "picture": f"{size[0]} x {size[1]}",
        "tag, cm": 100 * side,
        "pixels": round(median(wide)),
        "shutter, ms": 1000 * shutter,
        "found, %": round(100 * found / there, 1),
        "rms, mm": round(math.sqrt(float(np.mean(np.square(errors)))), 2),
        "95 %, mm": round(quantile(errors, 0.95), 2),
        "told, mm": round(median(told), 2),
        "rms, degrees": round(math.sqrt(float(np.mean(np.square(turns)))), 2),
        "95 %, degrees": round(quantile(turns, 0.95), 2),
        "ms": round(median(times), 1),
    }


def _is_seen(view: FieldView, pose: Pose, side: float) -> bool:
    """True if a robot's tag is in the picture with all of its white border."""
    reach = side * (CELLS + 2) / CELLS / math.sqrt(2.0)
    points = [(pose.x + dx, pose.y + dy, HEIGHT) for dx in (-reach, reach) for dy in (-reach, reach)]
    pixels = view.project(np.array(points))
    return bool((pixels >= 0.0).all() and (pixels < view.lens.size).all())


def _calibrated(lens: Lens, grey: Pixels, robots: int) -> FieldView:
    seen = {tag.number - robots: tag.centre for tag in TagDetector().detect(grey) if tag.number >= robots}
    numbers = sorted(seen)
    found = fitted(lens, [FLOOR[number] for number in numbers], np.array([seen[number] for number in numbers]))
    return FieldView(lens, found.place, found.rms)


def _shutter(driving: Driving, shutter: float) -> tuple[list[Pose], list[Pose]]:
    """Where the robots are when the shutter opens and when it closes; a tick of the world is 20 ms."""
    before = driving.poses()
    if not shutter:
        return before, before
    driving.go(1)
    return before, [_between(a, b, shutter / 0.02) for a, b in zip(before, driving.poses(), strict=True)]


def _between(a: Pose, b: Pose, share: float) -> Pose:
    return Pose(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.theta + share * wrap(b.theta - a.theta))


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--pictures", type=int, default=20, help="the pictures of each case")
    parser.add_argument("--robots", type=int, default=8)
    options = parser.parse_args()
    pictures = 2 if options.quick else options.pictures
    cases = [(size, side, 0.0) for size in SIZES for side in (0.08, 0.15)]
    cases += [(size, 0.15, shutter) for size in SIZES for shutter in (0.005, 0.02)]
    rows = [trial(*case, pictures, options.robots) for case in cases]
    notes = [
        f"{options.robots} robots at up to 0.7 m/s, {pictures} pictures each; told: the deviation that comes with a fix"
    ]
    show("A camera above a field of 4 x 2.2 m", rows, notes, as_json=options.json)


if __name__ == "__main__":
    main()
