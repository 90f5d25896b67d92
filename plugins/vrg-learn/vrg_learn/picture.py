"""Pictures of a match as the spectator's window shows it, without a window."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from vrg.agents.player import PERIOD
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.config.setup import MatchSetup

if TYPE_CHECKING:
    from vrg.ui.scene import Scene

SIZE = (960, 640)
"""The width and the height of a picture, pixels."""


class SceneNode(Node):
    """The node that hears what there is to see of a match.

    Args:
        setup: the match.
    """

    kind = "picture"

    def __init__(self, setup: MatchSetup) -> None:
        from vrg.ui.builder import SceneBuilder, SceneInlets  # noqa: PLC0415 - most environments draw nothing

        super().__init__("environment", Mailbox(), PERIOD)
        sizes = {player.name: player.robot.size for player in setup.players}
        self._builder = SceneBuilder(sizes=sizes, obstacles=setup.obstacles)
        self._inlets = SceneInlets(self.mailbox, setup.keys)

    def begin(self, tick: Tick) -> None:
        """Take in what has arrived."""
        self._inlets.feed(self._builder)

    def tick(self, tick: Tick) -> None:
        """Do nothing: it only watches."""

    @property
    def scene(self) -> "Scene":
        """What there is to see now."""
        return self._builder.build(live=True)


class SceneCamera:
    """Draws pictures, and keeps what it needs for the next one."""

    def __init__(self) -> None:
        from vrg.ui.window.draw import Still  # noqa: PLC0415 - most environments draw nothing

        self._still = Still(SIZE)

    def picture(self, scene: "Scene") -> npt.NDArray[np.uint8]:
        """Return a picture of a scene: shape (height, width, 3), red, green and blue."""
        width, height = SIZE
        return np.frombuffer(self._still.rgb(scene), dtype=np.uint8).reshape(height, width, 3).copy()
