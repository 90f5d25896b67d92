"""Every message that travels on the bus: one frozen struct each.

Numbers are bounded, so NaN and infinity never pass. A field that is not known is None, never 0.0.
The schema version of a message is raised whenever a field changes.
"""

import enum
import math
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt
from msgspec import Meta, Struct

Metres = Annotated[float, Meta(ge=-1e5, le=1e5)]
"""A coordinate in the map's frame."""
Radians = Annotated[float, Meta(ge=-1e4, le=1e4)]
Speed = Annotated[float, Meta(ge=-100.0, le=100.0)]
"""m/s."""
AngularSpeed = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
"""rad/s."""
Seconds = Annotated[float, Meta(ge=0.0, le=1e8)]
Count = Annotated[int, Meta(ge=0)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
Signed = Annotated[float, Meta(ge=-1.0, le=1.0)]
Name = Annotated[str, Meta(min_length=1, max_length=64)]
Text = Annotated[str, Meta(max_length=2000)]
REASON_LENGTH = 300
Reason = Annotated[str, Meta(max_length=REASON_LENGTH)]
"""What a person types to explain a decision."""


class Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every message has in common."""

    version: ClassVar[int] = 1


class Pose(Struct, frozen=True, forbid_unknown_fields=True):
    """Position of a body's centre and its heading, counter-clockwise from +x, in the map's frame."""

    x: Metres
    y: Metres
    theta: Radians


class Clock(Message, frozen=True, kw_only=True):
    """Match time.

    Args:
        time: s since the world began.
        tick: number of world ticks since then.
        epoch: rises by one each time the world restarts from a snapshot, when time may step back a little.
        rate: match seconds per real second that the world aims for; 0 = as fast as it can.
        estop: the world's own latch of the emergency stop.
    """

    time: Seconds
    tick: Count
    epoch: Count
    rate: Annotated[float, Meta(ge=0.0, le=1e4)]
    estop: bool


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """One body in the world.

    Args:
        v, w: speed along its own x axis, m/s, and yaw rate, rad/s.
        physical: a robot of flesh and steel, which the world shows where it was measured.
        age: s of match time since it was measured; 0 for a virtual body.
    """

    name: Name
    pose: Pose
    v: Speed
    w: AngularSpeed
    physical: bool
    age: Seconds = 0.0


class Poses(Message, frozen=True, kw_only=True):
    """Every body at one instant."""

    version: ClassVar[int] = 2

    bodies: list[Body]


class MeasuredPose(Message, frozen=True, kw_only=True):
    """Where a physical robot was measured to be, by its own odometry or by a motion-capture system.

    Args:
        v, w: body velocity at that instant, m/s and rad/s.
    """

    pose: Pose
    v: Speed
    w: AngularSpeed


class Drive(Message, frozen=True, kw_only=True):
    """Wheel speeds in rad/s. Not armed = motors off."""

    left: AngularSpeed
    right: AngularSpeed
    armed: bool = True


class RobotState(Message, frozen=True, kw_only=True):
    """What a robot knows of itself (thesis, Appendix B).

    Args:
        ins: pose by the inertial navigation system.
        odometry: pose by wheel odometry, which drifts; zero where the robot was placed.
        v, w: body velocity by the wheels, m/s and rad/s.
        encoders: ticks of each wheel, left then right.
        touch: each bumper, True = in contact.
        battery: charge left, 0 to 1.
        armed: motors accept commands.
        estop: the emergency stop is latched.
        fault: what is wrong, in words.
    """

    ins: Pose
    odometry: Pose
    v: Speed
    w: AngularSpeed
    encoders: tuple[int, int]
    touch: list[bool]
    battery: Fraction
    armed: bool
    estop: bool
    fault: Text | None = None


class Laser(Message, frozen=True, kw_only=True):
    """One scan of a planar range finder.

    Args:
        angle_min, angle_step: of the first beam and between beams, rad in the robot's frame.
        range_max: m; a beam that met nothing reads range_max.
        data: the ranges, little-endian float32, in m.
    """

    angle_min: Radians
    angle_step: Radians
    range_max: Metres
    data: Annotated[bytes, Meta(max_length=40000)]

    def __post_init__(self) -> None:
        if len(self.data) % 4:
            raise ValueError(f"data: expected whole float32 values, got {len(self.data)} bytes")
        # A sum of float32 cannot overflow a Python float, so it is finite exactly where every range is; numpy would
        # take five times as long for a scan.
        if not math.isfinite(sum(memoryview(self.data).cast("f"))):
            raise ValueError("data: expected finite ranges")

    @property
    def ranges(self) -> npt.NDArray[np.float32]:
        """Shape (beams,), m."""
        return np.frombuffer(self.data, dtype="<f4")


class SpeedLimit(Message, frozen=True, kw_only=True):
    """The top forward speed that the referee allows a robot in this match, m/s."""

    v_max: Annotated[float, Meta(gt=0.0, le=100.0)]


class RequestKind(enum.StrEnum):
    """What the world can be asked for."""

    SPAWN = "spawn"
    REMOVE = "remove"
    RESET = "reset"
    PLACE = "place"


class WorldRequest(Message, frozen=True, kw_only=True):
    """A change to the world.

    Args:
        kind: spawn a robot of `model` at `pose`; remove it; reset it to its start pose (all of them without a
            name); place robots at `places`, all of them or none.
    """

    kind: RequestKind
    robot: Name | None = None
    model: Name | None = None
    pose: Pose | None = None
    places: dict[Name, Pose] = {}


class Report(Message, frozen=True, kw_only=True):
    """What a player says of itself.

    Args:
        mode: the automaton's mode and submode, such as `Minnow/Cross`.
        armed: its robot's motors accept commands.
        manual: a human holds the lease.
        fault: what keeps it from playing, in words.
        latched: its robot has latched a fault that only an official's `recover` clears.
    """

    version: ClassVar[int] = 2

    mode: Text
    armed: bool
    manual: bool = False
    fault: Text | None = None
    latched: bool = False


class Recover(Message, frozen=True, kw_only=True):
    """Clear the fault that the robot has latched, if it has one.

    Args:
        by: the official who asks for it.
    """

    by: Name


class Manual(Message, frozen=True, kw_only=True):
    """A human's drive command, as fractions of what the robot can do; nobody is told its top speed.

    Args:
        forward: -1 full back to 1 full ahead.
        turn: -1 full right to 1 full left.
        lease: s of match time for which it holds; at most 1. 0 gives the player back to itself.
    """

    forward: Signed
    turn: Signed
    lease: Annotated[float, Meta(ge=0.0, le=1.0)]


class Stage(enum.StrEnum):
    """The stages of a match (thesis, Algorithm 3.1)."""

    INITIALIZE = "initialize"
    PLAY_ROUND = "play_round"
    FOUL = "foul"
    ROUND_OVER = "round_over"
    GAME_OVER = "game_over"


class PlayerStatus(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A player as the referee sees it.

    Args:
        role: the game's word, such as `shark`.
        state: the game's word, such as `active` or `inactive`.
        may_move: its robot may be driven now.
        radius: of the circle around its body, m.
        pose: None where the world has not reported it, or where the game does not publish it.
        mark: where it is asked to line up, None = nowhere.
    """

    name: Name
    team: Name
    role: Name
    state: Name
    may_move: bool
    radius: Annotated[float, Meta(gt=0.0, le=100.0)]
    pose: Pose | None = None
    mark: Pose | None = None


class Zone(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A marked part of the field: an axis-aligned rectangle.

    Args:
        kind: `field`, `safe` or `start`: how it is drawn.
    """

    name: Name
    kind: Name
    x_min: Metres
    y_min: Metres
    x_max: Metres
    y_max: Metres


class RefereeState(Message, frozen=True, kw_only=True):
    """The whole state of a match that everybody may know.

    Args:
        halted: why the clock is stopped, in words; None while it is not.
        waiting: what keeps the stage from going on.
        clock: s of play in this round. total: s of play in the match.
        round, rounds: of the match, from 1; for Sharks and Minnows, passes.
        score: by team.
        winner: once the game is over; `draw` is one.
    """

    game: Name
    stage: Stage
    halted: Text | None
    waiting: list[Text]
    clock: Seconds
    total: Seconds
    round: Count
    rounds: Count
    score: dict[Name, int]
    players: list[PlayerStatus]
    zones: list[Zone]
    winner: Name | None = None
    estop: bool = False

    def player(self, name: str) -> PlayerStatus | None:
        """The player of this name, or None."""
        return next((p for p in self.players if p.name == name), None)


class Call(Message, frozen=True, kw_only=True):
    """A referee's call.

    Args:
        number: counts from 1 in a match, also across restarts of the coordinator.
        rule: the rule's short name, such as `tag` or `out_of_bounds`.
        text: the call in words.
        players: whom it concerns. poses: theirs at that instant, in the same order.
        clock: s of play in the round.
        answers: id of the official's decision that this call answers.
    """

    number: Count
    rule: Name
    text: Text
    players: list[Name]
    poses: list[Pose]
    clock: Seconds
    answers: Name | None = None


class OfficialAction(enum.StrEnum):
    """What a human official may do."""

    HALT = "halt"
    RESUME = "resume"
    END = "end"
    SET_SCORE = "set-score"
    SET_ROLE = "set-role"
    SET_STATE = "set-state"
    RECOVER = "recover"


class Official(Message, frozen=True, kw_only=True):
    """An official's decision.

    Args:
        by: who decides, for the log. reason: in words, for the log.
        subject: the team (set-score) or the player (set-role, set-state, recover; there None is everybody).
        value: the new score, role or state.
        id: of this decision, so that its sender knows the answer.
    """

    version: ClassVar[int] = 2

    action: OfficialAction
    by: Name
    reason: Reason = ""
    id: Name | None = None
    subject: Name | None = None
    value: Text | None = None


class Estop(Message, frozen=True, kw_only=True):
    """The emergency stop: engaged latches in every receiver until an explicit release."""

    engaged: bool
    by: Name
    reason: Reason = ""


class Pulse(Message, frozen=True, kw_only=True):
    """A node's own sign of life: its thread of work goes on, which a liveliness token does not tell.

    Args:
        ticks: done so far. missed: due but never done.
    """

    ticks: Count
    missed: Count
