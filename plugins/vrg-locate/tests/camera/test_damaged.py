"""A damaged calibration of a camera is refused in words."""

from pathlib import Path

from vrg.testing.damage import check_refused
from vrg_locate.camera.calibration import load_camera

CAMERA = b"""[lens]
size = [640, 480]
focal = [600.0, 600.0]
centre = [320.0, 240.0]
distortion = [0.0, 0, 0, 0, 0]
error = 0.2
"""


def test_a_damaged_calibration_is_refused_in_words(tmp_path: Path) -> None:
    check_refused(load_camera, tmp_path / "eye.toml", CAMERA, 40)
