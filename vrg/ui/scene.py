"""The visible state of a match at one instant. This knows no window and draws nothing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from vrg.bus.messages import Call, FieldObject, Stage, Zone
from vrg.regions import Region
from vrg.types import Pose, Uncertainty, Vector

JUMP: Final = 1.0
"""m; a body that moved further between two messages was placed there, it did not drive."""


@dataclass(frozen=True)
class SceneBody:
    """One robot to draw.

    Args:
        pose: of its centre. length, width: m.
        role, state: the referee's words, empty for a body that plays no part.
        out_of_play: it is only an obstacle.
        trail: where it was, oldest first, m.
        uncertainty: how well its pose is known; None if that is not known.
    """

    name: str
    pose: Pose
    length: float
    width: float
    role: str
    state: str
    physical: bool
    trail: tuple[Vector, ...]
    out_of_play: bool = False
    uncertainty: Uncertainty | None = None


@dataclass(frozen=True)
class ScenePlayer:
    """One line of the table of players: the referee's words, and the player's report.

    Args:
        mark: where it is asked to line up, or None.
        speed: how fast its robot moves ahead, m/s, negative backwards; None where it is not known.
        battery: the charge of its robot's battery, from 1 (full) to 0 (empty), or None where that is not measured.
        manual: a person holds it. fault: what keeps it from playing, in words, or None.
        latched: only an official's `recover` clears its robot's fault.
        out_of_play: its robot is only an obstacle. leased: the referee drives it.
    """

    name: str
    team: str
    role: str
    state: str
    may_move: bool
    mark: Pose | None = None
    speed: float | None = None
    battery: float | None = None
    mode: str = ""
    armed: bool = False
    manual: bool = False
    fault: str | None = None
    latched: bool = False
    out_of_play: bool = False
    leased: bool = False

    @property
    def by_hand(self) -> bool:
        """True if a person drives it now: the referee's lease goes first."""
        return self.manual and not self.leased


@dataclass(frozen=True)
class SceneStroke:
    """A dot (one point) or a line that a player wants to be shown.

    Args:
        player, role: whose it is; the role decides the colour. points: m.
        label: a text beside the last point, or empty.
    """

    player: str
    role: str
    points: tuple[Vector, ...]
    label: str = ""


@dataclass(frozen=True)
class SceneObject:
    """A thing of the game that is no robot, such as a flag.

    Args:
        team: the team that it belongs to, or empty. at: where it is, m. carrier: the player that carries it, or empty.
        heading: rad. radius, corners: the form of a body, m; one that has neither is drawn as a flag.
        lost: no source sees it, and it was there last.
    """

    name: str
    kind: str
    team: str
    at: Vector
    carrier: str = ""
    heading: float = 0.0
    radius: float = 0.0
    corners: tuple[Vector, ...] = ()
    lost: bool = False

    @property
    def is_body(self) -> bool:
        """True if it is a body that robots push."""
        return bool(self.radius or self.corners)

    @property
    def words(self) -> str:
        """Its place, in words; empty for a body that is seen, which is nowhere at home."""
        if self.lost:
            return f"{self.name} is lost"
        if self.is_body and not self.carrier:
            return ""
        return f"{self.name} carried by {self.carrier}" if self.carrier else f"{self.name} in its place"


def objects_of(
    objects: Sequence[FieldObject], robots: Mapping[str, Pose], things: Mapping[str, Pose]
) -> tuple[SceneObject, ...]:
    """The things of the game. What is carried is where its carrier is, and a body where the world has it now.

    Args:
        robots, things: the poses of the robots and of the passive bodies, by name.
    """
    found = []
    for thing in objects:
        pose = robots.get(thing.carrier or "") or things.get(thing.name) or Pose(thing.x, thing.y, thing.heading)
        heading = pose.theta if thing.is_body else 0.0
        form = heading, thing.radius, thing.corners, thing.lost
        found.append(
            SceneObject(thing.name, thing.kind, thing.team or "", (pose.x, pose.y), thing.carrier or "", *form)
        )
    return tuple(found)


@dataclass(frozen=True)
class Flash:
    """Something that the referee has just called, shown for a moment where it happened.

    Args:
        at: where, m. word: what it is, such as `tag`. share: how much of the moment is over, 0 to 1.
    """

    at: Vector
    word: str
    share: float


@dataclass(frozen=True)
class Scene:
    """Everything to see.

    Args:
        live: the world's clock runs. left: the match has ended for good, and this is how it was left.
        time: match time, s. rate: match seconds per real second.
        game: its name, empty before the referee spoke; `vrg.games.game_of` returns its look.
        stage: None before the referee spoke.
        halted, way_out, waiting, clock, round, rounds, score, winner, ended, unproved, numbers: as in `RefereeState`.
        reason: the last call by which a team came nearer to winning; None before one. reason_round: its round.
        estop: the emergency stop is latched anywhere. estop_reason: who pressed it and why, if that is known.
        calls: the last ones, oldest first. flashes: what was called a moment ago, oldest first.
        obstacles: the ground that walls and obstacles cover, m.
        strokes: what players want to be shown about what they think.
        objects: the things of the game that are no robots.
        starts: where bodies were first, m.
    """

    live: bool = False
    left: bool = False
    time: float = 0.0
    rate: float = 1.0
    game: str = ""
    stage: Stage | None = None
    halted: str | None = None
    way_out: str | None = None
    waiting: tuple[str, ...] = ()
    clock: float = 0.0
    round: int = 0
    rounds: int = 0
    score: tuple[tuple[str, int], ...] = ()
    winner: str | None = None
    ended: str | None = None
    unproved: bool = False
    numbers: Mapping[str, float] = field(default_factory=dict)
    reason: Call | None = None
    reason_round: int = 0
    estop: bool = False
    estop_reason: str = ""
    players: tuple[ScenePlayer, ...] = ()
    bodies: tuple[SceneBody, ...] = ()
    zones: tuple[Zone, ...] = ()
    calls: tuple[Call, ...] = ()
    flashes: tuple[Flash, ...] = ()
    obstacles: tuple[Region, ...] = ()
    strokes: tuple[SceneStroke, ...] = ()
    objects: tuple[SceneObject, ...] = ()
    starts: tuple[Vector, ...] = ()

    def player(self, name: str) -> ScenePlayer | None:
        """The player of this name, or None."""
        return next((p for p in self.players if p.name == name), None)


def clock_text(seconds: float) -> str:
    """A time in s as people read it: `m:ss.t`."""
    tenths = int(seconds * 10 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"


def speed_text(speed: float) -> str:
    """A speed in m/s with one digit after the point."""
    # A robot that stands still may be measured to creep backwards: that is no "-0.0".
    return f"{round(speed, 1) + 0.0:.1f}"
