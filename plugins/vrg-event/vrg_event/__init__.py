"""Events: a timetable of matches on one field, its page for the stage, and clips of calls."""

from typing import Final

from vrg.plugins import Command

EVENT: Final = Command(("event",), "Play", "Run a timetable of matches on one field", "vrg_event.event_command:event")
CLIP: Final = Command(
    ("run", "clip"),
    "Look at a recorded run; RUN is the newest in the folder runs, if none is named",
    "Write the seconds around a call as a moving picture",
    "vrg_event.clip_command:clip",
)
