"""40 pushes of one robot by another, which the tests of the engines and a benchmark make."""

import math
from dataclasses import dataclass

from tests.hal.engine_bench import body_of
from vrg.hal.models import robot_model
from vrg.hal.sim.engines import ENGINES
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.map import load_map
from vrg.types import Pose, Twist

SECONDS, TICK = 5.0, 0.02
HEADING = 0.4
"""The heading of the pushed robot, rad: along no axis of the map."""
BEARINGS = {"front": 0.0, "side": 90.0, "rear": 180.0, "oblique": 35.0}
"""Where the pusher comes from, in degrees from ahead of the pushed robot."""
STATES: dict[str, float | None] = {"braked": None, "at rest": 0.0, "driving": 0.2}
"""The speed that the pushed robot is commanded to drive at, m/s; None for locked wheels."""
_GAP = 0.3
"""The gap in m across which the pusher comes; at least, as bodies have corners."""


@dataclass(frozen=True)
class Push:
    """A push: a robot drives with its top speed at one that starts at the origin.

    Args:
        pusher, pushed: the names of their models.
        side: one of BEARINGS. state: one of STATES.
    """

    pusher: str
    pushed: str
    side: str
    state: str

    def off_way(self, engine: str, seconds: float = SECONDS) -> float:
        """The distance in m by which an engine's pushed robot ends off the way that it would have driven alone."""
        end, pose = self._end(engine, seconds, alone=True), self._end(engine, seconds, alone=False)
        length = math.hypot(end.x, end.y)
        share = (pose.x * end.x + pose.y * end.y) / length**2 if length > 0.01 else 0.0
        share = max(0.0, min(1.0, share))
        return math.hypot(pose.x - share * end.x, pose.y - share * end.y)

    def _end(self, engine_name: str, seconds: float, *, alone: bool) -> Pose:
        pusher, pushed, speed = robot_model(self.pusher), robot_model(self.pushed), STATES[self.state]
        if alone and not speed:
            return Pose(0.0, 0.0, HEADING)
        robots = [Start("pushed", pushed, Pose(0.0, 0.0, HEADING))]
        if not alone:
            way = HEADING + math.radians(BEARINGS[self.side])
            off = _GAP + (math.hypot(*pusher.size) + math.hypot(*pushed.size)) / 2
            robots.append(Start("pusher", pusher, Pose(off * math.cos(way), off * math.sin(way), way + math.pi)))
        engine = ENGINES.get(engine_name)(load_map("open"), robots)
        engine.command("pushed", None if speed is None else Twist(speed, 0.0))
        if not alone:
            engine.command("pusher", Twist(pusher.v_max, 0.0))
        for _ in range(round(seconds / TICK)):
            engine.step(TICK)
        pose = body_of(engine, "pushed").pose
        engine.close()
        return pose


MODELS = ("P2AT", "ATRV-Jr")
PUSHES = tuple(
    Push(pusher, pushed, side, state)
    for state in STATES
    for pusher in MODELS
    for pushed in MODELS
    if state != "driving" or pusher == pushed
    for side in BEARINGS
)
