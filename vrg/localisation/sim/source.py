"""The node of the simulated source."""

import math
from collections import deque
from collections.abc import Iterable, Sequence

from numpy.random import default_rng

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, name_in
from vrg.geometry import along_arc, arc_between, compose, interpolate
from vrg.localisation.motion import corrected, driven, motion_noise
from vrg.localisation.sim.fixes import SimulatedFixes
from vrg.localisation.sim.settings import Errors, SimSettings
from vrg.localisation.source import Source, SourceContext
from vrg.types import Pose

_HISTORY_LENGTH = 50
"""The number of poses of an emulated robot that are kept."""
_STANDS = 0.3
"""The time in s after which an emulated robot whose motion is not heard counts as standing."""


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
