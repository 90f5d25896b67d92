"""Tags in rendered pictures: found by the real detector, and their corners measured to a fraction of a pixel."""

import math

import numpy as np
import pytest

from camera.scenes import LENS, looking, sheet_at, tag_picture, tags_on_field
from vrg.types import Pose
from vrg_locate.camera.detection import CELLS, NUMBERS, Tag, TagDetector, grey_of, tag_cells
from vrg_locate.camera.field import FieldView

ABOVE = FieldView(LENS, looking((0.2, 0.1, 2.6)))
ASLANT = FieldView(LENS, looking((0.3, -1.8, 2.4)))
SIZE = 0.15


def laid(count: int, rng: np.random.Generator) -> list[tuple[int, Pose, float]]:
    """Tags in rows, each turned and moved at random, at two heights."""
    numbers = rng.choice(NUMBERS, count, replace=False).tolist()
    places = [(0.6 * (i % 4 - 1.5), 0.5 * (i // 4 - 1)) for i in range(count)]
    return [
        (
            number,
            Pose(x + rng.uniform(-0.1, 0.1), y + rng.uniform(-0.1, 0.1), rng.uniform(-3.1, 3.1)),
            0.1 + 0.2 * (i % 2),
        )
        for i, (number, (x, y)) in enumerate(zip(numbers, places, strict=True))
    ]


@pytest.mark.parametrize("view", [ABOVE, ASLANT], ids=["from above", "aslant"])
@pytest.mark.parametrize(("blur", "noise", "most"), [(0.5, 2.0, 0.12), (1.3, 8.0, 0.35)], ids=["good", "poor"])
def test_every_tag_is_found_and_its_corners_are_measured(
    view: FieldView, blur: float, noise: float, most: float
) -> None:
    rng = np.random.default_rng(3)
    tags = laid(12, rng)
    found = TagDetector().detect(tags_on_field(view, tags, SIZE, rng, blur=blur, noise=noise))
    assert [tag.number for tag in found] == sorted(number for number, _, _ in tags)
    seen = {tag.number: tag for tag in found}
    errors = []
    for number, pose, height in tags:
        errors.append(seen[number].corners - view.project(sheet_at(pose, height, (SIZE, SIZE))))
    assert math.sqrt(np.mean(np.square(errors))) < most, "pixels, for each coordinate"
    assert abs(float(np.mean(errors))) < 0.05, "no side is preferred"


def test_a_tag_that_is_half_covered_is_not_found_and_disturbs_no_other() -> None:
    rng = np.random.default_rng(4)
    tags = [(7, Pose(-0.5, 0.0, 0.3), 0.2), (9, Pose(0.4, 0.2, 1.0), 0.2)]
    picture = tags_on_field(ABOVE, tags, SIZE, rng)
    corners = ABOVE.project(sheet_at(tags[1][1], 0.2, (SIZE, SIZE)))
    (left, upper), (right, lower) = corners.min(axis=0).astype(int), corners.max(axis=0).astype(int)
    picture[upper:lower, (left + right) // 2 : right + 10] = 90
    assert [tag.number for tag in TagDetector().detect(picture)] == [7]


def test_a_tag_with_a_covered_corner_keeps_the_corners_that_it_has() -> None:
    """A hand over a corner must not pull the lines away: what moves too far is not moved at all."""
    rng = np.random.default_rng(5)
    picture = tags_on_field(ABOVE, [(7, Pose(0.0, 0.0, 0.0), 0.2)], SIZE, rng)
    corners = ABOVE.project(sheet_at(Pose(0.0, 0.0, 0.0), 0.2, (SIZE, SIZE)))
    u, v = corners[0].astype(int)
    picture[v - 4 : v + 3, u - 4 : u + 3] = 200
    for tag in TagDetector().detect(picture):
        assert np.abs(tag.corners - corners).max() < 4.0


def test_a_tag_that_is_there_twice_is_told_twice() -> None:
    rng = np.random.default_rng(6)
    picture = tags_on_field(ABOVE, [(7, Pose(x, 0.0, 0.0), 0.0) for x in (-0.5, 0.5)], SIZE, rng)
    assert [tag.number for tag in TagDetector().detect(picture)] == [7, 7]


def test_noise_alone_shows_no_tag() -> None:
    rng = np.random.default_rng(7)
    for _ in range(3):
        assert TagDetector().detect(rng.integers(0, 256, (480, 640), dtype=np.uint8)) == []
    assert TagDetector().detect(np.zeros((480, 640), dtype=np.uint8)) == []


@pytest.mark.parametrize("picture", [np.zeros((8, 8, 3), np.uint8), np.zeros((8, 8), np.float64)])
def test_what_is_no_grey_picture_is_refused(picture: np.ndarray) -> None:
    with pytest.raises(ValueError, match="expected a grey picture of bytes"):
        TagDetector().detect(picture)


def test_the_printed_tag_is_the_one_that_is_found_upright() -> None:
    picture = np.pad(tag_picture(42, 10), 50, constant_values=200)
    (tag,) = TagDetector().detect(picture)
    side = 10 * CELLS
    assert tag.number == 42
    expected = np.array([(0, 0), (side, 0), (side, side), (0, side)]) + 60 - 0.5
    assert tag.corners == pytest.approx(expected, abs=0.1)
    assert tag.centre == pytest.approx((60 + side / 2 - 0.5,) * 2, abs=0.1)
    assert tag.side == pytest.approx(side, abs=0.1)
    cells = tag_cells(42)
    assert cells.shape == (CELLS, CELLS)
    assert cells[0].all()
    assert cells[:, -1].all()


def test_the_middle_of_a_tag_is_where_its_diagonals_meet() -> None:
    tag = Tag(0, np.array([(0.0, 0.0), (4.0, 0.0), (3.0, 2.0), (1.0, 2.0)]))
    assert tag.centre == pytest.approx((2.0, 4.0 / 3.0))


@pytest.mark.parametrize("number", [-1, NUMBERS])
def test_a_tag_that_is_not_in_the_family_is_refused(number: int) -> None:
    with pytest.raises(ValueError, match="from 0 to 586"):
        tag_cells(number)


def test_colours_become_grey() -> None:
    assert grey_of(np.full((4, 6, 3), 90, np.uint8)).tolist() == np.full((4, 6), 90).tolist()
    assert grey_of(np.full((4, 6), 90, np.uint8)).shape == (4, 6)
