"""The simulated source of fixes: the truth with noise, late, with gaps, and now and then under another robot's name."""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from heapq import heappop, heappush
from itertools import count

from numpy.random import Generator, default_rng
from pydantic import Field

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import TIME_TOLERANCE, Tick, due_index
from vrg.bus.topics import Keys, name_in
from vrg.geometry import along_arc, arc_between, compose, interpolate, wrap
from vrg.localisation.motion import corrected, driven, motion_noise
from vrg.localisation.source import Source, SourceContext
from vrg.portable.arrays import normals
from vrg.tables import Table
from vrg.types import Pose

_HISTORY_LENGTH = 50
"""The number of poses of an emulated robot that are kept."""
_STANDS = 0.3
"""The time in s after which an emulated robot whose motion is not heard counts as standing."""


class Errors(Table):
    """The errors of the odometry of an emulated robot, as of a real one that was not calibrated.

    Args:
        way, turn: the shares by which its ways and its turns are longer than it measures.
        bend: its turn on a metre straight ahead, degrees.
    """

    way: float = Field(0.0, ge=-0.5, le=0.5)
    turn: float = Field(0.0, ge=-0.5, le=0.5)
    bend: float = Field(0.0, ge=-45.0, le=45.0)


class SimSettings(Table):
    """The table of a source of the kind `sim`. The defaults are those of a webcam above a small field.

    Args:
        rate: the pictures in a second.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
        delay: the time from a picture to its fixes, s. jitter: the longest additional time, s.
        dark: the match times from and to which nothing is seen, as when the light is off, s.
        loss: the share of fixes that are lost. swaps: the share of pictures in which two robots have each other's name.
        errors: what the odometry of emulated robots is off by, by the robot's name.
    """

    rate: float = Field(15.0, gt=0.0, le=100.0)
    position: float = Field(0.01, gt=0.0, le=10.0)
    heading: float = Field(1.0, gt=0.0, le=90.0)
    delay: float = Field(0.1, ge=0.0, le=10.0)
    jitter: float = Field(0.02, ge=0.0, le=10.0)
    dark: tuple[tuple[float, float], ...] = ()
    loss: float = Field(0.0, ge=0.0, le=1.0)
    swaps: float = Field(0.0, ge=0.0, le=1.0)
    errors: dict[str, Errors] = Field(default_factory=dict)


class SimulatedFixes:
    """The fixes of one simulated camera.

    Args:
        settings: how well it sees. rng: the source of all that is random.
    """

    def __init__(self, settings: SimSettings, rng: Generator) -> None:
        self._settings = settings
        self._rng = rng
        self._due = -1
        self._coming: list[tuple[float, int, float, tuple[Fix, ...]]] = []
        """The pictures whose fixes have not arrived: a heap of arrival time, number, time and fixes."""
        self._number = count()

    def capture(self, time: float, poses: Mapping[str, Pose]) -> None:
        """Take a picture of the robots, if one is due; to be called at least as often as pictures are taken.

        Args:
            time: s. poses: where the robots are.
        """
        due = due_index(time, 1.0 / self._settings.rate)
        if due == self._due or not poses:
            return
        self._due = due
        if any(begin <= time < end for begin, end in self._settings.dark):
            return
        s, rng, names = self._settings, self._rng, sorted(poses)
        shown = dict(zip(names, names, strict=True))
        if len(names) > 1 and rng.random() < s.swaps:
            one, other = rng.choice(len(names), 2, replace=False).tolist()
            shown |= {names[one]: names[other], names[other]: names[one]}
        fixes, heading = [], math.radians(s.heading)
        for name in names:
            (dx, dy, turn), lost = normals(rng, 3).tolist(), rng.random() < s.loss
            pose = poses[shown[name]]
            seen = Pose(pose.x + s.position * dx, pose.y + s.position * dy, wrap(pose.theta + heading * turn))
            if not lost:
                fixes.append(Fix(name, seen, s.position, heading))
        arrival = time + s.delay + s.jitter * rng.random()
        heappush(self._coming, (arrival, next(self._number), time, tuple(fixes)))

    def arrived(self, now: float) -> list[tuple[float, tuple[Fix, ...]]]:
        """The fixes of each picture that have arrived by now, with the time of the picture, s; each comes once."""
        found = []
        while self._coming and self._coming[0][0] <= now + TIME_TOLERANCE:
            *_, time, fixes = heappop(self._coming)
            found.append((time, fixes))
        return found


class SimSource(Source):
    """Sees robots where they truly are, as well as its settings let it.

    Virtual robots are where the world has them. Robots with emulated drives are where those have driven them: where
    they would be by the wiring's ratios and the model's track, but for the errors of the settings.
    """

    settings = SimSettings
    sees_physical = False

    def __init__(self, context: SourceContext, mailbox: Mailbox, keys: Keys) -> None:
        super().__init__(context, mailbox, keys)
        assert isinstance(context.settings, SimSettings)
        self._settings = context.settings
        self._fixes = SimulatedFixes(context.settings, default_rng(context.seed))
        self._virtual = frozenset(context.robots) - frozenset(context.emulated)
        self._poses = mailbox.subscribe(keys.poses)
        emulated = list(context.emulated)
        self._wired = context.emulated
        self._drivetrains = {name: context.robots[name].drivetrain for name in emulated}
        self._motions = mailbox.subscribe(keys.motion(), only=[keys.motion(name).key for name in emulated])
        self._placed = mailbox.subscribe(keys.placed(), only=[keys.placed(name).key for name in emulated])
        self._fastest = {name: motion_noise(context.robots[name]).fastest for name in emulated}
        self._odometry: dict[str, Pose] = {}
        self._truths = {name: deque([(0.0, context.starts[name])], maxlen=_HISTORY_LENGTH) for name in emulated}
        """The poses of the emulated robots, in the map's frame, with the match times, s."""
        self._waiting: deque[tuple[float, dict[str, Pose]]] = deque()
        """The poses of the virtual robots, with their times, for which those of emulated ones have not come yet."""

    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The pictures whose fixes arrive now."""
        for placed in self._placed.take():
            self._truths[name_in(placed.key)].append((placed.stamp, placed.body.pose))
        for motion in self._motions.take():
            self._move(name_in(motion.key), motion.stamp, motion.body.odometry)
        for poses in self._poses.take():
            self._waiting.append((poses.stamp, {b.name: b.pose for b in poses.body.bodies if b.name in self._virtual}))
        while self._waiting and self._is_known(self._waiting[0][0], tick.time):
            time, virtual = self._waiting.popleft()
            self._fixes.capture(time, virtual | {name: pose_at(truth, time) for name, truth in self._truths.items()})
        return self._fixes.arrived(tick.time)

    def _is_known(self, time: float, now: float) -> bool:
        """True if it is known where all robots were; one whose motion is not heard for a while stands."""
        return now > time + _STANDS or all(truth[-1][0] >= time for truth in self._truths.values())

    def _move(self, name: str, time: float, odometry: Pose) -> None:
        before, self._odometry[name] = self._odometry.get(name, odometry), odometry
        then, pose = self._truths[name][-1]
        way = driven(before, odometry, max(0.0, time - then), self._fastest[name])
        if way is None:
            return
        if (wired := self._wired[name]) != (own := self._drivetrains[name]):
            # A calibration changes what is measured and commanded, but not how large the wheels are.
            turned = wired.speeds(arc_between(Pose(0.0, 0.0, 0.0), way))
            way = along_arc(Pose(0.0, 0.0, 0.0), own.twist(turned), 1.0)
        errors = self._settings.errors.get(name) or Errors.model_validate({})
        way = corrected(way, errors.way, errors.turn, math.radians(errors.bend))
        self._truths[name].append((time, compose(pose, way)))


def pose_at(truth: Sequence[tuple[float, Pose]], time: float) -> Pose:
    """The pose at a time, by those before and after it."""
    after = next((i for i, (then, _) in enumerate(truth) if then >= time), None)
    if after is None or after == 0:
        return truth[-1 if after is None else 0][1]
    (t0, a), (t1, b) = truth[after - 1], truth[after]
    return interpolate(a, b, (time - t0) / (t1 - t0)) if t1 > t0 else b
