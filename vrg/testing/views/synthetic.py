"""A made-up game of Sharks and Minnows with seven robots: what the nodes of a match would say, with no match running.

The paths are drawn, not simulated: two sharks and five minnows on the thesis' field (x 16..26, y -32..-13). In the
first pass one minnow is tagged and one leaves the field; in the second they are sharks.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, Topic
from vrg.regions import Circle, Polygon, Rectangle, Sector
from vrg.types import Pose, Twist
from vrg.ui.builder import SceneBuilder
from vrg.ui.scene import Scene

X_MIN, X_MAX, Y_MIN, Y_MAX = 16.0, 26.0, -32.0, -13.0
PASS_TIME = 20.0
COMMAND = Twist(0.9, 0.1)
SHARKS = ("bruce", "anchor")
MINNOWS = ("nemo", "marlin", "dory", "gill", "squirt")
NAMES = (*SHARKS, *MINNOWS)
TAGGED_AT = 9.0
OUT_AT = 12.5
OBSTACLES = (Rectangle(16.0, -12.25, 26.0, -12.15), Rectangle(26.75, -32.0, 26.85, -13.0), Circle(21.0, -24.0, 0.35))


def zones(passing: int = 1) -> tuple[m.Zone, ...]:
    """The field, the safe end and the starting end; they swap after the first pass."""
    north = Rectangle(X_MIN, -16.0, X_MAX, Y_MAX)
    south = Rectangle(X_MIN, Y_MIN, X_MAX, -29.0)
    safe, start = (north, south) if passing == 1 else (south, north)
    return (
        m.Zone(name="field", kind="field", region=Rectangle(X_MIN, Y_MIN, X_MAX, Y_MAX)),
        m.Zone(name="safe zone", kind="safe", region=safe),
        m.Zone(name="start", kind="start", region=start),
    )


def four_shapes() -> tuple[m.Zone, ...]:
    """A field that is a polygon, with one zone of each of the other shapes; the safe one is a sector."""
    field = Polygon(((X_MIN, Y_MIN), (X_MAX, Y_MIN), (X_MAX, -16.0), (22.0, Y_MAX), (X_MIN, Y_MAX)))
    return (
        m.Zone(name="field", kind="field", region=field),
        m.Zone(name="corner", kind="safe", region=Sector(X_MIN, Y_MIN, 5.0, 0.0, math.pi / 2)),
        m.Zone(name="island", kind="start", region=Circle(21.0, -22.0, 2.5)),
        m.Zone(name="gate", kind="goal", region=Rectangle(22.0, -31.0, 25.0, -28.0)),
    )


def pose_at(name: str, time: float) -> Pose:
    """Where a robot is, `time` s into the first pass; it comes back in the second."""
    if time > PASS_TIME:
        there = pose_at(name, max(0.0, 2 * PASS_TIME - time))
        return Pose(there.x, there.y, there.theta + math.pi)
    if name in SHARKS:
        before, after = _shark(name, time), _shark(name, time + 0.05)
        return Pose(*before, math.atan2(after[1] - before[1], after[0] - before[0]))
    index = MINNOWS.index(name)
    if name == "gill":
        time = min(time, TAGGED_AT)
    if name == "squirt":
        time = min(time, OUT_AT)
        out = max(0.0, time - 8.0)
        return Pose(24.5 + 0.11 * out**2, Y_MIN + 1.5 + time * 0.9, math.atan2(0.9, 0.22 * out))
    y = Y_MIN + 1.5 + 0.85 * time * (1 + 0.04 * index)
    x = 17.5 + 1.8 * index + 0.8 * math.sin(0.45 * time + 2 * index)
    return Pose(x, min(y, Y_MAX - 1.0), math.atan2(0.85, 0.36 * math.cos(0.45 * time + 2 * index)))


def _shark(name: str, time: float) -> tuple[float, float]:
    """Both swim from the safe end; bruce meets gill when it is tagged, anchor guards the middle."""
    index = SHARKS.index(name)
    x = 18.5 + 5.0 * index + 1.6 * math.sin(0.5 * time + index)
    y = Y_MAX - 1.5 - 6.0 * (1 - math.exp(-time / 6.0)) - 0.8 * math.cos(0.7 * time + index)
    if name == "bruce":
        gill = pose_at("gill", TAGGED_AT)
        near = math.exp(-(((time - TAGGED_AT) / 3.5) ** 2))
        x, y = x + near * (gill.x - 0.62 - x), y + near * (gill.y + 0.3 - y)
    return x, y


def poses(time: float) -> m.Poses:
    """Every body; the first two are declared physical."""
    return m.Poses(
        bodies=tuple(
            m.Body(name=name, pose=pose_at(name, time), twist=Twist(0.9, 0.1), physical=name in ("bruce", "nemo"))
            for name in NAMES
        )
    )


def players(time: float) -> list[m.PlayerStatus]:
    """Roles and states: in the second pass the inactive ones are sharks."""
    statuses = []
    for name in NAMES:
        gone = (name == "gill" and time >= TAGGED_AT) or (name == "squirt" and time >= OUT_AT)
        turned = gone and time > PASS_TIME
        role = "shark" if name in SHARKS or turned else "minnow"
        state = "inactive" if gone and not turned else "active"
        statuses.append(
            m.PlayerStatus(
                name=name, team=f"{role}s", role=role, state=state, may_move=state == "active",
                radius=0.32, pose=pose_at(name, time),
            )
        )  # fmt: skip
    return statuses


def state(time: float, **changes: object) -> m.RefereeState:
    """The referee's state; any field can be replaced."""
    passing = 1 if time <= PASS_TIME else 2
    fields: dict[str, object] = {
        "game": "sharks-and-minnows",
        "stage": m.Stage.PLAY_ROUND,
        "halted": None,
        "way_out": None,
        "waiting": (),
        "clock": time - (passing - 1) * PASS_TIME,
        "total": time,
        "round": passing,
        "rounds": 2,
        "score": {"sharks": sum(c.clock <= time for c in calls(PASS_TIME)), "minnows": 0},
        "players": players(time),
        "zones": zones(passing),
    }
    return m.RefereeState(**{**fields, **changes})  # type: ignore[arg-type]


def calls(time: float) -> list[m.Call]:
    """The referee's calls until `time`."""
    both = [
        m.Call(
            number=1,
            rule="tag",
            text="bruce tagged gill: the outlines were 0.24 m apart, outside the safe zone. gill is inactive.",
            players=("gill", "bruce"),
            poses=(pose_at("gill", TAGGED_AT), pose_at("bruce", TAGGED_AT)),
            clock=TAGGED_AT,
        ),
        m.Call(
            number=2,
            rule="out_of_bounds",
            text="squirt is out of bounds at x = 26.7 m and becomes inactive.",
            players=("squirt",),
            poses=(pose_at("squirt", OUT_AT),),
            clock=OUT_AT,
        ),
    ]
    return [call for call in both if call.clock <= time]


def report(name: str) -> m.Report:
    """What a player says of itself."""
    mode = "Shark/Chase" if name in SHARKS else "Minnow/Cross"
    return m.Report(mode=mode, armed=True, command=COMMAND, battery=0.8)


def scene_at(
    time: float,
    *,
    live: bool = True,
    estop: bool = False,
    sizes: Mapping[str, tuple[float, float]] | None = None,
    reports: bool = False,
    **changes: object,
) -> Scene:
    """The scene at a time of the match; fields of the referee's state can be replaced.

    Args:
        sizes: of bodies. reports: whether the players have said something of themselves.
    """
    builder = SceneBuilder(sizes=sizes, obstacles=OBSTACLES)
    for tick in range(int(time * 10) + 1):
        builder.clock(m.Clock(time=tick / 10, tick=tick, epoch=0, rate=1.0, estop=estop))
        builder.poses(poses(tick / 10), tick / 10)
    builder.referee(state(time, **changes))
    for call in calls(time):
        builder.call(call, call.clock)
    for name in NAMES if reports else ():
        builder.report(name, report(name))
    return builder.build(live)


@dataclass(frozen=True)
class SyntheticMatch:
    """Says it all on a mailbox, as an executor would."""

    keys: Keys

    def say(self, mailbox: Mailbox, topic: Topic[m.Message], body: m.Message, time: float, number: int) -> None:
        """Let a message wait at every inlet that hears it."""
        for inlet in mailbox.inlets:
            if inlet.topic.type is topic.type:
                inlet.offer(Received(topic.key, time, number, body))

    def step(self, node: Node, time: float, number: int, **changes: object) -> None:
        """One tick of the node at `time`, with everything that was said at that instant."""
        keys, mailbox = self.keys, node.mailbox
        clock = m.Clock(time=time, tick=number, epoch=0, rate=1.0, estop=bool(changes.get("estop", False)))
        self.say(mailbox, keys.clock, clock, time, number)
        self.say(mailbox, keys.poses, poses(time), time, number)
        self.say(mailbox, keys.referee_state, state(time, **changes), time, number)
        for call in calls(time):
            if time - node.period < call.clock <= time:
                self.say(mailbox, keys.referee_event, call, time, call.number)
        for name in NAMES:
            self.say(mailbox, keys.report(name), report(name), time, number)
        mailbox.handover(time)
        node.tick(Tick(time))
