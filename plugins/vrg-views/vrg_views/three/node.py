"""The view in three dimensions as a node of the match: it hears what there is to see, and publishes nothing."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Rays
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.regions import Region
from vrg.types import Pose
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.pace import Pace
from vrg.ui.scene import Scene
from vrg_views.three import KIND
from vrg_views.three.theatre import Theatre, theatre

FRAME: Final = 1 / 30
"""The real time in s between two frames."""
UNWATCHED: Final = 30
"""Of so many frames one is shown while no browser is connected, so that the next one sees the match at once."""


class ThreeNode(Node):
    """Shows the match to browsers, which can only watch.

    Args:
        theatre: what browsers see.
        robots: the models of the players' robots, by name. obstacles: the ground that walls and obstacles cover, m.

    Attributes:
        theatre: as given.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        theatre: Theatre,
        *,
        robots: Mapping[str, RobotModel],
        obstacles: Sequence[Region] = (),
    ) -> None:
        super().__init__(name, mailbox, FRAME)
        self.theatre = theatre
        self._inlets = SceneInlets(mailbox, keys)
        self._builder = SceneBuilder(sizes={robot: model.size for robot, model in robots.items()}, obstacles=obstacles)
        self._scans = {
            robot: (spec, mailbox.subscribe(keys.sensor(spec.message, robot, spec.name)))
            for robot, model in robots.items()
            if (spec := model.scanner) is not None
        }
        self._seen: dict[str, tuple[float, Pose, Rays]] = {}
        self._pace = Pace(FRAME)
        self._frames = 0
        self._scene = Scene()

    def start(self) -> None:
        """Open the port.

        Raises:
            LaunchError: it cannot be opened.
        """
        self.theatre.open()
        self.theatre.show(self._builder.build(live=False), FRAME)

    def tick(self, tick: Tick) -> None:
        """Take messages in, and show at most one frame."""
        self._inlets.feed(self._builder)
        if not self._pace.due(tick, self._scene.rate):
            return
        self._frames += 1
        if self.theatre.watched or self._frames % UNWATCHED == 0:
            self._scene = self._builder.build(tick.live)
            self.theatre.show(self._scene, FRAME, self._scanned())

    def stop(self) -> None:
        """Close the port. Calling it again does nothing."""
        self.theatre.close()

    def _scanned(self) -> dict[str, tuple[Pose, Rays]]:
        """The newest scan of each robot that a viewer follows, with where the robot was when it came."""
        for robot in self.theatre.followed:
            spec, inlet = self._scans.get(robot, (None, None))
            newest = None if inlet is None else inlet.latest
            pose = next((body.pose for body in self._scene.bodies if body.name == robot), None)
            if spec is None or newest is None or pose is None:
                continue
            if robot not in self._seen or self._seen[robot][0] != newest.stamp:
                depicted = spec.depict(newest.body)
                if isinstance(depicted, Rays):
                    self._seen[robot] = newest.stamp, pose, depicted
        return {robot: (pose, rays) for robot, (_, pose, rays) in self._seen.items()}


def three(on: NodeContext) -> Made:
    """The view of a match in three dimensions."""
    setup, robots = on.setup, {player.name: player.robot for player in on.setup.players}
    shown = theatre(setup, on.name)
    node = ThreeNode(on.named(KIND.process), Mailbox(), setup.keys, shown, robots=robots, obstacles=setup.obstacles)
    return Made(node, {"idle": DISPLAY_PERIOD})
