"""A pursuer's knowledge: the empty scene, its team mates, and the courses of intruders."""

import math
from collections.abc import Sequence

from msgspec.structs import replace

from vrg.agents.perception.background import Snapshot, returns_of, snapshot, unusual
from vrg.agents.perception.clusters import clusters, sighting_of
from vrg.agents.perception.scan import Scan, scan_of
from vrg.agents.perception.tracking import Tracker
from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import View
from vrg.bus.messages import Sighting
from vrg.games.pursuit_evasion.talk import Words, understood
from vrg.geometry import along_arc, wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Rays
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.portable.scalars import total
from vrg.types import STILL, Pose, Uncertainty, Vector

SNAPSHOT_SCANS = 5
"""The number of scans in a snapshot of the empty scene."""
_MATE_MARGIN = 0.35
"""The distance in m around a team mate's body within which returns are taken for it."""
MATE_FORGOTTEN = 3.0
"""The age in s of a team mate's last message after which its place is not known, if it was driving."""
_OUT_MARGIN = 0.4
"""The same as _MATE_MARGIN for a robot that is out of play, whose pose the referee publishes."""
PAUSE = 0.35
"""The difference in s between match time and time of play from which it is a pause: the referee speaks every 0.1 s."""
SAME_PLACE, SAME_HEADING = 0.1, 0.03
"""The distance in m and the angle in rad between two scans that were taken from one place. A pose that is less well
known, by its standard deviations, is no place for a snapshot."""
USUAL_SPEED = 1.0
"""The usual speed of intruders, m/s; see `TrackedLine.start`."""


class IntruderDetector:
    """Looks at scans and listens to team mates.

    Args:
        robot: the description of its own robot.

    Attributes:
        own: its own snapshot of the empty scene; None until it has one.
        mates: the last message of each team mate, and its match time, s.
        tracker: the courses of the unknown robots.
        fresh: the sightings of this tick.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._scanner = robot.scanner
        self._scans: list[Scan] = []
        self._stamp = -math.inf
        self._offset = 0.0
        self._pauses: list[tuple[float, float]] = []
        """The match times at which play stopped, and for how long, s."""
        self.own: Snapshot | None = None
        self._theirs: dict[str, Snapshot] = {}
        self.mates: dict[str, tuple[float, Words]] = {}
        self.tracker = Tracker(USUAL_SPEED)
        self.fresh: list[Sighting] = []

    def look(self, view: View, *, standing: bool) -> None:
        """Take in a view.

        Args:
            standing: its robot stands at its post, so that it may take a snapshot if it has none, and if it knows well
                enough where it is.
        """
        self._note_pauses(view)
        self._hear(view.heard, view.time)
        self.fresh = []
        found = self._newest(view)
        if found is not None and found[0] > self._stamp:
            self._stamp, rays = found
            scan = scan_of(rays, self._pose_at(view, self._stamp))
            if standing and len(self._scans) < SNAPSHOT_SCANS and _located(view.uncertainty):
                self._remember(scan)
            self.fresh = self._seen(view, scan, self._stamp)
            self.tracker.update(self.fresh, view.time, view.me.name)
        self.tracker.tidy(view.time)

    def _newest(self, view: View) -> tuple[float, Rays] | None:
        """The match time in s of the range finder's newest measurement, and its rays; None without one."""
        spec = self._scanner
        sample = None if spec is None else view.readings.latest(spec.message, spec.name)
        rays = None if spec is None or sample is None else spec.depict(sample.value)
        return (sample.stamp, rays) if sample is not None and isinstance(rays, Rays) else None

    def timely(self, sightings: Sequence[Sighting]) -> list[Sighting]:
        """Sightings as if there had been no pause since: courses count only the time in which robots moved."""
        return [
            replace(each, time=each.time + total(pause for when, pause in self._pauses if each.time < when))
            for each in sightings
        ]

    def _note_pauses(self, view: View) -> None:
        """Compare match time with the time of play. When play stops, intruders stand."""
        offset = view.time - view.referee.total
        pause = offset - self._offset
        if abs(pause) > PAUSE:
            self._offset = offset
            if pause > 0.0:
                self._pauses = [*self._pauses[-20:], (view.time - pause, pause)]
                self.tracker.shift(pause)

    def places(self, now: float) -> dict[str, Vector]:
        """The places of team mates that have reported them not long ago, m."""
        return {
            name: (pose.x, pose.y)
            for name, (stamp, words) in self.mates.items()
            if now - stamp <= MATE_FORGOTTEN or words.twist == STILL
            for pose in [along_arc(words.pose, words.twist, min(max(now - stamp, 0.0), MATE_FORGOTTEN))]
        }

    def team(self, view: View, now: float) -> dict[str, tuple[Vector, float]]:
        """The places of team mates by `places`, and the radii of the circles around them, m."""
        radii = {player.name: player.radius for player in view.referee.players}
        return {name: (place, radii.get(name, view.me.radius)) for name, place in self.places(now).items()}

    def known(self, view: View, now: float) -> list[tuple[Vector, float]]:
        """The place of each robot that is a team mate or out of play, and the distance, m, within which it is seen."""
        found = [(place, radius + _MATE_MARGIN) for place, radius in self.team(view, now).values()]
        return found + [(place, radius + _OUT_MARGIN) for place, radius in out_of_play(view).values()]

    def _remember(self, scan: Scan) -> None:
        """Take a scan into the snapshot. If it is from another place or has other beams, the snapshot starts again."""
        if self._scans and not _alike(self._scans[0], scan):
            self._scans = []
        self._scans.append(scan)
        self.own = snapshot(self._scans)

    def _hear(self, heard: Sequence[TeamMessage], now: float) -> None:
        for each in heard:
            words = understood(each.words)
            if words is None:
                continue
            if self.mates.get(each.speaker, (-math.inf, words))[0] <= each.stamp:
                self.mates[each.speaker] = (each.stamp, words)
            if words.snapshot is not None:
                self._theirs[each.speaker] = words.snapshot
            self.tracker.update(self.timely(words.sightings), now, each.speaker)

    def _seen(self, view: View, scan: Scan, stamp: float) -> list[Sighting]:
        snapshots = [*([] if self.own is None else [self.own]), *self._theirs.values()]
        radius = max((p.radius for p in view.referee.players if p.team != view.me.team), default=view.me.radius)
        explained = returns_of(scan, self.known(view, stamp))
        strange = unusual(scan, snapshots, explained)
        return [
            sighting_of(scan, beams, radius=radius, time=stamp, uncertainty=view.uncertainty)
            for beams in clusters(scan, strange, explained)
        ]

    @staticmethod
    def _pose_at(view: View, stamp: float) -> Pose:
        """The own pose at the time of a scan: the measured one, moved by what the wheels say of the time between."""
        ins, odometry = view.readings.latest(Ins), view.readings.latest(Odometry)
        measured = view.time if ins is None else ins.stamp
        twist = STILL if odometry is None else odometry.value.twist
        return along_arc(view.pose, twist, stamp - measured)


def out_of_play(view: View) -> dict[str, tuple[Vector, float]]:
    """The places of robots that the referee reports as out of play, and the radii of the circles around them, m."""
    return {p.name: ((p.pose.x, p.pose.y), p.radius) for p in view.others() if p.pose is not None}


def _located(uncertainty: Uncertainty | None) -> bool:
    """True if a pose is known well enough for a snapshot: from a wrong one, walls and robots would be free space."""
    if uncertainty is None:
        return True
    return uncertainty.ellipse[0] < SAME_PLACE and math.sqrt(uncertainty.heading) < SAME_HEADING


def _alike(first: Scan, second: Scan) -> bool:
    """True if two scans are of the same beams and from the same place."""
    near = math.dist(first.origin, second.origin) < SAME_PLACE
    return near and len(first.ranges) == len(second.ranges) and abs(wrap(second.heading - first.heading)) < SAME_HEADING
