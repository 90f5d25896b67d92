"""A class without installation: students open a link, write code in the browser, and see a robot drive by it."""

from typing import Final

from vrg.plugins import Command

CLASS_TABLE: Final = {
    "Teach a class": {
        "start": ("vrg_class.command:start", "Serve the class: print the links of the students and of the teacher"),
        "final": ("vrg_class.final_command:final", "Let the best play a bracket, as a show"),
        "export": ("vrg_class.command:export", "Copy what was handed in into a folder for `vrg league` and `vrg play`"),
    }
}
CLASS: Final = Command(("class",), "Play", "Teach a class: start, final, export", "vrg_class:CLASS_TABLE")
