"""A made-up match to look into: players on a field, scans, bids, streams and processes."""

import math
import struct
from typing import Any

from vrg.bus import messages as m
from vrg.bus.codec import Received, encode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages.process import Processes, ProcessState, ProcessStatus
from vrg.bus.topics import Keys, Topic
from vrg.hal.models import MODELS, RobotModel
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.sonar import Sonar
from vrg.regions import Rectangle
from vrg.types import Pose, Twist
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg_views.developer.insight import Hearing, Insight
from vrg_views.developer.traffic import Traffic

KEYS = Keys("test")
ROBOT = MODELS.get("P2AT")
WIDTH, LENGTH = 20.0, 12.0


class Bench:
    """What is heard of a match whose nodes are played by the test.

    Args:
        players: how many there are. robot: their model. official: whether it is heard with an official's seat.
    """

    def __init__(self, players: int = 3, *, robot: RobotModel = ROBOT, official: bool = True) -> None:
        self.names = [f"robot{number + 1}" for number in range(players)]
        self.time, self.real, self.number = 10.0, 500.0, 0
        self.changes: dict[str, Any] = {}
        self.reports: dict[str, dict[str, Any]] = {}
        self.states: dict[str, dict[str, Any]] = {}
        self.traffic = Traffic(KEYS, lambda: self.real)
        self.hearing = Hearing(KEYS, self.traffic, dict.fromkeys(self.names, robot), official=official)
        self.mailbox, self.builder = Mailbox(), SceneBuilder()
        self.inlets = SceneInlets(self.mailbox, KEYS)
        self.ticks(3)

    def insight(self, selected: str = "") -> Insight:
        """What is known now."""
        return self.hearing.insight(self.time, self.builder.build(live=True), selected)

    def pose(self, name: str) -> Pose:
        """Where a robot is: in rows over the field."""
        index = self.names.index(name)
        columns = max(1, math.ceil(math.sqrt(len(self.names) * 1.6)))
        x, y = index % columns, index // columns
        return Pose(1.5 + x * (WIDTH - 3) / columns, 2.0 + y * 3.0, 0.4 * index)

    def tell(self, topic: Topic[Any], body: m.Message, *, stamp: float | None = None) -> None:
        """Let a message come by the mailbox and by the bus."""
        stamp = self.time if stamp is None else stamp
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is topic.type:
                inlet.offer(Received(topic.key, stamp, self.number, body))
        self.traffic.arrived(topic.key, encode(Received(topic.key, stamp, self.number, body)))

    def tick(self) -> None:
        """One tick with all that is said."""
        self.number += 1
        self.time += 0.04
        self.real += 0.04
        tick = round(self.time * 50)
        self.tell(KEYS.clock, m.Clock(time=self.time, tick=tick, epoch=0, rate=1.0, estop=False))
        bodies = [m.Body(name=n, pose=self.pose(n), twist=Twist(0.6, 0.1), physical=n == "robot1") for n in self.names]
        self.tell(KEYS.poses, m.Poses(bodies=bodies))
        self.tell(KEYS.referee_state, self.state())
        for name in self.names:
            report: dict[str, Any] = {"mode": "Search/Turn", "armed": True, "battery": 0.8, "command": Twist(0.6, 0.1)}
            self.tell(KEYS.report(name), m.Report(**{**report, **self.reports.get(name, {})}))
        self.mailbox.handover(self.time)
        self.inlets.feed(self.builder)
        self.hearing.take(self.time)

    def ticks(self, count: int) -> None:
        """So many ticks."""
        for _ in range(count):
            self.tick()

    def state(self) -> m.RefereeState:
        """The referee's state; `changes` replaces fields of it, and `states` those of players."""
        players = [
            m.PlayerStatus(**{
                "name": n, "team": "pursuers", "role": "pursuer", "state": "active", "may_move": True, "radius": 0.3,
                **self.states.get(n, {}),
            })
            for n in self.names
        ]  # fmt: skip
        field = m.Zone(name="field", kind="field", region=Rectangle(0.0, 0.0, WIDTH, LENGTH))
        fields: dict[str, Any] = {
            "game": "pursuit-evasion", "stage": m.Stage.PLAY_ROUND, "halted": None, "way_out": None, "waiting": [],
            "clock": self.time - 5.0, "total": self.time - 5.0, "round": 1, "rounds": 1,
            "score": {"pursuers": 2, "evaders": 0}, "players": players, "zones": [field],
        }  # fmt: skip
        return m.RefereeState(**{**fields, **self.changes})

    def scan(self, name: str, distance: float = 2.0) -> None:
        """A laser scan in which every second beam meets something at a distance, m."""
        ranges = [distance if beam % 2 else 8.0 for beam in range(181)]
        data = struct.pack("<181f", *ranges)
        laser = Laser(angle_min=-math.pi / 2, angle_step=math.pi / 180, range_max=8.0, data=data)
        self.tell(KEYS.sensor(Laser, name, "front"), laser)

    def ring(self, name: str, distance: float = 1.0) -> None:
        """A ring of sonars of which each hears an echo at a distance, m."""
        self.tell(KEYS.sensor(Sonar, name, "rings"), Sonar(range_max=5.0, ranges=(distance,) * 16))

    def processes(self, **changes: Any) -> None:
        """The processes of the match; `changes` are those of the first player's."""
        statuses = [
            ProcessStatus(**{
                "name": n, "machine": "here", "state": ProcessState.RUNNING, "node": f"player/{n}", "pid": 7,
                "cpu": 0.07, "memory": 48_000_000, **(changes if n == self.names[0] else {}),
            })
            for n in self.names
        ]  # fmt: skip
        self.tell(KEYS.processes, Processes(processes=statuses))
        for name in self.names:
            pulse = m.Pulse(
                ticks=100, missed=3 if name == self.names[0] else 0, frequency=10.0, late=0.002, drift=1e-5, refused=4
            )
            self.tell(KEYS.pulse("player", name), pulse)

    def call(self, number: int, rule: str = "capture", text: str = "robot1 captured robot2.") -> None:
        """A call of the referee."""
        call = m.Call(number=number, rule=rule, text=text, players=("robot1",), poses=(), clock=3.0)
        self.tell(KEYS.referee_event, call)
