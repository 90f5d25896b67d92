"""Several unknown robots at once: which sighting is of which of them."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field

from msgspec.structs import replace

from vrg.agents.perception.line import TrackedLine, fitted, squared_distance
from vrg.bus.messages import Sighting
from vrg.navigation.assignment import assign

GATE = 16.0
"""The squared Mahalanobis distance beyond which a sighting is of another robot: 0.03 % of the right ones are beyond."""
JOIN_DISTANCE = 0.8
"""The distance in m within which two courses may be those of one robot, because two robots have no room there."""
FORGET = 20.0
"""The match time in s without a sighting after which a robot is forgotten. Older sightings are not looked at."""
TIDY_PERIOD = 1.0
"""The match time in s between two times when what is too old is looked for among what was taken in."""
FORGET_ONCE = 2.0
"""The same for one that was seen once, which may have been an error."""
CLOCK_TOLERANCE = 0.5
"""The time in s by which a sighting may be in the future, because clocks differ. Others are not looked at."""
MAX_TRACKS = 30
"""The number of robots that are kept at most; beyond it those that were seen least often are forgotten."""
TRACK_LENGTH = 40
"""The number of sightings that are kept of each robot, to be shown."""


EVIDENCE = "evidence"
"""The source of sightings of which it is not known who has made them: it may have been one player alone."""


@dataclass(frozen=True, eq=False)
class Track:
    """One unknown robot.

    Args:
        line: its course. sightings: the latest sightings of it, oldest first.
        number: stays the same as long as the robot is known.
    """

    line: TrackedLine
    sightings: tuple[Sighting, ...] = ()
    number: int = 0


@dataclass
class Tracker:
    """Keeps the courses of all unknown robots that a player and its team see. Its results depend on what it was given
    alone.

    Team mates tell each other their sightings, not their courses. Two courses may rest on the same sightings, and who
    fused them as if they were independent would be too sure (Y. Bar-Shalom, On the Track-to-Track Correlation Problem,
    IEEE Trans. Automatic Control 26(2), 1981). Covariance intersection (S. J. Julier, J. K. Uhlmann, A Non-divergent
    Estimation Algorithm in the Presence of Unknown Correlations, American Control Conference, 1997) is never too sure,
    but makes nothing of it where two see independently. Sightings are short, each counts once, and one that is lost is
    only missing. All players who have heard the same know the same.

    Args:
        speed: how fast such robots usually are, m/s; see `TrackedLine.start`.

    Attributes:
        tracks: the robots.
    """

    speed: float
    tracks: list[Track] = field(default_factory=list)
    _count: int = 0
    _reported: set[tuple[str | None, Sighting]] = field(default_factory=set)
    """The sightings that were taken in, with their sources; and some that are too old to be taken in again."""
    _tidied: float = -math.inf

    def update(self, sightings: Sequence[Sighting], now: float, source: str | None = None) -> None:
        """Take in what one scan has seen: at most one sighting of each robot.

        The assignment of sightings to robots is the one with the smallest sum of squared Mahalanobis distances (Kuhn,
        "The Hungarian method for the assignment problem", 1955), where a sighting that is beyond GATE of a robot is not
        of it. The rest are new robots. Sightings count for the time at which they were made, however late they come,
        and those that the same source has reported before are left out.

        Args:
            now: the match time, s.
            source: who has seen it, such as the name of a player; see `TrackedLine.seen`.
        """
        timely = [s for s in dict.fromkeys(sightings) if -CLOCK_TOLERANCE <= now - s.time <= FORGET]
        sightings = [s for s in timely if (source, s) not in self._reported]
        if not sightings:
            return
        self._reported.update((source, s) for s in sightings)
        taken: set[int] = set()
        if self.tracks:
            costs = [[min(t.line.surprise(s), 2 * GATE) for t in self.tracks] for s in sightings]
            for row, column in assign(costs):
                if costs[row][column] <= GATE:
                    self.tracks[column] = _with(self.tracks[column], sightings[row], source)
                    taken.add(row)
        for number, sighting in enumerate(sightings):
            if number not in taken:
                self._count += 1
                new = Track(TrackedLine.start(sighting.time, self.speed), number=self._count)
                self.tracks.append(_with(new, sighting, source))

    def tidy(self, now: float) -> None:
        """Join courses that are of one robot, and forget robots that were not seen for long. now: match time, s."""
        if not 0.0 <= now - self._tidied < TIDY_PERIOD:
            self._tidied = now
            self._reported = {reported for reported in self._reported if now - reported[1].time <= FORGET}
        self.tracks = [
            track
            for track in self.tracks
            if now - track.line.last <= (FORGET if track.line.last > track.line.first else FORGET_ONCE)
        ]
        kept: list[Track] = []
        for track in sorted(self.tracks, key=lambda t: (t.line.first, -t.line.count, t.number)):
            same = next((i for i, other in enumerate(kept) if _same(other.line, track.line, now)), None)
            if same is None:
                kept.append(track)
            else:
                both = sorted((*kept[same].sightings, *track.sightings), key=lambda s: s.time)
                line = kept[same].line.joined(track.line)
                kept[same] = Track(line, tuple(both[-TRACK_LENGTH:]), kept[same].number)
        self.tracks = (
            sorted(kept, key=lambda t: (-t.line.count, t.number))[:MAX_TRACKS] if len(kept) > MAX_TRACKS else kept
        )

    def shift(self, pause: float) -> None:
        """Take note that everybody stood still for a time, such as in a halt: `pause` s are no time for courses."""
        self.tracks = [
            Track(
                track.line.shifted(pause),
                tuple(replace(sighting, time=sighting.time + pause) for sighting in track.sightings),
                track.number,
            )
            for track in self.tracks
        ]
        self._reported = {
            (source, replace(reported, time=reported.time + pause)) for source, reported in self._reported
        }

    def forget(self, sightings: Sequence[Sighting]) -> None:
        """Forget the robot that sightings are of, because it is out of play."""
        track = self.track_of(sightings)
        self.tracks = [each for each in self.tracks if each is not track]

    def track_of(self, sightings: Sequence[Sighting]) -> Track | None:
        """The robot that sightings are of; a new one, which is not kept, if it is not one of those that are known.

        Args:
            sightings: of one robot, such as those that the referee publishes; None is returned if it is empty.
        """
        if not sightings:
            return None
        surprises = [statistics.median(track.line.surprise(s) for s in sightings) for track in self.tracks]
        best = min(range(len(surprises)), key=lambda i: surprises[i], default=None)
        if best is not None and surprises[best] <= GATE:
            return self.tracks[best]
        line = fitted(sightings, time=sightings[0].time, speed=self.speed, source=EVIDENCE)
        return Track(line, tuple(sightings))

    def numbered(self, number: int) -> Track | None:
        """The robot of this number, or None if it is not known any more."""
        return next((track for track in self.tracks if track.number == number), None)


def _with(track: Track, sighting: Sighting, source: str | None) -> Track:
    return Track(track.line.seen(sighting, source), (*track.sightings, sighting)[-TRACK_LENGTH:], track.number)


def _same(a: TrackedLine, b: TrackedLine, now: float) -> bool:
    """True if two courses are of one robot: they are near each other now, and when the first of the two was last seen.

    When the second one was first seen does not count: it became a second one because it was not near then.
    """
    for time in (now, min(a.last, b.last)):
        (ax, ay), (bx, by) = a.at(time), b.at(time)
        if math.dist((ax, ay), (bx, by)) > JOIN_DISTANCE:
            return False
        both = [own + other for own, other in zip(a.covariance_at(time), b.covariance_at(time), strict=True)]
        if squared_distance((ax - bx, ay - by), (both[0], both[1], both[2])) > GATE:
            return False
    return True
