"""The drive train of one robot: its axes on a bus, watched over, and what they say together.

Two threads meet here: the player's, which drives, and the bus' receive thread, which hears. One lock guards all that
both touch. Setpoints are sent by the player's thread alone, in `drive`, `spin` and `stand`: if it freezes or dies,
nothing is sent, and the drives' own watchdogs stop the motors. The receive thread never sends a setpoint; what it may
do is switch motors off.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from vrg.bus.messages import Pose
from vrg.errors import RobotError
from vrg.hal.can.axis import Axis
from vrg.hal.can.base import DriveBase, Estimate, WheelAxis
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import Guard
from vrg.hal.can.link import Link
from vrg.hal.can.survey import Survey
from vrg.hal.models import RobotModel
from vrg.hal.robot import Wheels

log = logging.getLogger(__name__)

MEET_PATIENCE = 3.0
"""s for every drive to say who it is when the robot connects."""
ANSWERS_SETTLE = 0.2
"""s more, for a second drive with the same id to answer too."""
BLIND = 0.3
"""s without news of the bus after which nobody drives: the receive thread has been kept from running."""
_POLL = 0.02


@dataclass(frozen=True, slots=True)
class TrainState:
    """What the drives say, at one instant.

    Args:
        age: s since the oldest of the newest encoder estimates; infinite before the first.
        wheels: speeds, rad/s. angles: turned since the odometry began, left and right, rad.
        odometry: pose since then. armed: every motor obeys.
        fault: what has latched until a person clears it, in words. estop: the emergency stop has.
        volts: lowest supply voltage, None before any drive has told.
    """

    age: float
    wheels: Wheels
    angles: tuple[float, float]
    odometry: Pose
    armed: bool
    fault: str | None
    estop: bool
    volts: float | None


class DriveTrain:
    """See the module.

    Args:
        name: of the robot, for messages. link: its bus. axis_type: by the protocol of its drives.
        wheel_axes: how its motors drive its wheels. model: its description.
    """

    def __init__(
        self, name: str, link: Link, axis_type: type[Axis], wheel_axes: Sequence[WheelAxis], model: RobotModel
    ) -> None:
        self.name = name
        self.connected = False
        self._axis_type = axis_type
        self._model = model
        self._lock = threading.RLock()
        self._recovering = False
        self._told: str | None = None
        self._complained = ""
        self._heard_until = -math.inf
        """Monotonic s up to which all that was on the bus has been heard: what waits unread is not missing."""
        self._survey = Survey()
        self._bus = CanBus(link, self._on_frame, self._on_trouble, self._on_quiet)
        self._base = DriveBase(wheel_axes, model)
        self._begin()

    def connect(self) -> None:
        """Open the bus and meet every drive. Idempotent; energises nothing. Waits for MEET_PATIENCE s at most.

        Raises:
            RobotError: no such interface, a drive that does not answer, speaks another protocol or shares its id.
        """
        if self.connected:
            return
        with self._lock:
            self._begin()
            self._base.restart()
        try:
            self._bus.listen_to(None)
            self._bus.start()
            self._meet()
            for axis in self._axes.values():
                axis.prepare()
            self._bus.listen_to([wanted for axis in self._axes.values() for wanted in axis.filters])
        except RobotError as error:
            self._bus.stop()
            raise RobotError(f"{self.name}: {error}") from None
        except BaseException:
            self._bus.stop()
            raise
        for axis in self._axes.values():
            log.info(
                "%s: node %d: serial %s, firmware %s", self.name, axis.node, axis.serial or "?", axis.firmware or "?"
            )
        with self._lock:
            self._guard.begin(time.monotonic())
            self.connected = True

    def arm(self) -> None:
        """Ask every axis for closed-loop control; `state().armed` tells when all are there.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        if not self.connected:
            raise RobotError(f"{self.name}: expected a connected robot to arm: call connect() first")
        with self._lock:
            now = time.monotonic()
            refusal = "it is being recovered" if self._recovering else self._guard.refusal(now)
            if refusal:
                raise RobotError(f"{self.name}: {refusal}")
            if self._guard.wanted:
                return
            self._base.rebase()
            self._guard.arm(now)
            starved = [axis for axis in self._axes.values() if axis.starved]
            self._each("clear errors", [axis.clear for axis in starved])
            for axis in starved:
                axis.starved = False
            self._each("arm", [axis.start for axis in self._axes.values()])
            self._look()
            if self._guard.fault:
                raise RobotError(f"{self.name}: {self._guard.fault}")

    def drive(self, wheels: Wheels) -> None:
        """Send setpoints for wheel speeds in rad/s.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a bus that is full.
        """
        with self._lock:
            self._require_armed()
            self._send(self._base.setpoints(wheels))

    def spin(self, node: int, velocity: float) -> None:
        """Turn one motor alone, turn/s, while the others stand: for a robot that is jacked up.

        Raises:
            RobotError: as `drive`.
        """
        with self._lock:
            self._require_armed()
            self._send([(other, velocity if other == node else 0.0) for other in self._axes])

    def stand(self) -> None:
        """Send setpoints of zero, if it is armed and hears the bus. What keeps them from going out latches."""
        with self._lock:
            if self.connected and self._guard.wanted and self._deaf <= BLIND:
                try:
                    self._send([(node, 0.0) for node in self._axes])
                except RobotError as error:
                    log.warning("%s", error)

    def disarm(self) -> None:
        """Switch every motor off, until armed again. Idempotent."""
        with self._lock:
            self._guard.disarm()
            if self.connected:
                self._idle()

    def engage(self) -> None:
        """The emergency stop of the match: every motor off, by the shortest way that the protocol has."""
        if self.connected:
            with self._lock:
                self._guard.engage()
                self._each("emergency stop", [axis.stop_now for axis in self._axes.values()])

    def release(self) -> None:
        """A person has released the emergency stop. The motors stay off."""
        with self._lock:
            if self.connected and self._guard.estop:
                self._guard.release(time.monotonic())
                self._clear()

    def recover(self) -> None:
        """A person clears what has latched: open the bus anew, set the drives up, clear their errors; motors stay off.

        What is still wrong latches again within a second. The emergency stop stays. It waits for drives' answers.
        """
        with self._lock:
            if not self.connected or self._recovering:
                return
            self._recovering = True
            self._guard.disarm()
            self._idle()
        problem = self._open_anew()
        with self._lock:
            self._recovering = False
            # What a person needs to know from now on is this, and no longer what was wrong before.
            self._guard.begin(time.monotonic())
            self._base.rebase()
            if problem:
                self._guard.latch(problem)
            elif self.connected:
                self._idle()
                if not self._guard.estop:
                    self._clear()
            self._look()
        if not problem:
            log.info("%s: faults are cleared, the motors are off", self.name)

    def close(self) -> None:
        """Switch the motors off and let go of the bus. Idempotent."""
        self.disarm()
        with self._lock:
            self.connected = False
        self._bus.stop()

    def state(self) -> TrainState:
        """What the drives say."""
        with self._lock:
            self._look()
            now = time.monotonic()
            guard, axes = self._guard, self._axes
            fault = guard.fault
            if fault is None and guard.at_drive:
                fault = "the emergency stop was pressed at a drive: release it by `vrg estop --release`"
            volts = [axis.voltage for axis in axes.values() if axis.voltage is not None]
            return TrainState(
                age=max(0.0, now - min(axis.measured for axis in axes.values())),
                wheels=self._base.wheels({node: axis.velocity for node, axis in axes.items()}),
                angles=self._base.angles,
                odometry=self._base.pose,
                armed=guard.armed,
                fault=fault,
                estop=guard.estop,
                volts=min(volts) if volts else None,
            )

    @property
    def wheel_axes(self) -> tuple[WheelAxis, ...]:
        """How the motors drive the wheels, as far as is known."""
        return self._base.axes

    def rewire(self, axes: Mapping[int, tuple[int, float]]) -> None:
        """Give nodes another direction and ratio, as a calibration has found them; the odometry begins anew."""
        with self._lock:
            changed = [replace(a, direction=axes[a.node][0], ratio=axes[a.node][1]) for a in self._base.axes]
            self._base = DriveBase(changed, self._model)

    def restart_odometry(self) -> None:
        """Let the odometry begin anew where the robot stands."""
        with self._lock:
            self._base.restart()

    def _open_anew(self) -> str | None:
        """Close and open the bus, and set the drives up; what kept that from being done, in words."""
        # Outside the lock: the receive thread, which is waited for, may want it.
        try:
            self._bus.stop()
            self._bus.start()
            for axis in self._axes.values():
                axis.prepare()
        except RobotError as error:
            return str(error)
        except Exception as error:
            # A recovery runs beside the player: who waits for it must see that it failed.
            log.exception("%s: it could not be recovered", self.name)
            return f"it could not be recovered: {error!r}"
        return None

    def _begin(self) -> None:
        """Nothing has been heard of anybody."""
        self._survey = Survey()
        nodes = [axis.node for axis in self._base.axes]
        self._axes = {node: self._axis_type(node, self._bus.send) for node in nodes}
        self._guard = Guard(list(self._axes.values()))

    def _meet(self) -> None:
        """Wait until every drive has said who it is.

        Raises:
            RobotError: one did not, or cannot be used.
        """
        axes = self._axes.values()
        asked = -math.inf
        deadline = time.monotonic() + MEET_PATIENCE
        while not all(axis.heard > 0 and axis.identified for axis in axes):
            if time.monotonic() > deadline:
                raise RobotError(self._who_is_missing())
            if time.monotonic() - asked > MEET_PATIENCE / 6:
                asked = time.monotonic()
                for axis in axes:
                    if not axis.identified:
                        axis.identify()
            time.sleep(_POLL)
        time.sleep(ANSWERS_SETTLE)
        problems = [f"node {axis.node}: {axis.problem}" for axis in axes if axis.problem]
        problems += [f"node {axis.node}: {axis.odd}" for axis in axes if axis.odd]
        if problems:
            raise RobotError("; ".join(problems))

    def _who_is_missing(self) -> str:
        axes = self._axes.values()
        silent = [str(axis.node) for axis in axes if axis.heard < 0]
        mute = [str(axis.node) for axis in axes if axis.heard >= 0 and not axis.identified]
        which = f"node{'s' if len(silent or mute) > 1 else ''} {', '.join(silent or mute)}"
        what = "a heartbeat" if silent else "an answer to who they are"
        trouble = f"{self._guard.fault}; " if self._guard.fault else ""
        return (
            f"{trouble}expected {what} of {self._axis_type.protocol} {which} on {self._bus.link} within "
            f"{MEET_PATIENCE:g} s, got none; heard there: {self._survey}. Are the ids and the protocol right?"
        )

    @property
    def _deaf(self) -> float:
        """s since the receive thread was last known to keep up with the bus."""
        return time.monotonic() - self._heard_until

    def _require_armed(self) -> None:
        self._look()
        if self._guard.estop:
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm again")
        if self._guard.fault:
            raise RobotError(f"{self.name}: {self._guard.fault}")
        if not self._guard.wanted:
            raise RobotError(f"{self.name}: expected an armed robot to drive: call arm() first")
        if self._deaf > BLIND:
            raise RobotError(f"{self.name}: nothing has been heard of the bus for {self._deaf:.1f} s")

    def _send(self, setpoints: Sequence[tuple[int, float]]) -> None:
        """Send setpoints by node, turn/s. One that cannot go out is dropped, and switches the motors off."""
        try:
            for node, velocity in setpoints:
                self._axes[node].command(velocity)
        except RobotError as error:
            self._guard.latch(str(error))
            self._look()
            raise RobotError(f"{self.name}: {self._guard.fault}") from None

    def _each(self, what: str, actions: Sequence[Callable[[], None]]) -> None:
        """Do something to every axis, whatever becomes of the others."""
        for act in actions:
            try:
                act()
            except RobotError as error:
                words = f"{what}: {error}"
                if words != self._complained:  # a player that is stopped asks again at every tick
                    self._complained = words
                    log.warning("%s: %s", self.name, words)
                self._guard.latch(str(error))

    def _clear(self) -> None:
        self._each("clear errors", [axis.clear for axis in self._axes.values()])

    def _idle(self) -> None:
        self._each("switch off", [axis.idle for axis in self._axes.values()])

    def _look(self) -> None:
        """Judge, switch off if need be, and say so once."""
        if self._guard.look(self._heard_until):
            self._idle()
        if self._guard.fault != self._told:
            self._told = self._guard.fault
            if self._told:
                log.error("%s: %s: its motors are off until it is recovered", self.name, self._told)

    def _on_frame(self, frame: Frame) -> None:
        with self._lock:
            self._heard_until = max(self._heard_until, frame.at)
            if not self.connected:
                self._survey.hear(frame)
            for node, axis in self._axes.items():
                measured = axis.measured
                try:
                    axis.receive(frame)
                except RobotError as error:  # an answer that could not be sent
                    self._guard.latch(str(error))
                if axis.measured != measured:
                    estimate = Estimate(axis.position, axis.velocity, axis.measured)
                    if not self._base.update(node, estimate, axis.wrap) and self._guard.armed:
                        self._guard.latch(f"node {node}: its position jumped: was the drive started again?")
            if self.connected:
                self._look()

    def _on_trouble(self, words: str) -> None:
        with self._lock:
            self._guard.latch(words)
            if self.connected:
                self._look()

    def _on_quiet(self) -> None:
        with self._lock:
            self._heard_until = time.monotonic()
            if self.connected:
                self._look()
