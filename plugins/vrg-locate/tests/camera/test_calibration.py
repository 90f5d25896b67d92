"""The file of a camera: what is written is read, and what is wrong is told in words."""

from pathlib import Path

import numpy as np
import pytest

from camera.scenes import LENS, looking
from vrg.errors import ConfigError
from vrg_locate.camera.calibration import CameraFile, FloorTag, LensTable, PlaceTable, camera_text, load_camera

PLACE = looking((0.3, -1.2, 2.5))
WHOLE = CameraFile(
    lens=LensTable.of(LENS, 0.21),
    place=PlaceTable.of(PLACE, 0.6),
    tags=(FloorTag(number=20, x=0.0, y=0.0), FloorTag(number=21, x=2.5, y=-0.125)),
)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "cam.toml"
    file.write_text(camera_text(WHOLE), encoding="utf-8")
    read = load_camera(file)
    view = read.view(file)
    assert view.lens.matrix == pytest.approx(LENS.matrix)
    assert view.lens.distortion == pytest.approx(LENS.distortion)
    assert view.lens.size == LENS.size
    assert view.place.position == pytest.approx(PLACE.position)
    assert view.place.rotation == pytest.approx(PLACE.rotation, abs=1e-8)
    assert view.shift == 0.6
    assert read.tags == WHOLE.tags
    assert camera_text(read) == camera_text(WHOLE)


def test_the_axes_may_be_rounded(tmp_path: Path) -> None:
    file = tmp_path / "cam.toml"
    right, down, ahead = np.round(PLACE.rotation, 3).tolist()
    table = PlaceTable(position=(0.0, 0.0, 1.0), right=right, down=down, ahead=ahead, error=0.1)
    assert table.place.rotation @ table.place.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    file.write_text(camera_text(CameraFile(lens=WHOLE.lens, place=table)), encoding="utf-8")
    assert load_camera(file).place is not None


def test_a_lens_alone_is_no_place(tmp_path: Path) -> None:
    file = tmp_path / "cam.toml"
    file.write_text(camera_text(CameraFile(lens=WHOLE.lens)), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"cam\.toml: expected a table \[place\].*vrg locate calibrate field"):
        load_camera(file).view(file)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("size = [1280, 720]", "size = [1280]", r"cam\.toml:2: lens\.size\.2: missing"),
        ("focal = [950, 948]", "focal = [-1, 948]", r"lens\.focal\.1: expected more than 0, got -1"),
        ("focal =", "vocal =", r"unknown field. Did you mean|lens\.focal: missing"),
        ("right = [0.", "right = [1.", "at right angles to each other"),
        ("number = 20", "number = 900", r"tags\.1\.number: expected less than 587, got 900"),
        ("[lens]", "[lens", "not TOML"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    file, text = tmp_path / "cam.toml", camera_text(WHOLE)
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        load_camera(file)


def test_a_file_that_is_missing_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected the file that `vrg locate calibrate lens` writes"):
        load_camera(tmp_path / "none.toml")
