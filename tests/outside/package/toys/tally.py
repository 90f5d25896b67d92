"""A drawer of the page of a match that counts the referee's calls."""

from typing import Any

from vrg.launch.context import NodeContext
from vrg.ui.scene import Scene
from vrg.ui.web.drawers import Drawer


class Tally:
    """Counts what is called. It listens to nothing, as the scene has all that it shows."""

    def __init__(self, match: str) -> None:
        self.match = match

    def take(self, now: float) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""

    def part(self, now: float, scene: Scene, player: str) -> dict[str, Any]:
        """The number of calls, and who is selected."""
        return {"match": self.match, "count": len(scene.calls), "player": player}


def tally(on: NodeContext) -> Tally:
    """The tally of a match."""
    return Tally(on.setup.name)


DRAWER = Drawer("Tally", package="toys", makes="toys.tally:tally")
