"""Made-up players, messages and displays."""

from typing import Any

import numpy as np
from msgspec import structs

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys, Topic
from vrg.geometry import circumradius
from vrg.hal.models import robot_model
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.png import encode
from vrg.hal.sensors.sonar import Sonar
from vrg.regions import Rectangle
from vrg.types import Pose, Twist
from vrg.ui.builder import SceneBuilder
from vrg.ui.driving import Driving
from vrg.ui.scene import Scene
from vrg_views.hud.desk import Desk
from vrg_views.hud.goals import Ground
from vrg_views.hud.helm import Goal
from vrg_views.hud.telemetry import Telemetry

KEYS = Keys("test")
ROBOT = robot_model("P2AT")
RADIUS = circumradius(ROBOT.size)
WALL = Rectangle(2.0, -1.0, 2.2, 1.0)
GROUND = Ground(Rectangle(-5.0, -4.0, 5.0, 4.0), (WALL,), RADIUS)
HOME = Goal(-3.0, 0.0, 0.0)
START = Pose(-3.0, 0.0, 0.0)
GREEN_PICTURE = encode(np.full((24, 32, 3), (0, 200, 0), dtype=np.uint8))


def status(name: str, pose: Pose | None, **changes: Any) -> m.PlayerStatus:
    made = m.PlayerStatus(name=name, team="red", role="red", state="active", may_move=True, radius=RADIUS, pose=pose)
    return structs.replace(made, **changes)


def state(*players: m.PlayerStatus, **changes: Any) -> m.RefereeState:
    made = m.RefereeState(
        game="hud", stage=m.Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=1.0, total=1.0, round=1,
        rounds=1, score={"team": 0}, players=tuple(players),
        zones=(m.Zone(name="field", kind="field", region=Rectangle(-5.0, -4.0, 5.0, 4.0)),),
    )  # fmt: skip
    return structs.replace(made, **changes)


def report(**changes: Any) -> m.Report:
    return m.Report(mode="Waiting", armed=True, **changes)


def received(body: Any, stamp: float = 0.0) -> Any:
    return Received("key", stamp, 0, body)


def seen(pose: Pose | None = START, *, now: float = 1.0, **changes: Any) -> Telemetry:
    """What a player knows that stands at a pose and may move."""
    me = status("ann", pose)
    made: dict[str, Any] = {
        "now": now, "live": True, "state": state(me), "me": me, "report": received(report(), now), "pose": pose,
        "pose_age": None if pose is None else 0.0, "speed": 0.0, "player_age": 0.0, "robot_age": 0.0,
        "referee_age": 0.0,
    }  # fmt: skip
    return Telemetry(**{**made, **changes})


def scene_of(known: Telemetry) -> Scene:
    """What is shown to the player who knows this."""
    builder = SceneBuilder()
    if known.state is not None:
        builder.referee(known.state)
    if known.report is not None:
        builder.report("ann", known.report.body)
    return builder.build(known.live)


def scan(distance: float, *, nearest: tuple[int, float] | None = None) -> Laser:
    """A scan of 181 beams from right to left that meets something everywhere; one beam may meet something nearer."""
    ranges = np.full(181, distance, dtype="<f4")
    if nearest is not None:
        ranges[nearest[0]] = nearest[1]
    step = float(np.radians(1.0))
    return Laser(angle_min=-90 * step, angle_step=step, range_max=30.0, data=ranges.tobytes())


def ring(**near: float) -> Sonar:
    """A ring of 16 transducers; those that hear something by number, as `_3=1.5`."""
    ranges = [near.get(f"_{number}", 5.0) for number in range(16)]
    return Sonar(range_max=5.0, ranges=tuple(ranges))


def picture() -> Camera:
    return Camera(fov=1.0, data=GREEN_PICTURE)


def ins(pose: Pose) -> Ins:
    return Ins(pose=pose)


def odometry(v: float) -> Odometry:
    return Odometry(pose=Pose(0.0, 0.0, 0.0), twist=Twist(v, 0.0))


def desk() -> Desk:
    return Desk(Driving(Mailbox(), KEYS), "ann", ROBOT, GROUND, HOME)


def sent(mailbox: Mailbox) -> list[tuple[str, m.Message]]:
    return [(out.topic.key.removeprefix("vrg/test/"), out.message.body) for out in mailbox.collect()]


def topic_of(body: m.Message) -> Topic[Any]:
    """The topic on which a message about ann comes."""
    if isinstance(body, m.SensorMessage):
        name = next(spec.name for spec in ROBOT.sensors if spec.message is type(body))
        return KEYS.sensor(type(body), "ann", name)
    found: dict[type, Topic[Any]] = {
        m.RefereeState: KEYS.referee_state, m.Report: KEYS.report("ann"), m.Sight: KEYS.sight("red"),
        m.Clock: KEYS.clock, m.MeasuredPose: KEYS.robot_pose("ann"), m.Sketch: KEYS.sketch("ann"),
    }  # fmt: skip
    return found[type(body)]
