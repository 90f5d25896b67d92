"""The state of a match of pursuit-evasion."""

from collections.abc import Mapping
from typing import TypeVar

from msgspec import Struct, structs

from vrg.bus.messages import Sighting
from vrg.coordinator.rulebook import GameState, Observation
from vrg.games.pursuit_evasion import CROSSING
from vrg.games.pursuit_evasion.crossing import COURSE_REACH, across
from vrg.types import Pose

V = TypeVar("V")

MAX_SIGHTINGS = 8
"""The number of sightings of an intruder that are published."""
SIGHTING_PERIOD = 0.3
"""The time in s between two sightings that are published."""
HISTORY_TIME = 1.0
"""The time in s for which the referee remembers where everybody was."""
MATCHING_TOLERANCE = 0.2
"""The time in s between a sighting and the look at the field by which it is judged, at most."""

PAUSE = 0.5
"""The time in s between two looks from which play was halted between them."""


class Look(Struct, frozen=True, array_like=True):
    """The poses at one look of the referee at the field: the match time, s, and the poses by player."""

    time: float
    poses: Mapping[str, Pose]


class Course(Struct, frozen=True, array_like=True):
    """The line along which an intruder is to drive.

    Args:
        pose: a pose on it. since: the time of play since which it may drive, s.
        mark: the time of play, s, and its place at the last instant at which its speed was judged; None before the
            first.
    """

    pose: Pose
    since: float
    mark: tuple[float, Pose] | None = None


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. There is one round.

    Args:
        entered: the intruders that have been inside the area.
        detected: the first two times at which each intruder was seen, as reported, match time, s.
        seen: the time of play at which an intruder was last seen, s.
        evidence: sightings of each intruder, oldest first.
        looks: those of the last HISTORY_TIME seconds of play, oldest first. courses: those of the intruders in play.
        silenced: the time of play until which a pursuer's reports do not count, s.
        dispatched: the pursuer that was sent to each intruder, and when (time of play, s).
    """

    entered: tuple[str, ...] = ()
    detected: Mapping[str, tuple[float, ...]] = {}
    seen: Mapping[str, float] = {}
    evidence: Mapping[str, tuple[Sighting, ...]] = {}
    dispatched: Mapping[str, tuple[str, float]] = {}
    looks: tuple[Look, ...] = ()
    courses: Mapping[str, Course] = {}
    silenced: Mapping[str, float] = {}

    def crossing(self) -> list[str]:
        """The intruders in play, by name."""
        return sorted(self.in_state(CROSSING))

    def detections(self, intruder: str) -> int:
        """The number of times at which an intruder was seen, at most 2."""
        return len(self.detected.get(intruder, ()))

    def looked(self, before: Observation, now: Observation, clock: float) -> "State":
        """The same after a look at the field: the look is remembered, and every intruder in play has a course.

        An intruder's course begins where it stands when it comes into play, and again where it is put. After a pause it
        gets up its speed again, and the looks before are forgotten.
        """
        paused = bool(self.looks) and abs(now.time - self.looks[-1].time) > PAUSE
        looks = [] if paused else [look for look in self.looks if look.time >= now.time - HISTORY_TIME - 1e-6]
        last = looks[-1].poses if looks else before.poses
        courses = {}
        for name in (name for name in self.crossing() if name in now.poses):
            pose, course = now.poses[name], self.courses.get(name)
            if course is None or last.get(name) != before.poses.get(name):
                course = Course(pose, clock)
            elif paused:
                carried = abs(across(course.pose, pose)) > COURSE_REACH
                course = Course(pose if carried else course.pose, clock)
            courses[name] = course
        return structs.replace(self, looks=(*looks, Look(now.time, now.poses)), courses=courses)

    def poses_at(self, time: float) -> Mapping[str, Pose] | None:
        """The poses at a match time, s, by the look that is nearest to it; None if there is none near."""
        look = min(self.looks, key=lambda look: abs(look.time - time), default=None)
        return None if look is None or abs(look.time - time) > MATCHING_TOLERANCE + 1e-6 else look.poses

    def with_sighting(self, intruder: str, sighting: Sighting, clock: float) -> "State":
        """The same after an intruder was seen. Sightings at the same instant are one detection.

        Args:
            clock: the time of play, s.
        """
        times = self.detected.get(intruder, ())
        if len(times) < 2 and all(abs(sighting.time - time) > 1e-6 for time in times):
            times = (*times, sighting.time)
        evidence = self.evidence.get(intruder, ())
        # The first two may be near each other in time, because two are enough.
        early = len(evidence) < 2 and all(abs(sighting.time - each.time) > 1e-6 for each in evidence)
        if early or (evidence and sighting.time >= evidence[-1].time + SIGHTING_PERIOD):
            evidence = tuple(sorted([*evidence, sighting], key=lambda s: s.time)[-MAX_SIGHTINGS:])
        return structs.replace(
            self,
            seen={**self.seen, intruder: clock},
            detected={**self.detected, intruder: times},
            evidence={**self.evidence, intruder: evidence},
        )

    def unseen(self, intruder: str) -> "State":
        """The same, but as if an intruder had never been seen and had never been inside."""
        return structs.replace(
            self,
            entered=tuple(name for name in self.entered if name != intruder),
            courses=_without(self.courses, intruder),
            detected=_without(self.detected, intruder),
            seen=_without(self.seen, intruder),
            evidence=_without(self.evidence, intruder),
        )


def _without(table: Mapping[str, V], name: str) -> dict[str, V]:
    return {key: value for key, value in table.items() if key != name}
