"""Lenses: where points are seen and where pixels look, and what follows from pictures of a printed board."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camera.scenes import LENS, SIZE, boards_held_up
from vrg_locate.camera.lens import Board, BoardView, Lens, board_picture, calibrated, find_board

BOARD = Board()


@given(
    focal=st.floats(600, 2000),
    bulge=st.floats(-0.3, 0.1),
    tangential=st.floats(-0.002, 0.002),
    pixel=st.tuples(st.floats(0, SIZE[0]), st.floats(0, SIZE[1])),
)
def test_a_pixel_looks_where_what_is_seen_there_is(
    focal: float, bulge: float, tangential: float, pixel: tuple[float, float]
) -> None:
    matrix = np.array([[focal, 0.0, 640.0], [0.0, focal, 360.0], [0.0, 0.0, 1.0]])
    lens = Lens(matrix, np.array([bulge, 0.05, tangential, -tangential, 0.0]), SIZE)
    pixels = np.array([pixel])
    rays = lens.rays(pixels)
    assert lens.pixels(np.column_stack([3.0 * rays, [3.0]])) == pytest.approx(pixels, abs=1e-3)


def test_nothing_is_seen_of_nothing() -> None:
    assert LENS.rays(np.empty((0, 2))).shape == (0, 2)
    assert LENS.pixels(np.empty((0, 3))).shape == (0, 2)


def views_of(pictures: list[np.ndarray], board: Board = BOARD) -> list[BoardView]:
    return [view for picture in pictures if (view := find_board(picture, board)) is not None]


@pytest.fixture(scope="module")
def tilted() -> list[BoardView]:
    """What is seen of a board that is held up well."""
    return views_of(boards_held_up(BOARD, 10, np.random.default_rng(1), tilt=0.5))


def test_a_lens_is_found_from_pictures_of_a_board(tilted: list[BoardView]) -> None:
    assert_found_from(tilted)


@pytest.mark.thorough
def test_a_lens_is_found_from_pictures_of_a_chessboard() -> None:
    board = Board(8, 6, 0.028, None)
    assert_found_from(views_of(boards_held_up(board, 10, np.random.default_rng(1), tilt=0.5), board))


def assert_found_from(views: list[BoardView]) -> None:
    rng, found = np.random.default_rng(1), calibrated(views)
    assert found.error < 0.15
    assert len(found.each) == len(views)
    assert np.diag(found.lens.matrix)[:2] == pytest.approx(np.diag(LENS.matrix)[:2], rel=0.005)
    assert found.lens.matrix[:2, 2] == pytest.approx(LENS.matrix[:2, 2], abs=4.0)
    # What counts is where things are seen: within the part of the picture where the boards were.
    pixels = rng.uniform((150, 100), (1130, 620), (500, 2))
    seen = found.lens.pixels(np.column_stack([LENS.rays(pixels), np.ones(500)]))
    shift = seen - pixels
    assert np.abs(shift - shift.mean(axis=0)).max() < 0.5


def test_too_few_pictures_are_refused(tilted: list[BoardView]) -> None:
    with pytest.raises(ValueError, match="at least 8 sharp pictures that show the board, got 3"):
        calibrated(tilted[:3])


def test_blurred_pictures_are_refused_and_say_so() -> None:
    rng = np.random.default_rng(3)
    sharp, blurred = (find_board(boards_held_up(BOARD, 1, rng, 0.1, blur=blur)[0], BOARD) for blur in (0.7, 2.8))
    assert sharp is not None
    assert blurred is not None
    assert sharp.refusal is None
    assert "hold board and camera still" in (blurred.refusal or "")
    with pytest.raises(ValueError, match="sharp pictures that show the board, got 0"):
        calibrated([blurred] * 12)


@pytest.mark.thorough
def test_boards_that_are_never_tilted_say_nothing_of_the_focal_length() -> None:
    views = views_of(boards_held_up(BOARD, 9, np.random.default_rng(4), tilt=0.02))
    assert len(views) == 9
    with pytest.raises(ValueError, match=r"these pictures say too little.*tilt the board"):
        calibrated(views)


def test_pictures_that_do_not_fit_together_are_refused(tilted: list[BoardView]) -> None:
    views, rng = tilted[:9], np.random.default_rng(6)
    bent = [BoardView(v.points, v.pixels + rng.normal(0.0, 3.0, v.pixels.shape), v.blur, v.size) for v in views]
    with pytest.raises(ValueError, match=r"do not fit together|say too little"):
        calibrated(bent)
    other = [BoardView(v.points, v.pixels, v.blur, (640, 480 + i % 2)) for i, v in enumerate(views)]
    with pytest.raises(ValueError, match="expected pictures of one size, got 640 x 480, 640 x 481"):
        calibrated(other)


def test_a_picture_without_a_board_shows_none() -> None:
    assert find_board(np.full((480, 640), 128, np.uint8), BOARD) is None
    assert find_board(np.full((480, 640), 128, np.uint8), Board(marker=None)) is None


def test_the_picture_of_a_board_has_its_squares() -> None:
    plain = board_picture(Board(4, 3, 0.03, None), 10)
    assert plain.shape == (30, 40)
    assert plain[5, 5] == 0
    assert plain[5, 15] == 255
    marked = board_picture(BOARD, 30)
    assert marked.shape == (180, 270)
    assert marked[15, 15] == 0
    assert marked[2, 32] == 255
