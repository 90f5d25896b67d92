"""Where real robots are: by a camera, by motion capture, by SSL-Vision; and what these say of how the robots drive."""

from typing import Final

from vrg.plugins import Command

CALIBRATE: Final = {
    "Measure a camera": {
        "lens": ("vrg_locate.calibrate_command:lens", "Measure its lens, from pictures of a printed board"),
        "field": ("vrg_locate.calibrate_command:field", "Find where it is, by tags or points on the floor"),
    }
}
LOCATE_TABLE: Final = {
    "Locate robots by a camera above the field": {
        "tags": ("vrg_locate.locate_command:tags", "Print the tags of a match's robots, and some for the floor"),
        "board": ("vrg_locate.locate_command:board", "Print the board that a lens is calibrated with"),
        "calibrate": (CALIBRATE, "Measure a camera: lens, field"),
        "show": ("vrg_locate.locate_command:show", "Find the tags in a picture, and draw them"),
    }
}
LOCATE: Final = Command(
    ("locate",), "Lab", "Locate robots by a camera: tags, board, calibrate, show", "vrg_locate:LOCATE_TABLE"
)
REPORT: Final = Command(
    ("run", "report"),
    "Look at a recorded run (RUN; by default the newest in the folder runs)",
    "Compare robots with their simulation, and calibrate them",
    "vrg_locate.report_command:report",
)
