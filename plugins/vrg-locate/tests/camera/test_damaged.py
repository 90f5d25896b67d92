"""A damaged calibration of a camera is refused in words."""

from pathlib import Path

from vrg.errors import VrgError
from vrg.testing.damage import deep, mutants
from vrg_locate.camera.calibration import load_camera

CAMERA = b"""[lens]
size = [640, 480]
focal = [600.0, 600.0]
centre = [320.0, 240.0]
distortion = [0.0, 0, 0, 0, 0]
error = 0.2
"""


def test_a_damaged_calibration_is_refused_in_words(tmp_path: Path) -> None:
    file = tmp_path / "eye.toml"
    for what, content in [*mutants(CAMERA, 40), ("deep", deep(CAMERA))]:
        file.write_bytes(content)
        try:
            load_camera(file)
        except (VrgError, OSError):
            continue
        except Exception as error:
            raise AssertionError(f"{what}: {content[:300]!r}") from error
