"""What there is to see of a match at one instant, gathered from its messages. No window, no drawing."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys, name_in
from vrg.colours import OUT_OF_PLAY

Point = tuple[float, float]
"""x, y in m, in the map's frame."""
Segment = tuple[float, float, float, float]
"""x1, y1, x2, y2 in m."""
Circle = tuple[float, float, float]
"""x, y, radius in m."""

TRAIL_SECONDS: Final = 6.0
TRAIL_STEP: Final = 0.2
"""s between the points of a trail."""
JUMP: Final = 1.0
"""m; a body that moved further between two messages was placed there, it did not drive."""
CALLS_KEPT: Final = 20


@dataclass(frozen=True)
class SceneBody:
    """One robot to draw.

    Args:
        pose: of its centre. length, width: m. role, state: the referee's words, empty for a body that plays no part.
        trail: where it was, oldest first, at most `TRAIL_SECONDS`.
    """

    name: str
    pose: m.Pose
    length: float
    width: float
    role: str
    state: str
    physical: bool
    trail: tuple[Point, ...]

    @property
    def out_of_play(self) -> bool:
        """It is only an obstacle."""
        return self.state in OUT_OF_PLAY


@dataclass(frozen=True)
class ScenePlayer:
    """One line of the table of players: the referee's words, and what the player says of itself."""

    name: str
    team: str
    role: str
    state: str
    may_move: bool
    mark: m.Pose | None = None
    mode: str = ""
    armed: bool = False
    manual: bool = False
    fault: str | None = None
    latched: bool = False


@dataclass(frozen=True)
class Scene:
    """Everything to see.

    Args:
        live: the world's clock runs. time: match time, s. rate: match seconds per real second.
        stage: None before the referee spoke. halted, waiting, clock, round, rounds, score, winner: as in
            `RefereeState`.
        estop: latched anywhere. estop_reason: who pressed it and why, if that is known.
        calls: the last ones, oldest first.
        segments, circles: walls.
    """

    live: bool = False
    time: float = 0.0
    rate: float = 1.0
    game: str = ""
    stage: m.Stage | None = None
    halted: str | None = None
    waiting: tuple[str, ...] = ()
    clock: float = 0.0
    round: int = 0
    rounds: int = 0
    score: tuple[tuple[str, int], ...] = ()
    winner: str | None = None
    estop: bool = False
    estop_reason: str = ""
    players: tuple[ScenePlayer, ...] = ()
    bodies: tuple[SceneBody, ...] = ()
    zones: tuple[m.Zone, ...] = ()
    calls: tuple[m.Call, ...] = ()
    segments: tuple[Segment, ...] = ()
    circles: tuple[Circle, ...] = ()

    def player(self, name: str) -> ScenePlayer | None:
        """The player of this name, or None."""
        return next((p for p in self.players if p.name == name), None)


class SceneBuilder:
    """Takes messages in, gives scenes out.

    Args:
        sizes: length and width of the robots in m, by name; others are 0.5 by 0.4, a Pioneer's.
        segments, circles: the map's walls.
    """

    def __init__(
        self,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        segments: Sequence[Segment] = (),
        circles: Sequence[Circle] = (),
    ) -> None:
        self._sizes = dict(sizes or {})
        self._segments = tuple(segments)
        self._circles = tuple(circles)
        self._clock: m.Clock | None = None
        self._state: m.RefereeState | None = None
        self._estop: m.Estop | None = None
        self._bodies: list[m.Body] = []
        self._trails: dict[str, deque[tuple[float, Point]]] = {}
        self._last: dict[str, Point] = {}
        self._reports: dict[str, m.Report] = {}
        self._calls: deque[m.Call] = deque(maxlen=CALLS_KEPT)

    def clock(self, clock: m.Clock) -> None:
        """Match time. After a restart of the world the trails begin anew."""
        if self._clock is not None and clock.epoch != self._clock.epoch:
            self._trails.clear()
        self._clock = clock

    def poses(self, poses: m.Poses, stamp: float) -> None:
        """Where every body is at `stamp`, s."""
        self._bodies = poses.bodies
        for body in poses.bodies:
            here = (body.pose.x, body.pose.y)
            trail = self._trails.setdefault(body.name, deque())
            if math.dist(here, self._last.get(body.name, here)) > JUMP:
                trail.clear()
            self._last[body.name] = here
            if not trail or stamp - trail[-1][0] >= TRAIL_STEP - 1e-9:
                trail.append((stamp, here))
            while trail and stamp - trail[0][0] > TRAIL_SECONDS:
                trail.popleft()

    def referee(self, state: m.RefereeState) -> None:
        """The state of the match."""
        self._state = state

    def call(self, call: m.Call) -> None:
        """A referee's call."""
        self._calls.append(call)

    def report(self, player: str, report: m.Report) -> None:
        """What a player says of itself."""
        self._reports[player] = report

    def estop(self, estop: m.Estop) -> None:
        """Somebody engaged or released the emergency stop."""
        self._estop = estop

    def build(self, live: bool) -> Scene:
        """The scene now; `live` as in `Tick`."""
        clock, state = self._clock, self._state
        stopped, reason = self._stopped()
        scene = Scene(
            live=live and clock is not None,
            time=clock.time if clock else 0.0,
            rate=clock.rate if clock else 1.0,
            estop=stopped,
            estop_reason=reason,
            bodies=tuple(self._body(body) for body in self._bodies),
            calls=tuple(self._calls),
            segments=self._segments,
            circles=self._circles,
        )
        if state is None:
            return scene
        return _with_referee(scene, state, tuple(self._player(p) for p in state.players))

    def _stopped(self) -> tuple[bool, str]:
        asked = self._estop is not None and self._estop.engaged
        latched = (self._clock is not None and self._clock.estop) or (self._state is not None and self._state.estop)
        if not asked or self._estop is None:
            return latched, ""
        by = f"pressed by {self._estop.by}"
        return True, f"{by}: {self._estop.reason}" if self._estop.reason else by

    def _body(self, body: m.Body) -> SceneBody:
        status = self._state.player(body.name) if self._state is not None else None
        length, width = self._sizes.get(body.name, (0.5, 0.4))
        return SceneBody(
            name=body.name,
            pose=body.pose,
            length=length,
            width=width,
            role=status.role if status else "",
            state=status.state if status else "",
            physical=body.physical,
            trail=tuple(point for _, point in self._trails.get(body.name, ())),
        )

    def _player(self, status: m.PlayerStatus) -> ScenePlayer:
        report = self._reports.get(status.name)
        return ScenePlayer(
            name=status.name,
            team=status.team,
            role=status.role,
            state=status.state,
            may_move=status.may_move,
            mark=status.mark,
            mode=report.mode if report else "",
            armed=report.armed if report else False,
            manual=report.manual if report else False,
            # It stands beside the name, which a fault often begins with.
            fault=report.fault.removeprefix(f"{status.name}: ") if report and report.fault else None,
            latched=report.latched if report else False,
        )


def _with_referee(scene: Scene, state: m.RefereeState, players: tuple[ScenePlayer, ...]) -> Scene:
    return replace(
        scene,
        game=state.game,
        stage=state.stage,
        halted=state.halted,
        waiting=tuple(state.waiting),
        clock=state.clock,
        round=state.round,
        rounds=state.rounds,
        score=tuple(state.score.items()),
        winner=state.winner,
        players=players,
        zones=tuple(state.zones),
    )


class SceneInlets:
    """A node's subscriptions to all that a scene is made of.

    Args:
        mailbox: the node's own. keys: of the match.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys) -> None:
        self._clock = mailbox.subscribe(keys.clock)
        self._poses = mailbox.subscribe(keys.poses)
        self._state = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._reports = mailbox.subscribe(keys.report())
        self._estop = mailbox.subscribe(keys.estop)

    def feed(self, builder: SceneBuilder) -> list[m.Call]:
        """Hand over what arrived since the last call; returns the new calls."""
        for clock in self._clock.take():
            builder.clock(clock.body)
        for poses in self._poses.take():
            builder.poses(poses.body, poses.stamp)
        for state in self._state.take():
            builder.referee(state.body)
        for report in self._reports.take():
            builder.report(name_in(report.key), report.body)
        for estop in self._estop.take():
            builder.estop(estop.body)
        calls = [call.body for call in self._calls.take()]
        for call in calls:
            builder.call(call)
        return calls


def title(word: str) -> str:
    """A name such as `sharks-and-minnows` as people write it: `Sharks and Minnows`."""
    words = word.replace("-", " ").replace("_", " ").split()
    small = {"and", "of", "the"}
    return " ".join(w if w in small and i else w[:1].upper() + w[1:] for i, w in enumerate(words))


def round_word(game: str) -> str:
    """What the game calls a round."""
    return "pass" if "minnow" in game else "round"


def clock_text(seconds: float) -> str:
    """`m:ss.t`."""
    tenths = int(seconds * 10 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"
