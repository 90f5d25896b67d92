"""The drive train of one robot: its axes on a bus, watched over, and what they say together.

Which thread may do what is told in vrg.hal.can.watch.
"""

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from vrg.errors import RobotError
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.base import DriveBase, Estimate, WheelAxis
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.medium import Medium
from vrg.hal.can.meeting import meet
from vrg.hal.can.protocols import Protocol
from vrg.hal.can.recovering import Recovery
from vrg.hal.can.watch import BLIND, Watch
from vrg.hal.can.workshop.survey import Survey, all_listeners
from vrg.hal.models import RobotModel
from vrg.types import Pose

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class TrainState:
    """The reports of the drives, at one instant.

    Args:
        age: s since the oldest of the newest encoder estimates; infinite before the first.
        wheels: speeds of the left and the right wheels, rad/s. angles: what both have turned since the odometry began,
            rad.
        odometry: the pose since then.
        armed: every motor obeys. estop: the emergency stop has latched.
        fault: what has latched until a person clears it, in words; None where nothing has.
        volts: the lowest supply voltage; None before any drive has told. volts_age: s since the oldest of those that
            were told; infinite before the first.
    """

    age: float
    wheels: tuple[float, float]
    angles: tuple[float, float]
    odometry: Pose
    armed: bool
    fault: str | None
    estop: bool
    volts: float | None
    volts_age: float


class DriveTrain:
    """See the module.

    Args:
        name: the robot's name, for messages. medium: the buses. link: which of them is its own.
        protocol: what its drives speak. wheel_axes: how its motors drive its wheels. model: its description.
        options: what the protocol is told of its drives; None for the defaults.
        unwatched: a person has said that its drives may be driven without watchdogs of their own.

    Attributes:
        clock: the time of its bus.
    """

    def __init__(
        self,
        name: str,
        medium: Medium,
        link: Link,
        protocol: Protocol,
        wheel_axes: Sequence[WheelAxis],
        model: RobotModel,
        *,
        options: ProtocolOptions | None = None,
        unwatched: bool = False,
    ) -> None:
        self.name = name
        self._options = options
        self._unwatched = unwatched
        self._protocol = protocol
        self._axis_type = protocol.axis_type
        self._model = model
        self.clock = medium.clock
        self._bus = medium.bus(link, self._on_frame, self._on_trouble, self._on_quiet)
        self._base = DriveBase(wheel_axes, model)
        self._survey = Survey([])
        self._watch = Watch(name, [], self.clock)
        self._begin()
        self._recovery = Recovery(self._watch, self._bus, self.clock, self._rebase)

    @property
    def connected(self) -> bool:
        """True if every drive has been met."""
        return self._watch.connected

    def connect(self) -> None:
        """Open the bus and meet every drive. Idempotent; energises nothing. Waits as long as there is something new
        to hear of the drives (see `meet`), and for their answers while they are set up.

        Raises:
            RobotError: no such interface, a drive that does not answer, speaks another protocol or shares its id.
        """
        if self.connected:
            return
        with self._watch.lock:
            self._begin()
            self._base.restart()
            self._survey = Survey(all_listeners(self._bus.send, self.clock))
        try:
            meet(self._bus, self._protocol.name, self._watch, self._survey, self.clock)
        except RobotError as error:
            raise RobotError(f"{self.name}: {error}") from None
        for axis in self._watch.axes.values():
            serial, firmware = axis.serial or "?", axis.firmware or "?"
            log.info("%s: node %d: serial %s, firmware %s", self.name, axis.node, serial, firmware)
        with self._watch.lock:
            self._watch.guard.begin(self.clock.now())
            self._watch.connected = True

    def arm(self) -> None:
        """Ask every axis for closed-loop control; `state().armed` tells when all are there.

        The first time after connecting or recovering, the watchdogs of the drives are proved before; see `Guard`. For
        that `state` must be called again and again, as a player does.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        if not self.connected:
            raise RobotError(f"{self.name}: expected a connected robot to arm: call connect() first")
        with self._watch.lock:
            watch, guard, now = self._watch, self._watch.guard, self.clock.now()
            refusal = "it is being recovered" if self._recovery.under_way else guard.refusal(now)
            if refusal:
                raise RobotError(f"{self.name}: {refusal}")
            if guard.wanted:
                if not guard.armed:
                    # A drive that takes long to start is not left without setpoints meanwhile.
                    self.stand()
                return
            self._base.rebase()
            guard.arm(now)
            starved = [axis for axis in watch.axes.values() if axis.starved]
            watch.each("clear errors", [axis.clear for axis in starved])
            for axis in starved:
                axis.starved = False
            watch.each("arm", [axis.start for axis in watch.axes.values()])
            watch.look()
            if guard.fault:
                raise RobotError(f"{self.name}: {guard.fault}")

    def drive(self, left: float, right: float) -> None:
        """Send setpoints for wheel speeds in rad/s.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a bus that is full.
        """
        with self._watch.lock:
            self._watch.require_armed()
            self._watch.command(self._base.setpoints(left, right))

    def spin(self, node: int, velocity: float) -> None:
        """Turn one motor alone, at `velocity` turn/s, while the others stand: for a robot that is jacked up.

        Raises:
            RobotError: as for `drive`.
        """
        with self._watch.lock:
            self._watch.require_armed()
            self._watch.command([(other, velocity if other == node else 0.0) for other in self._watch.axes])

    def stand(self) -> None:
        """Send setpoints of zero, if it is armed and hears the bus. What keeps them from going out latches."""
        with self._watch.lock:
            watch = self._watch
            if watch.connected and watch.guard.wanted and watch.deaf <= BLIND:
                try:
                    watch.command([(node, 0.0) for node in watch.axes])
                except RobotError as error:
                    log.warning("%s", error)

    def disarm(self) -> None:
        """Switch every motor off, until armed again. Idempotent."""
        with self._watch.lock:
            self._watch.guard.disarm()
            if self.connected:
                self._watch.idle()

    def engage(self) -> None:
        """The emergency stop of the match: switch every motor off by the shortest way that the protocol has."""
        if self.connected:
            with self._watch.lock:
                self._watch.guard.engage()
                self._watch.each("emergency stop", [axis.stop_now for axis in self._watch.axes.values()])

    def release(self) -> None:
        """A person has released the emergency stop. The motors stay off."""
        with self._watch.lock:
            if self.connected and self._watch.guard.estop:
                self._watch.guard.release(self.clock.now())
                self._watch.clear()

    def recover(self) -> None:
        """Clear what has latched, as a person has decided; see `Recovery.run`. It waits for answers of the drives."""
        self._recovery.run()

    def close(self) -> None:
        """Switch the motors off and let go of the bus. Idempotent."""
        self.disarm()
        with self._watch.lock:
            self._watch.connected = False
        self._bus.stop()

    def state(self) -> TrainState:
        """Return the reports of the drives. Once their watchdogs have been proved, this arms them if wanted."""
        with self._watch.lock:
            self._watch.look()
            if self._watch.guard.ready:
                log.info("%s: the watchdog of every drive has stopped its motor, as it must", self.name)
                try:
                    self.arm()
                except RobotError as error:
                    log.warning("%s", error)
            now = self.clock.now()
            guard, axes = self._watch.guard, self._watch.axes
            fault = guard.fault
            if fault is None and guard.at_drive:
                fault = "the emergency stop was pressed at a drive: release it by `vrg estop --release`"
            told = [(axis.voltage, axis.supplied) for axis in axes.values() if axis.voltage is not None]
            return TrainState(
                age=max(0.0, now - min(axis.measured for axis in axes.values())),
                wheels=self._base.wheels({node: axis.velocity for node, axis in axes.items()}),
                angles=self._base.angles,
                odometry=self._base.pose,
                armed=guard.armed,
                fault=fault,
                estop=guard.estop,
                volts=min(volts for volts, _ in told) if told else None,
                volts_age=max(0.0, now - min(at for _, at in told)) if told else math.inf,
            )

    @property
    def wheel_axes(self) -> tuple[WheelAxis, ...]:
        """The wiring of motors to wheels, as far as is known."""
        return self._base.axes

    def rewire(self, axes: Mapping[int, tuple[int, float]]) -> None:
        """Give nodes another direction and ratio, as a calibration has found them; the odometry begins anew."""
        with self._watch.lock:
            changed = [replace(a, direction=axes[a.node][0], ratio=axes[a.node][1]) for a in self._base.axes]
            self._base = DriveBase(changed, self._model)
            self._watch.bind(self._base.bounds)

    def restart_odometry(self) -> None:
        """Let the odometry begin anew where the robot stands."""
        with self._watch.lock:
            self._base.restart()

    def _begin(self) -> None:
        """Begin with axes of which nothing has been heard."""
        axes = [self._axis_type(axis.node, self._bus.send, self.clock, self._options) for axis in self._base.axes]
        for axis in axes:
            axis.unwatched = self._unwatched
        self._watch.begin(axes, self._base.bounds)

    def _rebase(self) -> None:
        """Take whatever the encoders say next as where the wheels are now."""
        self._base.rebase()

    def _on_frame(self, frame: Frame) -> None:
        watch = self._watch
        with watch.lock:
            watch.hear_until(frame.at)
            if not watch.connected:
                self._survey.hear(frame)
            for node, axis in watch.axes.items():
                measured = axis.measured
                try:
                    axis.receive(frame)
                except RobotError as error:  # an answer that could not be sent
                    watch.guard.latch(str(error))
                if axis.measured != measured:
                    estimate = Estimate(axis.position, axis.velocity, axis.measured)
                    watch.compare(node, self._base.update(node, estimate, axis.wrap))
            if watch.connected:
                watch.poll()
                watch.look()

    def _on_trouble(self, words: str) -> None:
        with self._watch.lock:
            self._watch.guard.latch(words)
            if self._watch.connected:
                self._watch.look()

    def _on_quiet(self, heard_until: float) -> None:
        with self._watch.lock:
            self._watch.hear_until(heard_until)
            if self._watch.connected:
                self._watch.poll()
                self._watch.look()
