"""OpenCV, which is optional, with words about what to install where it is missing."""

from vrg.errors import ConfigError

try:
    import cv2
except ImportError as error:
    raise ConfigError(
        "expected the package opencv-python-headless for a camera above the field, found none: install it by "
        "`.venv/bin/pip install -e '.[camera]'` in the folder of VRG"
    ) from error

__all__ = ["cv2"]
