"""A source of fixes: a camera above the field that sees a printed tag on each robot.

All of it needs OpenCV, which is optional; where that is missing, an error tells what to install.
"""

from vrg.errors import ConfigError

try:
    import cv2
except ImportError as error:
    raise ConfigError(
        "expected the package opencv-python-headless for a camera above the field, found none: install it by "
        "`pip install 'virtual-robotic-games-locate[camera]'`"
    ) from error

# It would print its own warnings between the messages of this module.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

__all__ = ["cv2"]
