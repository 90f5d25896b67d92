"""Days with people: a class whose students write robots in browsers, and events on a stage."""

from typing import Final

from vrg.plugins import Command

CLASS_TABLE: Final = {
    "Teach a class": {
        "start": ("vrg_class.command:start", "Serve the class: print the links of the students and of the teacher"),
        "final": ("vrg_class.final_command:final", "Let the best students play a bracket on a stage"),
        "export": ("vrg_class.command:export", "Copy all entries into a folder for `vrg league` and `vrg play`"),
    }
}
CLASS: Final = Command(("class",), "Play", "Teach a class: start, final, export", "vrg_class:CLASS_TABLE")
EVENT: Final = Command(("event",), "Play", "Run a timetable of matches on one field", "vrg_class.event.command:event")
CLIP: Final = Command(
    ("run", "clip"),
    "Look at a recorded run (RUN; by default the newest in the folder runs)",
    "Write the seconds around a call as a GIF animation",
    "vrg_class.event.clip_command:clip",
)
