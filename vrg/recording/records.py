"""VRG's own records in a recording: the messages of the referee and the players.

They are the messages of the bus as a viewer needs them. They carry their time; a text that is not known is empty and
not null, because a viewer's reader of schemas knows no unions; the ids by which officials match answers are left out.
"""

from collections.abc import Mapping

from msgspec import UNSET, Struct, UnsetType

from vrg.bus.messages import Auction, FieldObject, Sighting, Zone
from vrg.recording.foxglove import Time
from vrg.types import Pose, Twist


class PlayerRecord(Struct, frozen=True, gc=False):
    """A player as the referee saw it. `mark` is where it was asked to line up, or empty: viewers know no null.

    `lease` is the motion that the referee made its robot drive, or empty; older releases have not recorded it.
    """

    name: str
    team: str
    role: str
    state: str
    may_move: bool
    mark: tuple[Pose, ...] = ()
    lease: tuple[Twist, ...] | UnsetType = UNSET


class StateRecord(Struct, frozen=True, gc=False):
    """vrg.RefereeState: the state of the match. Texts are empty where there is none."""

    timestamp: Time
    game: str
    stage: str
    halted: str
    way_out: str
    waiting: tuple[str, ...]
    clock: float
    total: float
    round: int
    rounds: int
    score: Mapping[str, int]
    winner: str
    estop: bool
    players: tuple[PlayerRecord, ...]
    zones: tuple[Zone, ...]
    auctions: tuple[Auction, ...] = ()
    objects: tuple[FieldObject, ...] = ()
    numbers: Mapping[str, float] = {}
    ended: str = ""
    unproved: bool = False


class ReportRecord(Struct, frozen=True, gc=False):
    """vrg.Report: a player's report about itself. `fault` is empty where it has none.

    What changes all the time is in records of its own: the command, and the battery.
    """

    timestamp: Time
    mode: str
    armed: bool
    manual: bool
    fault: str
    latched: bool
    estop: bool


class TwistRecord(Struct, frozen=True, gc=False):
    """vrg.Twist: a motion in the robot's own frame, v in m/s, w in rad/s, side in m/s to the left."""

    timestamp: Time
    v: float
    w: float
    side: float = 0.0

    @classmethod
    def of(cls, at: Time, twist: Twist) -> "TwistRecord":
        """The record of a motion at a time."""
        return cls(at, twist.v, twist.w, twist.side)

    @property
    def twist(self) -> Twist:
        """The motion."""
        return Twist(self.v, self.w, self.side)


class MotionRecord(Struct, frozen=True, gc=False):
    """vrg.Motion: what a robot has measured of its motion: its pose since its odometry began, and its velocity.

    Lengths in m, angles in rad, in the frames of the odometry and of the robot.
    """

    timestamp: Time
    odometry: Pose
    twist: Twist


class RestRecord(Struct, frozen=True, gc=False):
    """vrg.Rest: whether a robot is at rest, when that changes.

    `since` is the match time of the world's tick since which it has been so, s, which may be before this record.
    `resolution` tells how long before that, s, it was last known to move, or to be at rest somewhere else.
    """

    timestamp: Time
    at_rest: bool
    since: float
    resolution: float


class EstopRecord(Struct, frozen=True, gc=False):
    """vrg.Estop: an order that engages or releases the emergency stop."""

    timestamp: Time
    engaged: bool
    by: str
    reason: str


class BatteryRecord(Struct, frozen=True, gc=False):
    """vrg.Battery: the charge of a battery, from 1 (full) to 0 (empty)."""

    timestamp: Time
    charge: float


class SightingsRecord(Struct, frozen=True, gc=False):
    """vrg.Sightings: the unknown robots that a player has reported to the referee."""

    timestamp: Time
    seen: tuple[Sighting, ...]


class CallRecord(Struct, frozen=True, gc=False):
    """vrg.Call: a referee's call with the players it concerns and their poses.

    `clock` is s of play in the round, and `round` is the round that was being played.
    """

    timestamp: Time
    number: int
    rule: str
    text: str
    players: tuple[str, ...]
    poses: tuple[Pose, ...]
    clock: float
    round: int
    why: str = ""
    cause: str = ""
