"""The strategy of a pursuer (thesis 4.2.4): watch, bid, go where the intruder can be met, and drive back."""

import math

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.agents.interception import Interception, intercept
from vrg.agents.perception.tracking import Track
from vrg.agents.strategy import Action, Strategy, View
from vrg.bus.messages import SKETCH_LIMIT, Auction, Sighting, Stroke
from vrg.games.pursuit_evasion import AREA, DISPATCHED, RETURNING, SIGHTINGS_AT_ONCE, WATCHING
from vrg.games.pursuit_evasion.talk import words
from vrg.games.pursuit_evasion.watch import IntruderDetector, out_of_play
from vrg.hal.models import RobotModel
from vrg.hal.sensors.odometry import Odometry
from vrg.navigation.avoidance import Obstacle
from vrg.navigation.control import go_to, linearise, scaled
from vrg.navigation.motion import TopSpeed
from vrg.navigation.pilot import OFFSET, Pilot
from vrg.portable.scalars import square
from vrg.regions import Rectangle, Region
from vrg.types import STILL, Twist, Vector

CAPTURE_REACH = 0.8
"""The distance in m to an intruder that a pursuer aims at when it cannot meet its centre: less than the rule's 1 m."""
AREA_MARGIN = 1.5
"""The distance in m by which a pursuer may drive out of the area's bounds."""
CLEARANCE = 0.15
"""The distance in m by which other robots may be elsewhere than it knows."""
HOPE = 1.5
"""The time in s for which a pursuer goes on after an intruder that it can no longer meet, before it gives it back."""
SNAPSHOT_EVERY = 2.0
"""The time in s between two messages with the snapshot."""
SURE = 0.4
"""The standard deviation of an intruder's velocity in m/s below which a pursuer bids for it."""
LAST_WORD = 0.3
"""The time in s before the end of an auction from which a bid is not withdrawn any more."""
BID_STEP = 0.2
"""The change of a bid in s that is worth a new bid."""
SKETCH_EVERY = 0.2
"""The time in s between two sketches."""
CROSSING_TIME = 60.0
"""The time in s within which an intruder has come to the area, if it comes at all."""
FARTHEST = 1e5
"""The largest coordinate that a message can tell, m."""
SKETCHED = 12
"""The number of sightings of an intruder that are sketched."""


class Pursuer(Strategy):
    """Finds intruders with its laser and the sightings of its team, and meets the one that it is dispatched to.

    Attributes:
        k: the gain of eq. 4.4, 0 < k <= 1: it wants to be at the meeting point in the fraction k of the time that the
            intruder needs.
    """

    k = 1.0

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._automaton = Automaton(self.agent())
        self._watch = IntruderDetector(robot)
        self._top_speed = TopSpeed(robot.v_max)
        self._pilot = Pilot()
        self._snapshot_said = -math.inf
        self._hopeless_since: float | None = None
        self._meeting: Interception | None = None
        self._sketched = False
        self._lots: dict[str, Auction] = {}
        self._sketch_at = -math.inf
        self._tracks: dict[str, Track | None] = {}
        self._known: dict[str, tuple[tuple[Sighting, ...], int]] = {}

    @property
    def mode(self) -> str:
        """The mode and submode of the automaton, such as `Pursuer/Intercept`."""
        return self._automaton.where

    def act(self, view: View) -> Action:
        """Look, drive by the automaton, and report to the team and the referee."""
        at_post = self._automaton.submode in (None, "Watch") and not _driving(view)
        self._watch.look(view, standing=at_post)
        if view.speed is not None:
            self._top_speed.update(view.time, view.speed)
        self._forget(view)
        self._tracks = {lot: self._track_of(auction) for lot, auction in self._lots.items()}
        self._meeting = None
        twist = self._automaton.step(view)
        bids = self._bids(view)
        lost = self._given_up(view)
        return Action(
            twist,
            say=self._words(view),
            sightings=self._watch.fresh[:SIGHTINGS_AT_ONCE],
            bids=bids if lost is None else {lost: None},
            sketch=self._sketch(view),
        )

    def agent(self) -> Agent[View, Twist]:
        """The automaton of a pursuer, in the style of Figure 4.6."""
        pursuer = Mode(
            "Pursuer",
            [
                Submode("Watch", lambda _: STILL),
                Submode("Intercept", self._intercept),
                Submode("Return", self._return),
            ],
            [
                Transition[View]("Watch", "Intercept", "Dispatch", lambda v: v.me.state == DISPATCHED),
                Transition("Return", "Intercept", "Dispatch", lambda v: v.me.state == DISPATCHED),
                Transition("Intercept", "Return", "Reset", lambda v: v.me.state != DISPATCHED),
                Transition("Watch", "Return", "OffPost", _away),
                Transition("Return", "Watch", "AtPost", lambda v: not _away(v)),
            ],
        )
        return Agent(
            name="Pursuer",
            modes=[pursuer],
            transitions=[],
            initial=lambda _: "Pursuer",
            starts=[("Pursuer", "Start")],
            inputs=["referee state", "laser", "INS", "wheel speed", "radio"],
            outputs=["twist", "sightings", "bids", "radio"],
        )

    def _intercept(self, view: View) -> Twist:
        """Drive straight to where the intruder can be met."""
        auction = _won(view)
        track = None if auction is None else self._tracks[auction.lot]
        if track is None:
            return STILL
        self._meeting = self._meet(view, track, bold=True)
        point = track.line.at(view.time) if self._meeting is None else self._meeting.point
        way = point[0] - view.pose.x, point[1] - view.pose.y
        if math.hypot(*way) < OFFSET:
            # It is there before the intruder, and turns to it.
            x, y = track.line.at(view.time)
            turn = linearise(scaled((x - view.pose.x, y - view.pose.y), 0.1), view.pose.theta, OFFSET)
            return Twist(0.0, turn.w)
        return self._steer(view, scaled(way, self.robot.v_max))

    def _return(self, view: View) -> Twist:
        post = view.me.mark
        if post is None:
            return STILL
        if math.dist(view.position, (post.x, post.y)) > 1.0:
            return self._steer(view, scaled((post.x - view.pose.x, post.y - view.pose.y), self.robot.v_max))
        return go_to(post, view.pose, d=OFFSET, speed=0.5 * self.robot.v_max, reach=0.3)

    def _meet(self, view: View, track: Track, *, bold: bool) -> Interception | None:
        """The place and time at which it can meet an intruder that has not left: by eq. 4.4, or in its reach if bold.

        The time of the result counts from now.
        """
        line = track.line
        here, target = view.position, line.at(view.time)
        tries = [(0.0, self.k)] + ([(CAPTURE_REACH, 1.0)] if bold else [])
        for reach, k in tries:
            met = intercept(here, self._top_speed.value, target, line.velocity, reach=reach, k=k)
            if met is not None and _counts(view, target, line.velocity, met.point):
                return met
        return None

    def _bids(self, view: View) -> dict[str, float | None]:
        """Its new bids: the time to meet the intruder, or None where it cannot meet it any more."""
        bids: dict[str, float | None] = {}
        if _won(view) is not None:
            return bids
        for auction in view.referee.auctions:
            if auction.winner is not None or self.name not in auction.bidders:
                continue
            track = self._tracks[auction.lot]
            if track is None or max(track.line.velocity_covariance.diagonal()) > square(SURE):
                continue  # a few more sightings make it a better bid
            met = self._meet(view, track, bold=False)
            before = auction.bids.get(self.name)
            if met is None:
                # Just before the end it may have won already, and would give the intruder back.
                open_for = auction.opened + auction.lasts - view.referee.clock
                if before is not None and open_for > LAST_WORD:
                    bids[auction.lot] = None
            elif before is None or abs(before - met.time) > BID_STEP:
                bids[auction.lot] = round(met.time, 3)
        return bids

    def _forget(self, view: View) -> None:
        """Forget the intruders whose auctions were closed: they are captured or have escaped."""
        lots = {auction.lot: auction for auction in view.referee.auctions}
        for lot, auction in self._lots.items():
            if lot not in lots:
                self._watch.tracker.forget(self._watch.timely(auction.evidence))
        self._lots = lots

    def _track_of(self, auction: Auction) -> Track | None:
        """The intruder of an auction. Only new evidence can make it another one."""
        evidence, number = self._known.get(auction.lot, ((), 0))
        track = self._watch.tracker.numbered(number) if evidence == auction.evidence else None
        if track is None:
            track = self._watch.tracker.track_of(self._watch.timely(auction.evidence))
            self._known[auction.lot] = (auction.evidence, 0 if track is None else track.number)
        return track

    def _given_up(self, view: View) -> str | None:
        """The intruder that it was dispatched to and has not been able to meet for HOPE seconds, or None."""
        auction = _won(view)
        if auction is None or self._meeting is not None or self._automaton.submode != "Intercept":
            self._hopeless_since = None
            return None
        if self._hopeless_since is None:
            self._hopeless_since = view.time
        return auction.lot if view.time - self._hopeless_since > HOPE else None

    def _words(self, view: View) -> object:
        snapshot = None
        if self._watch.own is not None and view.time - self._snapshot_said >= SNAPSHOT_EVERY:
            self._snapshot_said, snapshot = view.time, self._watch.own
        odometry = view.readings.latest(Odometry)
        twist = STILL if odometry is None or not view.me.may_move else odometry.value.twist
        return words(view.pose, twist, self._watch.fresh, snapshot)

    def _sketch(self, view: View) -> list[Stroke] | None:
        """The sightings and the course of each intruder that it knows, and where it will meet its own."""
        if view.time < self._sketch_at:
            return None
        self._sketch_at = view.time + SKETCH_EVERY
        strokes: list[Stroke] = []
        won = _won(view)
        own = None if won is None else self._tracks[won.lot]
        for track in self._watch.tracker.tracks:
            if track.line.count < 2:
                continue
            strokes += [Stroke(points=((s.x, s.y),)) for s in track.sightings[-SKETCHED:]]
            ahead = self._meeting.time if self._meeting is not None and track is own else 0.0
            strokes.append(Stroke(points=(track.line.at(track.line.first), track.line.at(view.time + ahead))))
        if self._meeting is not None:
            label = f"meets in {self._meeting.time:.1f} s"
            strokes.append(Stroke(points=(view.position, self._meeting.point), label=label))
        if not strokes and not self._sketched:
            return None
        self._sketched = bool(strokes)
        return [stroke for stroke in strokes if _can_be_shown(stroke)][-SKETCH_LIMIT:]

    def _steer(self, view: View, wanted: Vector) -> Twist:
        """The twist for a wanted velocity, which leads around the robots that it knows."""
        known = {**self._watch.team(view, view.time), **out_of_play(view)}
        bodies = [Obstacle(place, (0.0, 0.0), view.me.radius + radius + CLEARANCE) for place, radius in known.values()]
        return self._pilot.head(view.time, view.pose, wanted, bodies, _bounds(view))


def _won(view: View) -> Auction | None:
    """The auction that this player has won, or None."""
    return next((auction for auction in view.referee.auctions if auction.winner == view.me.name), None)


def _can_be_shown(stroke: Stroke) -> bool:
    """True if a stroke is in the part of the plane that messages can hold: a wild guess of a course may not be."""
    return all(abs(x) < FARTHEST and abs(y) < FARTHEST for x, y in stroke.points)


def _away(view: View) -> bool:
    """True if it is to drive to its post: it returns from a chase, or lines up before the round."""
    return view.me.state == RETURNING or (view.me.state == WATCHING and view.me.may_move)


def _driving(view: View) -> bool:
    speed = view.speed
    return speed is not None and abs(speed) > 0.02


def _counts(view: View, target: Vector, velocity: Vector, point: Vector) -> bool:
    """True if an intruder can be captured at a point of its course: in the area, or before it comes there.

    After it has left the area it has escaped. True if the area is not known.
    """
    area = view.zone(AREA)
    if area is None or area.contains(*point):
        return True
    later = (point[0] + velocity[0] * CROSSING_TIME, point[1] + velocity[1] * CROSSING_TIME)
    comes = area.inside(target, point) is None and area.inside(point, later) is not None
    return comes and _bounds(view).contains(*point)


def _bounds(view: View) -> Region:
    """The region in which a pursuer drives: around the area."""
    area = view.zone(AREA)
    if area is None:
        return Rectangle(-1e5, -1e5, 1e5, 1e5)
    x_min, y_min, x_max, y_max = area.bounds
    return Rectangle(x_min - AREA_MARGIN, y_min - AREA_MARGIN, x_max + AREA_MARGIN, y_max + AREA_MARGIN)
