"""The field as a camera sees it: where the camera is, and where on the field a tag is that lies flat on a robot.

The map's frame has x and y on the floor, m, and z up. A tag's own frame begins in its middle: +x is where the upper
edge of the printed tag is, and +y is to its left.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg.geometry import compose, inverse
from vrg.types import Pose
from vrg_locate.camera import cv2
from vrg_locate.camera.lens import Lens

Floats = npt.NDArray[np.float64]

LEAST_POINTS: Final = 4
"""The number of points on the floor that say where the camera is."""
_FLAT: Final = 0.02
"""Points whose spread across their line is a smaller share of that along it count as being on one line."""
_STEP: Final = 0.5
"""The way to either side in pixels by which it is measured how the field changes with them."""
_SQUARE: Final = np.array([[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]])
"""The corners of a tag of 1 m in its own frame, in the order of `Tag.corners`."""


class Place(Struct, frozen=True):
    """The place of a camera.

    Args:
        rotation: its axes in the map's frame, a row each: right, down and ahead, shape (3, 3).
        position: in the map's frame, m, shape (3,).
    """

    rotation: Floats
    position: Floats


class Located(Struct, frozen=True):
    """A tag on the field.

    Args:
        pose: in the map's frame.
        position: the standard deviation of its x and y in the direction in which it is greatest, m.
        heading: that of its heading, rad.
        side: the length of its sides as they appear at the height where it is said to be, m.
    """

    pose: Pose
    position: float
    heading: float
    side: float


class FieldView(Struct, frozen=True):
    """The view of the field of a camera at a known place.

    Args:
        lens: its lens. place: where it is. shift: how well that is known, as a common error of all pixels, pixels.
    """

    lens: Lens
    place: Place
    shift: float = 0.0

    def project(self, points: Floats) -> Floats:
        """The pixels where points of the map's frame are seen, m, shape (n, 3) to shape (n, 2).

        Points that are not in front of the camera are NaN.
        """
        local = (np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.place.position) @ self.place.rotation.T
        found = np.full((len(local), 2), np.nan)
        ahead = local[:, 2] > 1e-6
        found[ahead] = self.lens.pixels(local[ahead])
        return found

    def unproject(self, pixels: Floats, height: float) -> Floats:
        """The points of the map's frame at a height above the floor that pixels show, m, shape (n, 2).

        Pixels that look above the horizon, or at something higher than the camera, are NaN.
        """
        rays = self.lens.rays(np.asarray(pixels, dtype=np.float64).reshape(-1, 2))
        ways = np.column_stack([rays, np.ones(len(rays))]) @ self.place.rotation
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (height - self.place.position[2]) / ways[:, 2]
        far = np.where(np.isfinite(far) & (far > 0.0), far, np.nan)
        return np.asarray(self.place.position[:2] + far[:, None] * ways[:, :2], dtype=np.float64)

    def locate(self, corners: Floats, height: float, noise: float) -> Located | None:
        """The place of a tag that lies flat; None if its pixels show no place at this height.

        Args:
            corners: those of the tag, pixels, shape (4, 2). height: of the tag above the floor, m.
            noise: the standard deviation of each coordinate of a corner, pixels.
        """
        steps = _STEP * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
        found = self.unproject((corners[:, None] + steps).reshape(-1, 2), height).reshape(4, 5, 2)
        if not np.isfinite(found).all():
            return None
        points = found[:, 0]
        changes = np.stack([found[:, 1] - found[:, 2], found[:, 3] - found[:, 4]], axis=-1) / (2.0 * _STEP)
        middle = points.mean(axis=0)
        arms = points - middle
        side = float(np.hypot(*(points - np.roll(points, -1, axis=0)).T).mean())
        if not side > 0.0:
            return None
        # The rotation that turns the square into the corners best, by least squares.
        along = float((_SQUARE * arms).sum())
        across = float((_SQUARE[:, 0] * arms[:, 1] - _SQUARE[:, 1] * arms[:, 0]).sum())
        heading = math.atan2(across, along)
        # The corners err independently of each other, and all together with the place of the camera.
        own = np.einsum("nij,nkj->ik", changes, changes) * (noise / len(points)) ** 2
        common = changes.mean(axis=0) * self.shift
        greatest = float(np.linalg.eigvalsh(own + common @ common.T)[-1])
        turned = np.column_stack([-arms[:, 1], arms[:, 0]])
        slopes = np.einsum("ni,nij->nj", turned, changes) / (arms**2).sum()
        spread = noise * float(np.sqrt((slopes**2).sum()))
        return Located(Pose(float(middle[0]), float(middle[1]), heading), math.sqrt(greatest), spread, side)


def robot_at(tag: Located, offset: Pose) -> Located:
    """The pose of the robot whose tag has been located.

    Args:
        offset: the pose of the tag on the robot, in the robot's frame.
    """
    lever = math.hypot(offset.x, offset.y) * tag.heading
    pose = compose(tag.pose, inverse(offset))
    return Located(pose, math.hypot(tag.position, lever), tag.heading, tag.side)


class FittedPlace(Struct, frozen=True):
    """The place of a camera by points on the floor.

    Args:
        place: where it is. errors: how far each point is from where it should be seen then, pixels, shape (n,).
    """

    place: Place
    errors: Floats

    @property
    def rms(self) -> float:
        """The root of the mean squared error, pixels, as it would be of points that the place was not fitted to."""
        # Each point tells two numbers, and a place has six.
        return float(np.sqrt((self.errors**2).sum() / (len(self.errors) - 3)))


def fitted(lens: Lens, points: Sequence[tuple[float, float]], pixels: Floats) -> FittedPlace:
    """Find out where a camera is.

    Args:
        points: places on the floor in the map's frame, m. pixels: where each is seen, shape (n, 2).

    Raises:
        ValueError: there are too few points, or they are on one line, or no camera can see them so.
    """
    if len(points) < LEAST_POINTS or len(points) != len(pixels):
        raise ValueError(f"expected at least {LEAST_POINTS} points on the floor, got {len(points)}")
    floor = np.array([(x, y, 0.0) for x, y in points])
    for seen in (floor[:, :2], pixels):
        along, across = np.linalg.svd(seen - seen.mean(axis=0), compute_uv=False)
        if across <= _FLAT * along:
            raise ValueError("expected points that are not all on one line, nor in one place")
    rays = lens.rays(pixels)
    best = None
    above = _from_above(floor, rays)
    # Two poses see points of a plane alike; the right one is above the floor, and has the smaller error. For a camera
    # that looks straight down, OpenCV finds neither of them in most places, so the search also starts there: see
    # findings/opencv-ippe-straight-above.sh.
    count, turns, ways, _ = cv2.solvePnPGeneric(floor, rays, np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE)
    starts = [*zip(turns[:count], ways[:count], strict=True), *([] if above is None else [above])]
    for rough in starts:
        turn, way = cv2.solvePnPRefineLM(floor, rays, np.eye(3), np.zeros(5), *rough)
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        place = Place(rotation, -rotation.T @ np.asarray(way, dtype=np.float64).ravel())
        found = FieldView(lens, place).project(floor)
        one = FittedPlace(place, np.hypot(*(found - pixels).T))
        if place.position[2] > 0.0 and np.isfinite(one.errors).all() and (best is None or one.rms < best.rms):
            best = one
    if best is None or above is None:
        raise ValueError(
            "no camera above the floor can see these points so: is one of them typed wrong, or are x and y swapped?"
        )
    return best


def _from_above(floor: Floats, rays: Floats) -> tuple[Floats, Floats] | None:
    """The pose of a camera that looks straight down and sees points of the floor most nearly so: OpenCV's two vectors.

    None if they are seen the wrong way round: what goes to the left there goes to the right where y is down.
    """
    linear, *_ = np.linalg.lstsq(np.column_stack((floor[:, :2], np.ones(len(floor)))), rays, rcond=None)
    if not np.linalg.det(linear[:2]) < 0.0:
        return None
    # Seen from straight above, the floor is turned, and as much smaller as it is far away.
    left, sizes, right = np.linalg.svd(linear[:2].T)
    rotation = np.zeros((3, 3))
    rotation[:2, :2], rotation[2, 2] = left @ right, -1.0
    far = 1.0 / sizes.mean()
    turn, _ = cv2.Rodrigues(rotation)
    return np.asarray(turn, dtype=np.float64), far * np.array([[linear[2, 0]], [linear[2, 1]], [1.0]])
