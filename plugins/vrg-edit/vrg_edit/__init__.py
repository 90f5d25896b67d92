"""The page in a browser on which a person chooses, changes, saves and starts a match (thesis 3.1.3)."""

from typing import Final

from vrg.plugins import Command

EDIT: Final = Command(("edit",), "Play", "Choose a match in a browser, and change it", "vrg_edit.command:edit")
