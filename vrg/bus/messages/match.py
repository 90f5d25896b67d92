"""The messages of the referee and of the officials."""

import enum
from collections.abc import Mapping
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import Message, Reason, Text, freeze
from vrg.bus.messages.player import SIGHTINGS_LIMIT, Cost, Sighting
from vrg.regions import Region
from vrg.types import Count, Deviation, FrozenDict, Metres, Name, Pose, Radians, Seconds, Speed, Twist, Uncertainty


class Stage(enum.StrEnum):
    """The stages of a match (thesis, Algorithm 3.1, without its stage for fouls, which no game of VRG stops for)."""

    INITIALIZE = "initialize"
    PLAY_ROUND = "play_round"
    ROUND_OVER = "round_over"
    GAME_OVER = "game_over"


EMERGENCY_STOP, BY_OFFICIAL = "emergency_stop", "official"
"""The causes of halts that people have asked for; see `Call`."""
DISQUALIFIED = "disqualified"
"""The state of a player that is out because it, or its process, has failed. Every game has it."""
FAILED = "failed"
"""The value of the action `disqualify` if the player's process has failed, rather than a person has decided it."""


class PlayerStatus(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, gc=False):
    """A player as the referee sees it.

    Args:
        name: its name. team: the team that it plays for during the whole match.
        role: its role in the game's own word, such as `shark`.
        state: its state in the game's own word, such as `active` or `inactive`; or `disqualified`.
        may_move: True if its robot may be driven now.
        radius: the radius of the circle around its body, m.
        pose: its pose in the map's frame; None where the world has not reported it, or where the game does not
            publish it.
        mark: the pose in the map's frame at which it is asked to line up; None if it is not asked to.
        lease: the motion that the referee itself makes its robot drive now, whatever the player wants; None while the
            referee does not drive it.
    """

    name: Name
    team: Name
    role: Name
    state: Name
    may_move: bool
    radius: Annotated[float, Meta(gt=0.0, le=100.0)]
    pose: Pose | None = None
    mark: Pose | None = None
    lease: Twist | None = None


LARGE_ZONES = ("field", "half")
"""The kinds of zones in which there are other zones, and may be walls."""


class Zone(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, gc=False):
    """A marked part of the field.

    Args:
        name: the word that is written on it.
        kind: `field`, `half`, `safe`, `start` or a word of the game's own. It decides how the zone is drawn, and
            players find the zone by it.
        region: where it is, in the map's frame.
        team: the team that it belongs to; None if it belongs to none.
    """

    name: Name
    kind: Name
    region: Region
    team: Name | None = None


OBJECTS_LIMIT = 100
"""The number of objects on a field."""


class FieldObject(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """A thing of the game that is no robot, such as a flag or a ball. Robots drive through what is no passive body.

    Args:
        name: its name, unique in the match. kind: what it is, such as `flag`.
        x, y: its place in the map's frame, m, while it is not carried.
        team: the team that it belongs to; None if it belongs to none.
        carrier: the player that carries it; None if none does.
        heading: rad. vx, vy: its velocity in the map's frame, m/s.
        radius: of a disc, m. corners: of a convex outline in its own frame, m. What has neither is drawn as a flag.
        lost: True if it is a real one that no source has seen for LOST; its place is then where it was seen last.
    """

    name: Name
    kind: Name
    x: Metres
    y: Metres
    team: Name | None = None
    carrier: Name | None = None
    heading: Radians = 0.0
    vx: Speed = 0.0
    vy: Speed = 0.0
    radius: Deviation = 0.0
    corners: tuple[tuple[Metres, Metres], ...] = ()
    lost: bool = False

    @property
    def is_body(self) -> bool:
        """True if it is a body that robots push."""
        return bool(self.radius or self.corners)


AUCTIONS_LIMIT = 1000
"""The number of auctions of a match, and that of the bidders in one."""


class Auction(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An auction of the referee among players. The lowest bid wins, and of equal ones that of the lowest name.

    Args:
        lot: the name of what is auctioned. bidders: the players that may bid.
        opened: the time of play in this round at which it was opened, s. lasts: how long it is open at least, s.
        bids: the bids so far, by player.
        winner: the player that has won; None while the auction is open.
        evidence: sightings that belong to the lot, oldest first.
    """

    lot: Name
    bidders: Annotated[tuple[Name, ...], Meta(max_length=AUCTIONS_LIMIT)]
    opened: Seconds
    lasts: Seconds
    bids: Mapping[Name, Cost] = FrozenDict()
    winner: Name | None = None
    evidence: Annotated[tuple[Sighting, ...], Meta(max_length=SIGHTINGS_LIMIT)] = ()

    def __post_init__(self) -> None:
        freeze(self, "bids")


TIME_LIMIT = "time limit"
"""Among the numbers of a match: the time of play in s at which the round ends at the latest."""


class RefereeState(Message, frozen=True, kw_only=True):
    """The whole state of a match that everybody may know.

    Args:
        game: the name of the game. stage: the stage of the match, one of the values of `Stage`.
        halted: why play is halted, in words; None while it is not.
        way_out: how play can go on again, in words; None while it is not halted.
        waiting: the reasons why the stage does not go on.
        clock: the time of play in this round, s. total: the time of play in the match, s.
        round: the number of this round, from 1. rounds: how many there are. In Sharks and Minnows a round is a pass.
        score: the points of each team.
        players: every player of the match. zones: the marked parts of the field, as they are in this round.
        auctions: the auctions that are open, or whose winner still has what it has won.
        objects: the things of the game that are no robots, such as flags.
        numbers: numbers of the rules that players need to know, by name, such as a distance in m.
        winner: the winning team when the game is over; `draw` is possible.
        ended: who ended the game before its end, and why, in words; None if it was not ended.
        estop: True while the emergency stop is engaged.
        unproved: True while what the referee decides by cannot be written, so that it cannot be judged again.
    """

    version = 8

    game: Name
    stage: Stage
    halted: Text | None
    way_out: Text | None
    waiting: tuple[Text, ...]
    clock: Seconds
    total: Seconds
    round: Count
    rounds: Count
    score: Mapping[Name, int]
    players: tuple[PlayerStatus, ...]
    zones: tuple[Zone, ...]
    auctions: Annotated[tuple[Auction, ...], Meta(max_length=AUCTIONS_LIMIT)] = ()
    objects: Annotated[tuple[FieldObject, ...], Meta(max_length=OBJECTS_LIMIT)] = ()
    numbers: Mapping[Name, float] = FrozenDict()
    winner: Name | None = None
    ended: Text | None = None
    estop: bool = False
    unproved: bool = False

    def __post_init__(self) -> None:
        freeze(self, "score", "numbers")

    def player(self, name: str) -> PlayerStatus | None:
        """The player of this name, or None."""
        return next((p for p in self.players if p.name == name), None)

    def object(self, name: str) -> FieldObject | None:
        """The object of this name, or None."""
        return next((thing for thing in self.objects if thing.name == name), None)

    def auction(self, lot: str) -> Auction | None:
        """The auction of this lot, or None."""
        return next((auction for auction in self.auctions if auction.lot == lot), None)


class Sight(Message, frozen=True, kw_only=True):
    """The poses of the players that one team sees, in a match in which a team does not see everybody.

    Args:
        poses: the poses in the map's frame, by player. Those of the team itself are among them.
    """

    poses: Mapping[Name, Pose]

    def __post_init__(self) -> None:
        freeze(self, "poses")


class Call(Message, frozen=True, kw_only=True):
    """A call of the referee. A rule book makes it without number, clock and uncertainty, which the coordinator adds.

    Args:
        number: counts the calls of a match from 1, also across restarts of the coordinator; 0 if it is not announced.
        rule: the rule's short name, such as `tag` or `out_of_bounds`.
        text: the call in words.
        players: the players that it concerns. poses: the poses of the first of them at that instant, in the same order;
            those that not everybody may know are left out. A call that concerns no player may have one: where it was.
        clock: the time of play in the round, s.
        answers: the id of the official's decision that this call answers; None if it answers none.
        uncertainty: how well the poses are known, by player, of those for which that is known.
        why: the reason alone, in words, of a halt, a refusal, a disqualification or the end of the game; else empty.
        cause: of a halt: EMERGENCY_STOP, BY_OFFICIAL, or empty for all others.
    """

    version = 3

    number: Count = 0
    rule: Name
    text: Text
    players: tuple[Name, ...] = ()
    poses: tuple[Pose, ...] = ()
    clock: Seconds = 0.0
    answers: Name | None = None
    uncertainty: Mapping[Name, Uncertainty] = FrozenDict()
    why: Text = ""
    cause: Text = ""

    def __post_init__(self) -> None:
        freeze(self, "uncertainty")


class OfficialAction(enum.StrEnum):
    """The decisions that a human official may make."""

    HALT = "halt"
    RESUME = "resume"
    END = "end"
    SET_SCORE = "set-score"
    SET_ROLE = "set-role"
    SET_STATE = "set-state"
    RECOVER = "recover"
    PLACE = "place"
    DISQUALIFY = "disqualify"
    REINSTATE = "reinstate"


class Official(Message, frozen=True, kw_only=True):
    """An official's decision.

    Args:
        by: who decides, for the journal. reason: why, in words, for the journal.
        subject: the team (set-score) or the player (all others). For recover, None means all.
        value: the new score, role or state. For place it is `x y heading` in m and degrees; None means the player's
            mark. For disqualify it is `failed` if the player's process has failed: the player then comes back by itself
            once it reports again.
        id: the id of this decision, by which its sender finds the answer.
    """

    version = 3

    action: OfficialAction
    by: Name
    reason: Reason = ""
    id: Name | None = None
    subject: Name | None = None
    value: Text | None = None


class Estop(Message, frozen=True, kw_only=True):
    """An order that engages the emergency stop. It stays latched in every receiver until an `EstopRelease`.

    Args:
        by: who orders it. reason: why, in words.
    """

    version = 2

    by: Name
    reason: Reason = ""


class EstopRelease(Message, frozen=True, kw_only=True):
    """An order that releases the emergency stop. It has a key of its own, because only officials may give it.

    Args:
        by: who orders it. reason: why, in words.
    """

    by: Name
    reason: Reason = ""
