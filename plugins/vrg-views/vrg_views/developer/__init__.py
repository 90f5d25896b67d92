"""What the page of a match shows to officials in a drawer: everything about players, referee, streams and processes."""

from typing import Final

from vrg.plugins import Command, Option
from vrg.ui.web.drawers import Drawer

DETAILS: Final = Drawer(
    "Details",
    package="vrg_views.developer",
    makes="vrg_views.developer.part:made",
    option=Option("--developer", "Like --web; the official's link opens the details, for developers."),
)
"""The drawer."""
DEVELOPER: Final = Command(
    ("show", "developer"),
    "Show a running match",
    "The page with players, referee, streams and processes",
    "vrg_views.developer.command:developer",
)
"""The command that serves the page with the drawer open."""
