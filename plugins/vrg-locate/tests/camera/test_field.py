"""The map between pixels and the field: its inverse, the place of the camera, and where tags are and how well known."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camera.scenes import LENS, SIZE, looking, sheet_at, tags_on_field
from vrg.geometry import compose, wrap
from vrg.types import Pose
from vrg_locate.camera.detection import TagDetector
from vrg_locate.camera.field import FieldView, Located, Place, fitted, robot_at

ABOVE = FieldView(LENS, looking((0.0, 0.0, 3.0)))
ASLANT = FieldView(LENS, looking((0.2, -2.0, 2.5), (0.2, 0.3, 0.0)))
CORNERS = [(-1.2, -0.6), (1.2, -0.6), (1.2, 0.9), (-1.2, 0.9)]

coordinate = st.floats(-1.5, 1.5)


@given(
    x=coordinate, y=coordinate, height=st.floats(0.0, 0.5), eye=st.tuples(coordinate, coordinate, st.floats(2.0, 5.0))
)
def test_what_is_projected_is_unprojected_to_where_it_was(
    x: float, y: float, height: float, eye: tuple[float, float, float]
) -> None:
    view = FieldView(LENS, looking(eye))
    pixels = view.project(np.array([(x, y, height)]))
    assume(np.isfinite(pixels).all() and (pixels > -50).all() and (pixels < np.array(SIZE) + 50).all())
    assert view.unproject(pixels, height) == pytest.approx(np.array([(x, y)]), abs=1e-5)


def test_pixels_above_the_horizon_show_no_place_on_the_floor() -> None:
    level = FieldView(LENS, looking((0.0, -3.0, 1.0), (0.0, 0.0, 1.0)))
    found = level.unproject(np.array([(640.0, 100.0), (640.0, 700.0)]), 0.0)
    assert np.isnan(found[0]).all()
    assert np.isfinite(found[1]).all()
    assert np.isnan(level.project(np.array([(0.0, -4.0, 0.0)]))).all(), "behind the camera"
    assert level.locate(np.array([(600.0, 90.0), (680.0, 90.0), (680.0, 170.0), (600.0, 170.0)]), 0.0, 0.1) is None
    assert ABOVE.locate(np.full((4, 2), 300.0), 0.0, 0.1) is None, "a tag without a size"


@pytest.mark.parametrize("view", [ABOVE, ASLANT], ids=["from above", "aslant"])
def test_tags_in_a_picture_are_located_within_what_is_told_of_their_error(view: FieldView) -> None:
    rng = np.random.default_rng(8)
    poses = [Pose(0.55 * (i % 4 - 1.5), 0.45 * (i // 4 - 1), rng.uniform(-3.1, 3.1)) for i in range(12)]
    tags = [(i, pose, 0.25) for i, pose in enumerate(poses)]
    found = TagDetector().detect(tags_on_field(view, tags, 0.12, rng))
    assert len(found) == 12
    for tag in found:
        located, truth = view.locate(tag.corners, 0.25, 0.2), poses[tag.number]
        assert located is not None
        assert located.side == pytest.approx(0.12, rel=0.02)
        off = math.hypot(located.pose.x - truth.x, located.pose.y - truth.y)
        turned = abs(wrap(located.pose.theta - truth.theta))
        assert off < min(0.002, 4.0 * located.position)
        assert turned < min(math.radians(0.7), 4.0 * located.heading)


@pytest.mark.parametrize("pose", [Pose(0.3, 0.1, 0.4), pytest.param(Pose(-0.9, 0.5, -2.0), marks=pytest.mark.thorough)])
def test_the_deviations_are_those_that_noise_makes(pose: Pose) -> None:
    rng = np.random.default_rng(9)
    corners, noise = ASLANT.project(sheet_at(pose, 0.2, (0.15, 0.15))), 0.3
    found = [ASLANT.locate(corners + rng.normal(0.0, noise, (4, 2)), 0.2, noise) for _ in range(600)]
    errors = np.array([(f.pose.x - pose.x, f.pose.y - pose.y, wrap(f.pose.theta - pose.theta)) for f in found if f])
    greatest = math.sqrt(np.linalg.eigvalsh(np.cov(errors[:, :2].T))[-1])
    told = found[0]
    assert told is not None
    assert told.position == pytest.approx(greatest, rel=0.15)
    assert told.heading == pytest.approx(errors[:, 2].std(), rel=0.15)
    shifted = FieldView(LENS, ASLANT.place, shift=2.0).locate(corners, 0.2, noise)
    assert shifted is not None
    assert shifted.position > 4.0 * told.position, "a camera whose place is not known well"
    assert shifted.heading == pytest.approx(told.heading, rel=0.2)


@given(x=coordinate, y=coordinate, theta=st.floats(-3.1, 3.1), ahead=st.floats(-0.3, 0.3), turn=st.floats(-3.1, 3.1))
def test_a_robot_is_where_its_tag_is_less_the_offset(
    x: float, y: float, theta: float, ahead: float, turn: float
) -> None:
    robot, offset = Pose(x, y, theta), Pose(ahead, 0.1, turn)
    found = robot_at(Located(compose(robot, offset), 0.003, 0.02, 0.15), offset)
    assert (found.pose.x, found.pose.y) == pytest.approx((x, y))
    assert wrap(found.pose.theta - theta) == pytest.approx(0.0, abs=1e-9)
    assert found.position == pytest.approx(math.hypot(0.003, 0.02 * math.hypot(ahead, 0.1)))


@pytest.mark.parametrize("view", [ABOVE, ASLANT], ids=["from above", "aslant"])
def test_the_place_of_a_camera_follows_from_points_on_the_floor(view: FieldView) -> None:
    rng = np.random.default_rng(10)
    points = [*CORNERS, (0.0, 0.0)]
    exact = view.project(np.array([(x, y, 0.0) for x, y in points]))
    found = fitted(LENS, points, exact)
    assert found.place.position == pytest.approx(view.place.position, abs=1e-4)
    assert found.place.rotation == pytest.approx(view.place.rotation, abs=1e-4)
    assert found.rms < 0.01
    rough = fitted(LENS, points, exact + rng.normal(0.0, 0.5, exact.shape))
    assert rough.place.position == pytest.approx(view.place.position, abs=0.05)
    assert 0.05 < rough.rms < 1.5


def straight_down(position: tuple[float, float, float], turn: float, tilt: float) -> FieldView:
    """A camera above a place, turned about the vertical and tilted, both in rad."""
    cos, sin = math.cos(turn), math.sin(turn)
    right, level = np.array([cos, sin, 0.0]), np.array([sin, -cos, 0.0])
    ahead = math.sin(tilt) * level + np.array([0.0, 0.0, -math.cos(tilt)])
    return FieldView(LENS, Place(np.array([right, np.cross(ahead, right), ahead]), np.array(position)))


@pytest.mark.parametrize("tilt", [0.0, 1e-6, 1e-3, 0.02, 0.2])
@pytest.mark.parametrize("height", [1.5, 2.0, 3.0, 4.0])
def test_the_place_of_a_camera_that_looks_straight_down_follows_from_four_exact_corners(
    height: float, tilt: float
) -> None:
    """Of such a camera the usual method finds no place, or a wrong one, in one case of ten."""
    tried, wrong = 0, []
    for turn in (0.0, 0.3, math.pi / 2, 2.0, math.pi):
        for length, width, x, y in (
            (1, 1, 0, 0),
            (2.4, 1.5, 0, 0),
            (1, 0.5, 0.2, 0.1),
            (2, 2, 1, 1),
            (1.2, 0.9, 0, 0.15),
        ):
            corners = [(x + i * length / 2, y + j * width / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            for eye in ((0.0, 0.0), (0.1, 0.0), (0.3, -0.2), (x, y)):
                view = straight_down((*eye, height), turn, tilt)
                pixels = view.project(np.array([(*corner, 0.0) for corner in corners]))
                if (pixels < 0).any() or (pixels > np.array(SIZE)).any():
                    continue
                tried += 1
                found = fitted(LENS, corners, pixels)
                if found.rms > 0.01 or np.abs(found.place.position - view.place.position).max() > 1e-3:
                    wrong.append((turn, length, width, eye, found))
    assert tried > 5
    assert not wrong


def test_a_point_that_is_typed_wrong_has_a_large_error() -> None:
    points = [*CORNERS, (0.0, 0.0), (0.5, 0.5)]
    pixels = ABOVE.project(np.array([(x, y, 0.0) for x, y in points]))
    pixels[4] += 60.0
    found = fitted(LENS, points, pixels)
    assert found.rms > 10.0
    assert int(found.errors.argmax()) == 4


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (CORNERS[:3], "at least 4 points on the floor, got 3"),
        ([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.2, 0.0)], "not all on one line"),
        ([(0.3, 0.3)] * 4, "nor in one place"),
    ],
)
def test_points_that_say_nothing_are_refused(points: list[tuple[float, float]], words: str) -> None:
    pixels = ABOVE.project(np.array([(x, y, 0.0) for x, y in points]))
    with pytest.raises(ValueError, match=words):
        fitted(LENS, points, pixels)


def test_mirrored_points_have_no_camera() -> None:
    """As if the corners were named the wrong way round: such a camera would look up from below the floor."""
    pixels = ABOVE.project(np.array([(-x, y, 0.0) for x, y in CORNERS]))
    with pytest.raises(ValueError, match="no camera above the floor"):
        fitted(LENS, CORNERS, pixels)
