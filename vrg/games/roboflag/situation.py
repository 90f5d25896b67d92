"""The knowledge of a player of RoboFlag at one tick, sorted for its decisions. All places: m in the map's frame."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from vrg.agents.strategy import View
from vrg.bus.messages import Auction, RefereeState
from vrg.games.roboflag import FLAG_ZONE, FLAGGED, HALF, HOME, NORMAL, TAG_DISTANCE, TAGGED, attack_of, flag_of, other
from vrg.regions import Circle, Region, Sector
from vrg.shared import shared
from vrg.types import Vector, quantised

BORDER_CLEARANCE = 0.4
"""The distance in m that a body's centre keeps from the border of the field."""
HAVEN = 0.2
"""The distance in m inside its home zone to which a carrier drives."""
IN_PLAY = (NORMAL, TAGGED, FLAGGED)
"""The states of players that are not disqualified."""
MEMORY = 3.0
"""The match time in s for which a player remembers where it last saw an opponent that it does not see any more."""


@dataclass(frozen=True)
class TeamField:
    """The parts of the field, as a player of one team sees them.

    Args:
        field: the whole field. own_half: the half of the team.
        home: the home zone of the team. own_zone, their_zone: the flag zones.
        own_flag, their_flag: the places of the flags.
        inner: the part of the field in which bodies' centres should be.
        haven: a region inside the home zone, to which a carrier drives.
        ahead: 1 if the opponents are in the direction of +x, -1 if they are in that of -x.
        midline: the x of the midline.
        tag_distance: the distance between centres at which a player is tagged.
    """

    field: Region
    own_half: Region
    home: Sector
    own_zone: Circle
    their_zone: Circle
    own_flag: Vector
    their_flag: Vector
    inner: Region
    haven: Region
    ahead: float
    midline: float
    tag_distance: float

    @classmethod
    def of(cls, view: View) -> "TeamField | None":
        """The ground as the referee publishes it, or None if parts of it are missing."""
        team, regions = view.me.team, {(zone.kind, zone.team): zone.region for zone in view.referee.zones}
        field, half, home = (regions.get(key) for key in (("field", None), (HALF, team), (HOME, team)))
        own, theirs = (regions.get((FLAG_ZONE, of)) for of in (team, other(team)))
        if field is None or half is None:
            return None
        if not (isinstance(home, Sector) and isinstance(own, Circle) and isinstance(theirs, Circle)):
            return None
        ahead = 1.0 if theirs.x > own.x else -1.0
        bounds = half.bounds
        return cls(
            field=field,
            own_half=half,
            home=home,
            own_zone=own,
            their_zone=theirs,
            own_flag=(own.x, own.y),
            their_flag=(theirs.x, theirs.y),
            inner=field.shrunk(BORDER_CLEARANCE),
            haven=home.shrunk(HAVEN),
            ahead=ahead,
            midline=bounds[2] if ahead > 0 else bounds[0],
            tag_distance=view.referee.numbers.get(TAG_DISTANCE, theirs.radius),
        )

    def beyond(self, x: float) -> float:
        """The distance in m by which a place with this x is on the opponents' side of the midline; negative on the own
        side."""
        return (x - self.midline) * self.ahead


@dataclass(frozen=True, slots=True)
class Known:
    """A player whose place is known.

    Args:
        place: m. velocity: m/s. state: in the game's word. team: its team. radius: of the circle around its body, m.
    """

    name: str
    place: Vector
    velocity: Vector
    state: str
    team: str
    radius: float

    def away(self, place: Vector) -> float:
        """The distance of a place, m, rounded: who is nearest is decided by names where two are as near."""
        return quantised(math.dist(self.place, place))


@dataclass(frozen=True)
class Situation:
    """The data that a player decides by.

    Args:
        ground: the parts of the field. me: this player.
        mates: the other players of the team whose places are known. opponents: those of the other team.
        carrier: the own player that carries the opponents' flag, or None. thief: the opponent with the own flag.
        auction: the auction of who attacks; None while there is none. round: the number of the round.
        targets: the announced targets of team mates, by mate.
    """

    ground: TeamField
    me: Known
    mates: Sequence[Known]
    opponents: Sequence[Known]
    carrier: str | None
    thief: str | None
    auction: Auction | None
    round: int
    targets: Mapping[str, str]

    @cached_property
    def team(self) -> list[Known]:
        """The players of the team that are in play, by name."""
        return sorted((k for k in (self.me, *self.mates) if k.state != TAGGED), key=lambda known: known.name)

    @cached_property
    def hunters(self) -> list[Known]:
        """The opponents that can tag a player."""
        return [opponent for opponent in self.opponents if opponent.state in (NORMAL, FLAGGED)]

    @cached_property
    def ranked(self) -> list[str]:
        """The normal players of the team in the order of their bids for the attack, the winner first."""
        auction = self.auction
        bids = {} if auction is None else auction.bids
        winner = None if auction is None else auction.winner
        names = [known.name for known in self.team if known.state == NORMAL]
        return sorted(names, key=lambda name: (name != winner, bids.get(name, math.inf), name))

    @cached_property
    def threats(self) -> list[Known]:
        """The opponents to tag: who carries the own flag, and who is on the own half outside a flag zone."""
        ground = self.ground
        found = []
        for opponent in self.hunters:
            invades = ground.beyond(opponent.place[0]) <= 0.0
            if opponent.name == self.thief or (invades and not ground.own_zone.contains(*opponent.place)):
                found.append(opponent)
        return found


class Memory:
    """The last known places of others, for matches in which a team does not see everybody."""

    def __init__(self) -> None:
        self._last: tuple[float, Sequence[Known]] = (0.0, ())
        self._gone: dict[str, tuple[float, Known]] = {}

    def recall(self, view: View, seen: Sequence[Known]) -> list[Known]:
        """Those that were seen a moment ago and are not seen now, where they were then, as if they stood."""
        (time, before), self._last = self._last, (view.time, seen)
        if len(seen) == len(view.referee.players) and not self._gone:
            return []
        visible = {known.name for known in seen}
        self._gone |= {known.name: (time, known) for known in before if known.name not in visible}
        self._gone = {
            name: (time, known)
            for name, (time, known) in self._gone.items()
            if name not in visible and 0.0 <= view.time - time <= MEMORY
        }
        states = {player.name: player.state for player in view.referee.players}
        return [
            replace(known, velocity=(0.0, 0.0), state=states.get(name, known.state))
            for name, (_, known) in self._gone.items()
        ]


def situation_of(view: View, ground: TeamField, memory: Memory, targets: Mapping[str, str]) -> Situation:
    """Sort what a player sees.

    Args:
        ground: the parts of the field. memory: of this player. targets: as for `Situation`.
    """
    state, me = view.referee, view.me
    seen = _seen(state, view.velocities)
    known = [*seen, *memory.recall(view, seen)]
    own, theirs = state.object(flag_of(me.team)), state.object(flag_of(other(me.team)))
    return Situation(
        ground=ground,
        me=Known(me.name, view.position, view.velocities.get(me.name, (0.0, 0.0)), me.state, me.team, me.radius),
        mates=[k for k in known if k.team == me.team and k.name != me.name and k.state in IN_PLAY],
        opponents=[k for k in known if k.team != me.team and k.state in IN_PLAY],
        carrier=None if theirs is None else theirs.carrier,
        thief=None if own is None else own.carrier,
        auction=state.auction(attack_of(me.team)),
        round=state.round,
        targets=targets,
    )


@shared
def _seen(state: RefereeState, velocities: Mapping[str, Vector]) -> tuple[Known, ...]:
    """The players whose poses are known."""
    return tuple(
        Known(
            player.name,
            (player.pose.x, player.pose.y),
            velocities.get(player.name, (0.0, 0.0)),
            player.state,
            player.team,
            player.radius,
        )
        for player in state.players
        if player.pose is not None
    )
