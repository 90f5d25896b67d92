"""The whole of a recorded match: the scene at any instant, the calls, and the bounds of time.

The scene at an instant depends on the recording and the instant alone, not on what was looked at before. It is made by
the builder that makes the scenes of a running match, from the few messages before the instant that still count. So it
takes as long at the end of a match as at its beginning.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from msgspec.structs import replace

from vrg.bus import messages as m
from vrg.games import game_of
from vrg.hal.estop import EstopLatch
from vrg.recording.recorded import RecordedMatch, Timed
from vrg.regions import Region
from vrg.types import LEVEL, Pose
from vrg.ui.builder import CALLS_KEPT, TRAIL_SECONDS, SceneBuilder
from vrg.ui.scene import JUMP, Scene

T = TypeVar("T")

SMOOTH: Final = 1.0
"""s; between two instants that are further apart, bodies are shown where they were last, not on their way."""
_STRIDE: Final = 20
"""Trails are made from every so many-th instant on, so that their points stay the same ones from frame to frame."""


@dataclass(frozen=True)
class CallMark:
    """A call on the line of time.

    Args:
        time: match time, s. call: the call. marked: the game wants it marked where it happened.
    """

    time: float
    call: m.Call
    marked: bool

    @property
    def text(self) -> str:
        """The call in words."""
        return self.call.text


class Timeline:
    """A recorded match that can be looked at at any instant.

    Args:
        match: the recorded messages.
        sizes: length and width of the robots in m, by name. obstacles: the ground that walls and obstacles cover, m.

    Attributes:
        begin, end: the first and the last instant, match time, s.
        instants: the match times at which it was recorded where the bodies were, s, rising.
        calls: the referee's calls in the order of time.

    Raises:
        ValueError: it is not recorded where any body was.
    """

    def __init__(
        self,
        match: RecordedMatch,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        obstacles: Sequence[Region] = (),
    ) -> None:
        if not match.poses:
            raise ValueError("expected a recording of where the robots were, found none in it")
        self._sizes, self._obstacles = sizes, obstacles
        self._poses = _Series(match.poses)
        self._states = _Series(match.states)
        self._calls = _Series([(time, call) for time, call in match.calls if call.rule != "refused"])
        self._estops = _Series(_orders(match))
        self._reports = {name: _Series(entries) for name, entries in match.reports.items()}
        self._sketches = {name: _Series(entries) for name, entries in match.sketches.items()}
        self._starts = _starts(match.poses)
        self.instants: Sequence[float] = self._poses.times
        self.begin = self.instants[0]
        self.end = max(series.times[-1] for series in (self._poses, self._states, self._calls) if series.times)
        game = game_of(match.states[-1][1].game if match.states else "")
        self.calls = [CallMark(time, call, call.rule in game.marked) for time, call in self._calls.entries()]

    def at(self, time: float, rate: float = 1.0) -> Scene:
        """The scene at a match time, s, which is shown at `rate` match seconds per real second.

        Between two instants that were recorded, bodies are on the straight way from one place to the other.
        """
        builder = SceneBuilder(sizes=self._sizes, obstacles=self._obstacles)
        builder.clock(m.Clock(time=time, tick=0, epoch=0, rate=rate, estop=False))
        self._place(builder, time)
        # Before the referee spoke, the game and its field are known from what it said first.
        if (state := self._states.newest(max([time, *self._states.times[:1]]))) is not None:
            builder.referee(state)
        if (order := self._estops.newest(time)) is not None:
            builder.estop(order)
        for player, reports in self._reports.items():
            if (report := reports.newest(time)) is not None:
                builder.report(player, report)
        for player, sketches in self._sketches.items():
            if (sketch := sketches.newest(time)) is not None:
                builder.sketch(player, sketch)
        heard = self._calls.until(time)
        for stamp, call in self._calls.entries(max(0, heard - CALLS_KEPT), heard):
            builder.call(call, stamp)
        return builder.build(live=True)

    def _place(self, builder: SceneBuilder, time: float) -> None:
        """Tell the builder where bodies began, how they came here, and where they are."""
        count = self._poses.until(time)
        if count == 0:
            return
        trail = bisect_left(self.instants, self.instants[count - 1] - TRAIL_SECONDS)
        first = trail - trail % _STRIDE
        for stamp, bodies in self._starts:
            if stamp < self.instants[first]:
                builder.poses(bodies, stamp)
        for stamp, poses in self._poses.entries(first, count):
            builder.poses(poses, stamp)
        if count < len(self.instants):
            before, after = self.instants[count - 1], self.instants[count]
            if before < time and after - before <= SMOOTH:
                share = (time - before) / (after - before)
                builder.poses(_between(self._poses.values[count - 1], self._poses.values[count], share), time)


class _Series(Generic[T]):
    """Messages of one kind in the order of time."""

    def __init__(self, entries: Timed[T]) -> None:
        self.times = [time for time, _ in entries]
        self.values = [message for _, message in entries]

    def until(self, time: float) -> int:
        """The number of entries up to a match time, s."""
        return bisect_right(self.times, time)

    def newest(self, time: float) -> T | None:
        """The last one up to a match time, s."""
        count = self.until(time)
        return self.values[count - 1] if count else None

    def entries(self, first: int = 0, end: int | None = None) -> list[tuple[float, T]]:
        """Those with the numbers from `first` to before `end`, each with its time."""
        return list(zip(self.times[first:end], self.values[first:end], strict=True))


def _orders(match: RecordedMatch) -> Timed[m.Estop | m.EstopRelease | None]:
    """The orders about the emergency stop, and None where a state of the referee's makes up for a missed release."""
    latch = EstopLatch()
    found: Timed[m.Estop | m.EstopRelease | None] = []
    messages: Timed[m.Estop | m.EstopRelease | m.RefereeState] = [*match.estops, *match.states]
    for time, message in sorted(messages, key=lambda entry: entry[0]):
        before = latch.engaged
        if isinstance(message, m.RefereeState):
            latch.referee(message.estop, time)
            if before and not latch.engaged:
                found.append((time, None))
        else:
            latch.order(isinstance(message, m.Estop), time)
            found.append((time, message))
    return found


def _starts(poses: Timed[m.Poses]) -> Timed[m.Poses]:
    """The bodies that were new at an instant, for each instant at which any were."""
    seen: set[str] = set()
    found: Timed[m.Poses] = []
    for stamp, at in poses:
        new = [body for body in at.bodies if body.name not in seen]
        if new:
            seen.update(body.name for body in new)
            found.append((stamp, m.Poses(bodies=tuple(new))))
    return found


def _between(before: m.Poses, after: m.Poses, share: float) -> m.Poses:
    """The poses of the bodies when a share, 0 to 1, of the time between two instants was over."""
    later = {body.name: body.pose for body in after.bodies}
    return m.Poses(
        bodies=tuple(replace(body, pose=_on_the_way(body.pose, later.get(body.name), share)) for body in before.bodies)
    )


def _on_the_way(start: Pose, end: Pose | None, share: float) -> Pose:
    if end is None or math.dist((start.x, start.y), (end.x, end.y)) > JUMP:
        return start
    turn = math.remainder(end.theta - start.theta, math.tau)
    return Pose(
        start.x + share * (end.x - start.x),
        start.y + share * (end.y - start.y),
        math.remainder(start.theta + share * turn, math.tau),
        start.z + share * (end.z - start.z) or LEVEL,
    )
