"""`vrg locate ...`: from sheets that are printed to a camera that is calibrated."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from camera.scenes import LENS, boards_held_up, looking, tags_on_field
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.testing.command_line import invoke
from vrg.types import Pose
from vrg_locate.camera import cv2
from vrg_locate.camera.calibration import CameraFile, LensTable, camera_text, load_camera
from vrg_locate.camera.field import FieldView
from vrg_locate.camera.lens import Board
from vrg_locate.camera.readers import read_picture

VIEW = FieldView(LENS, looking((0.3, -1.2, 2.8)))
FLOOR = {20: (-0.9, -0.5), 21: (0.9, -0.5), 22: (0.9, 0.7), 23: (-0.9, 0.7)}
PLACES = [word for number, (x, y) in FLOOR.items() for word in ("--tag", f"{number}={x},{y}")]
TABLES = """
[localisation.overhead]
source = "camera"
camera = 0
calibration = "cam.toml"
size = 0.12

[localisation.overhead.tags]
player1 = { number = 7, height = 0.3 }
player2 = { number = 8, height = 0.3, size = 0.1 }
"""


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pictures of a board, and one of the field."""
    folder, rng = tmp_path_factory.mktemp("taken"), np.random.default_rng(11)
    for number, picture in enumerate(boards_held_up(Board(), 9, rng)):
        cv2.imwrite(str(folder / f"board{number}.png"), picture)
    tags = [(number, Pose(x, y, 0.4), 0.0) for number, (x, y) in FLOOR.items()]
    cv2.imwrite(str(folder / "field.png"), tags_on_field(VIEW, [*tags, (3, Pose(0.2, 0.1, 1.0), 0.25)], 0.15, rng))
    cv2.imwrite(str(folder / "empty.png"), np.full((720, 1280), 120, np.uint8))
    return folder


@pytest.fixture
def locate(taken: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Runs `vrg locate` where cam.toml has a lens and no place."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cam.toml").write_text(camera_text(CameraFile(lens=LensTable.of(LENS, 0.1))), encoding="utf-8")

    def run(*words: str) -> Result:
        result = invoke("locate", *words)
        if isinstance(result.exception, ConfigError):
            raise result.exception
        return result

    return run


def test_a_lens_and_a_place_are_measured_and_then_tags_are_located(
    locate: Callable[..., Result], taken: Path, tmp_path: Path
) -> None:
    boards = sorted(map(str, taken.glob("board*.png")))
    result = locate("calibrate", "lens", *boards, str(taken / "empty.png"), "--output", "new.toml")
    assert result.exit_code == 0, result.output
    assert "empty.png: no board" in result.output
    assert "9 pictures; corners are off by" in result.output
    found = load_camera(tmp_path / "new.toml")
    assert found.lens.focal == pytest.approx((950.0, 948.0), rel=0.01)
    assert found.place is None
    result = locate("calibrate", "field", str(taken / "field.png"), "--calibration", "new.toml", *PLACES)
    assert result.exit_code == 0, result.output
    assert "tag 22: off by" in result.output
    placed = load_camera(tmp_path / "new.toml")
    assert placed.place is not None
    assert placed.place.position == pytest.approx(VIEW.place.position, abs=0.03)
    assert {tag.number: (tag.x, tag.y) for tag in placed.tags} == FLOOR
    result = locate("show", str(taken / "field.png"), "--calibration", "new.toml", "--height", "0.25")
    assert result.exit_code == 0, result.output
    told = {int(n): (float(x), float(y)) for n, x, y in re.findall(r"tag (\d+): x (\S+) m, y (\S+) m", result.output)}
    assert told == {n: pytest.approx(place, abs=0.005) for n, place in {**FLOOR, 3: (0.2, 0.1)}.items()}
    turned = locate("show", str(taken / "field.png"), "--calibration", "new.toml", "--prints", "apriltag")
    headings = [re.findall(r"heading (\S+) degrees", one.output) for one in (result, turned)]
    assert [abs(float(a) - float(b)) for a, b in zip(*headings, strict=True)] == pytest.approx([180.0] * 5, abs=1.0)
    drawn = read_picture(tmp_path / "found.png")
    assert drawn.shape == (720, 1280, 3)
    assert (np.ptp(drawn, axis=2) > 100).sum() > 500, "something is drawn in colours"


def test_points_may_be_typed_in_place_of_tags(locate: Callable[..., Result], taken: Path, tmp_path: Path) -> None:
    pixels = VIEW.project(np.array([(x, y, 0.0) for x, y in FLOOR.values()])).tolist()
    words = [w for (x, y), (u, v) in zip(FLOOR.values(), pixels, strict=True) for w in ("--corner", f"{x},{y}={u},{v}")]
    result = locate("calibrate", "field", str(taken / "empty.png"), "--calibration", "cam.toml", *words)
    assert result.exit_code == 0, result.output
    assert "Nothing will tell whether the camera is moved" in " ".join(result.output.split())
    place = load_camera(tmp_path / "cam.toml").place
    assert place is not None
    assert place.position == pytest.approx(VIEW.place.position, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([*PLACES, "--tag", "5=0,0"], r"--tag 5: expected it once in .*, got it 0 times \(seen: 3, 20, 21, 22, 23\)"),
        ([*PLACES, "--corner", "0,0=640,10"], "do not fit together: they are off by .* most of all 0,0"),
    ],
)
def test_places_that_cannot_be_are_refused(
    locate: Callable[..., Result], taken: Path, words: list[str], expected: str
) -> None:
    with pytest.raises(ConfigError, match=expected):
        locate("calibrate", "field", str(taken / "field.png"), "--calibration", "cam.toml", *words)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--tag", "twenty=1,2"], "expected a tag and its place such as"),
        (["--tag", "20=1"], "expected two numbers such as"),
        (["--corner", "1,2"], "expected two numbers such as"),
    ],
)
def test_what_is_typed_wrong_is_told(
    locate: Callable[..., Result], taken: Path, words: list[str], expected: str
) -> None:
    result = locate("calibrate", "field", str(taken / "field.png"), "--calibration", "cam.toml", *words)
    assert result.exit_code == 2
    assert expected in " ".join(result.output.replace("│", " ").split())


def test_too_few_pictures_of_a_board_are_refused(locate: Callable[..., Result], taken: Path) -> None:
    with pytest.raises(ConfigError, match="at least 8 sharp pictures that show the board, got 2"):
        locate("calibrate", "lens", *(str(taken / f"board{number}.png") for number in range(2)))
    assert locate("calibrate", "lens", str(taken / "board0.png"), "--chessboard", "ten").exit_code == 2


def test_pictures_are_shown_without_a_calibration_too(locate: Callable[..., Result], taken: Path) -> None:
    result = locate("show", str(taken / "field.png"))
    assert re.search(r"tag 3: \d+ pixels wide", result.output)
    assert "No tag was found" in locate("show", str(taken / "empty.png"), "--calibration", "cam.toml").output


def test_a_mirrored_picture_is_named(locate: Callable[..., Result], taken: Path, tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "mirrored.png"), read_picture(taken / "field.png")[:, ::-1])
    for words in (("show",), ("calibrate", "field", "--calibration", "cam.toml", *PLACES)):
        with pytest.raises(ConfigError, match=r"the picture is mirrored: .* the tags 3, 20, 21, 22, 23"):
            locate(*words, "mirrored.png")


def test_a_picture_of_another_size_and_a_camera_that_is_missing_are_refused(
    locate: Callable[..., Result], tmp_path: Path
) -> None:
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((48, 64), np.uint8))
    with pytest.raises(ConfigError, match="expected 1280 x 720 pixels, as the lens was calibrated for, got 64 x 48"):
        locate("show", "small.png", "--calibration", "cam.toml")
    with pytest.raises(ConfigError, match="camera 97: expected a camera that can be opened"):
        locate("show", "97")


def test_the_tags_of_a_match_are_printed(locate: Callable[..., Result], tmp_path: Path) -> None:
    result = locate("tags", "sharks-and-minnows", "--floor", "20")
    assert result.exit_code == 0, result.output
    assert "player1: tag 0, 0.15 m" in result.output
    assert "floor 20: tag 20, 0.15 m" in result.output
    assert "player2 = { number = 1, height = 0.3 }" in result.output
    pdf = (tmp_path / "tags.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page ") == 8
    assert re.search(rb"/MediaBox \[ 0 0 595\.27\d* 841\.88\d* \]", pdf), "A4, in points"
    text = GAMES.get("sharks-and-minnows").default_match().read_text(encoding="utf-8")
    own = text.replace('name = "player2"', 'name = "player2"\nlocalisation = "fusion"')
    own += '\n[[bodies]]\nname = "box"\nkind = "box"\nx = 1.0\ny = 1.0\nsize = [0.4, 0.4]\nlocalisation = "fusion"\n'
    (tmp_path / "fused.toml").write_text(own, encoding="utf-8")
    result = locate("tags", "fused.toml", "--floor", "20")
    assert result.exit_code == 0, result.output
    assert result.output.endswith(
        "[localisation.overhead.tags]\nplayer2 = { number = 0, height = 0.3 }\nbox = { number = 1, height = 0.3 }\n"
    )
    (tmp_path / "match.toml").write_text(text + TABLES, encoding="utf-8")
    result = locate("tags", "match.toml", "-o", "own.pdf")
    assert result.exit_code == 0, result.output
    assert "player1: tag 7, 0.12 m\nplayer2: tag 8, 0.1 m\n" in result.output
    assert "In the match file" not in result.output
    with pytest.raises(ConfigError, match="expected numbers that no robot has, got 7"):
        locate("tags", "match.toml", "--floor", "7")
    with pytest.raises(ConfigError, match=r"expected a size of at most 0\.160 m"):
        locate("tags", "match.toml", "--size", "0.2")
    with pytest.raises(ConfigError, match="expected the number of a tag from 0 to 586"):
        locate("tags", "match.toml", "--floor", "1000")


def test_the_board_is_printed(locate: Callable[..., Result], tmp_path: Path) -> None:
    assert locate("board").exit_code == 0
    pdf = (tmp_path / "board.pdf").read_bytes()
    assert re.search(rb"/MediaBox \[ 0 0 841\.88\d* 595\.27\d* \]", pdf)
