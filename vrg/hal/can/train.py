"""The drive train of one robot: its axes on a bus, as the machine of its states orders them, and what they report.

This is the thin shell around vrg.hal.can.machine. Three threads meet here: the robot's own, which drives; the bus'
receive thread, which hears; and the one on which the match's emergency stop arrives. One lock guards the machine and
the axes, and it is here. A fourth thread recovers the robot, and holds the lock only as it begins and ends. Setpoints
are sent by the robot's own thread alone; what the others may do is switch motors off.
"""

import logging
import math
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from vrg.errors import RobotError
from vrg.hal.can.axis import Axis, ProtocolOptions
from vrg.hal.can.base import DriveBase, WheelAxis
from vrg.hal.can.frame import Frame
from vrg.hal.can.judges.supply import ANY_SUPPLY
from vrg.hal.can.link import Link, Medium
from vrg.hal.can.machine import AxisMethod, Order, Phase, StateMachine
from vrg.hal.can.meeting import ASK_PERIOD, Meeting, MeetingStep, MissingError
from vrg.hal.can.outputs import Output
from vrg.hal.can.protocols import Protocol
from vrg.hal.models import RobotModel
from vrg.types import Pose, Twist

log = logging.getLogger(__name__)

_MEETING_PERIOD = 0.02
"""s between looks at what has been heard while drives are met."""
_ROUTES = 1000
"""Identifiers of which it is remembered to which axes their frames go."""
_KEPT = 2000
"""Frames that are kept while drives are met, to tell who else speaks on the bus: those of two seconds at least."""


@dataclass(frozen=True, slots=True)
class TrainState:
    """The reports of the drives, at one instant.

    Args:
        age: s since the oldest of the newest encoder estimates; infinite before the first.
        speeds: those of the drivetrain's axes, rad/s. angles: what they have turned since the odometry began, rad.
        odometry: the pose since then.
        armed: every motor obeys. estop: the emergency stop has latched.
        fault: what has latched until a person clears it, in words; None where nothing has.
        volts: the lowest supply voltage; None before any report. volts_age: s since the oldest of those that
            were told; infinite before the first.
    """

    age: float
    speeds: tuple[float, ...]
    angles: tuple[float, ...]
    odometry: Pose
    armed: bool
    fault: str | None
    estop: bool
    volts: float | None
    volts_age: float


class DriveTrain:
    """Drives the axes of one robot on a bus.

    Args:
        name: the robot's name, for messages. medium: the buses. link: which of them is its own.
        protocol: what its drives speak. wheel_axes: how its motors drive its wheels. model: its description.
        options: the protocol's options of its drives; None for the defaults.
        unwatched: a person has allowed that its drives are driven without watchdogs of their own.
        supply: the voltages of an empty and a full battery, V.
        outputs: the actuators at digital outputs of its drives, by their names.

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
        supply: tuple[float, float] = ANY_SUPPLY,
        outputs: Mapping[str, Output] | None = None,
    ) -> None:
        self.name = name
        self._options = options
        self._unwatched = unwatched
        self._protocol, self._axis_type = protocol.name, protocol.axis_type
        self._model = model
        self.clock = medium.clock
        self._bus = medium.bus(link, self._on_frame, self._on_trouble, self._on_quiet)
        self._lock = threading.RLock()
        self._machine = StateMachine(name, DriveBase(wheel_axes, model), supply, outputs)
        self._axes: dict[int, Axis] = {}
        self._routes: dict[tuple[int, bool], tuple[Axis, ...]] = {}
        self._heard: deque[Frame] = deque(maxlen=_KEPT)
        self._traits: dict[int, Mapping[str, str]] = {}

    @property
    def connected(self) -> bool:
        """True if every drive has been met."""
        return self._machine.connected

    def connect(self) -> None:
        """Open the bus, listen, meet every drive and set it up. Idempotent; energises nothing.

        It waits as long as there is something new to hear of the drives, and for their answers while they are set up.

        Raises:
            RobotError: no such interface, a drive that does not answer, speaks another protocol or shares its id. The
                bus is then closed.
        """
        if self.connected:
            return
        with self._lock:
            wired = self._machine.base.axes
            self._axes = {
                axis.node: self._axis_type(axis.node, self._bus.send, self.clock, self._options) for axis in wired
            }
            for node, axis in self._axes.items():
                axis.unwatched = self._unwatched
                axis.outputs = self._machine.outputs.masks.get(node, 0)
            self._routes.clear()
            self._heard.clear()
            self._traits.clear()
            self._machine.begin(list(self._axes.values()))
        try:
            self._bus.listen_to(None)
            self._bus.start()
            self._meet()
        except BaseException as error:
            with self._lock:
                self._machine.close()
            self._bus.stop()
            if isinstance(error, RobotError):
                raise RobotError(str(error), self.name) from None
            raise
        for axis in self._axes.values():
            serial, firmware = axis.serial or "?", axis.firmware or "?"
            log.info("%s: node %d: serial %s, firmware %s", self.name, axis.node, serial, firmware)
        with self._lock:
            self._machine.met(self.clock.now())

    def _meet(self) -> None:
        """Meet every drive on a bus that hears everything, and set it up.

        Raises:
            RobotError: a drive is missing, cannot be used, or is not what it was when the robot was connected.
        """
        axes, phase = list(self._axes.values()), self._machine.phase
        meeting = Meeting(self._protocol, axes, self.clock.now())
        while True:
            with self._lock:
                if self._machine.phase is not phase:
                    raise RobotError("it was closed meanwhile")
                try:
                    step = meeting.step(self.clock.now())
                except MissingError as error:
                    raise RobotError(self._who_is_there(error, meeting.patience)) from None
            if step is MeetingStep.SET_UP:
                break
            if step is MeetingStep.ASK:
                for axis in axes:
                    if not axis.identified:
                        axis.identify(ASK_PERIOD)
            self.clock.sleep(_MEETING_PERIOD)
        for axis in axes:
            axis.prepare()
            before = self._traits.setdefault(axis.node, axis.traits)
            for name, now in axis.traits.items():
                if now != before[name]:
                    raise RobotError(
                        f"node {axis.node}: {name}: expected {before[name]}, as when the robot was connected, got "
                        f"{now}: set it as it was, or connect the robot again"
                    )
        self._bus.listen_to([wanted for axis in axes for wanted in axis.filters])

    def _who_is_there(self, missing: MissingError, patience: float) -> str:
        """The drives that are missing, and the senders that have been received in their place, in words."""
        from vrg.hal.can.workshop.survey import who_speaks  # noqa: PLC0415 - a match that plays never comes here

        trouble = self._machine.guard.fault
        return (
            f"{f'{trouble}; ' if trouble else ''}expected {missing} on {self._bus.link} within {patience:g} s, got "
            f"none; heard there: {who_speaks(self._heard, self.clock)}. Are the ids and the protocol right? If nothing "
            "is heard: are the drives powered, is the bit rate right, and is the bus terminated at both ends?"
        )

    def arm(self) -> None:
        """Ask every axis for closed-loop control; it is called again until `state().armed` is True, as all are there.

        The first time after connecting or recovering, the watchdogs of the drives are proved before; see `Guard`.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        with self._lock:
            self._look()
            self._obey(self._machine.arm(self.clock.now()))
            self._look()
            if self._machine.guard.fault:
                raise RobotError(self._machine.guard.fault, self.name)

    def drive(self, twist: Twist) -> None:
        """Send setpoints for a motion of the body.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a bus that is full.
        """
        with self._lock:
            self._command(self._machine.base.setpoints(twist))

    def use(self, name: str, value: float) -> None:
        """Use an actuator at a digital output: on for a value above 0, off for 0.

        Raises:
            RobotError: as for `drive`, or nothing is wired by that name.
        """
        with self._lock:
            known = self._machine.outputs.wired
            if name not in known:
                raise RobotError(f"expected an actuator at an output ({', '.join(known) or 'none'}), got {name!r}")
            self._look()
            self._obey(self._machine.use(name, value, self.clock.now()))

    def spin(self, node: int, velocity: float) -> None:
        """Turn one motor alone, at `velocity` turn/s, while the others stand: for a robot that is jacked up.

        Raises:
            RobotError: as for `drive`.
        """
        with self._lock:
            self._command([(other, velocity if other == node else 0.0) for other in self._axes])

    def _command(self, setpoints: Sequence[tuple[int, float]]) -> None:
        """Send setpoints. One that cannot go out is dropped, and switches the motors off."""
        self._look()
        if not self._obey(self._machine.drive(setpoints, self.clock.now())):
            self._look()
            raise RobotError(str(self._machine.guard.fault), self.name)

    def stop(self) -> None:
        """Send setpoints of zero, if it is armed and hears the bus. What keeps them from going out latches."""
        with self._lock:
            if not self._obey(self._machine.stand(self.clock.now())):
                self._look()

    def disarm(self) -> None:
        """Switch every motor off, until armed again. Idempotent."""
        with self._lock:
            self._obey(self._machine.disarm(self.clock.now()))

    def emergency_stop(self) -> None:
        """The emergency stop of the match: switch every motor off by the shortest way that the protocol has."""
        with self._lock:
            self._obey(self._machine.engage())

    def release(self) -> None:
        """A person has released the emergency stop. The motors stay off."""
        with self._lock:
            self._obey(self._machine.release(self.clock.now()))

    def recover(self) -> None:
        """Open the bus again, meet the drives again and clear their errors, as a person wants it; the motors stay off.

        A drive that would be refused at connection is refused here, too, and so is one that is not what it was. What is
        wrong latches again. The emergency stop stays. It waits for answers of the drives, so it is called on a thread
        of its own. `close` ends it.
        """
        with self._lock:
            orders = self._machine.recover(self.clock.now())
            if orders is None:
                return
            self._obey(orders)
        problem = self._open_anew()
        with self._lock:
            self._obey(self._machine.recovered(problem, self.clock.now()))

    def _open_anew(self) -> str | None:
        """Close and open the bus, and meet the drives; what kept that from being done, in words."""
        # Outside the lock: the receive thread, which is waited for, may want it.
        try:
            self._bus.stop()
            if trouble := self._bus.restart():
                return trouble
            self._bus.listen_to(None)
            with self._lock:
                # If the robot is closed meanwhile, the bus is closed, and it stays so.
                if self._machine.phase is not Phase.RECOVERING:
                    return None
                # A drive that was started again counts from zero, so its reports are not compared with those before.
                self._machine.base.rebase()
                self._heard.clear()
                for axis in self._axes.values():
                    axis.forget()
                self._bus.start()
            self._meet()
        except RobotError as error:
            return str(error)
        except Exception as error:
            # A recovery runs beside the player: who waits for it must see that it failed.
            log.exception("%s: it could not be recovered", self.name)
            return f"it could not be recovered: {error!r}"
        return None

    def close(self) -> None:
        """Switch the motors off and let go of the bus. Idempotent."""
        with self._lock:
            self.disarm()
            self._machine.close()
        self._bus.stop()

    def state(self) -> TrainState:
        """Return the reports of the drives."""
        with self._lock:
            self._look()
            now, base = self.clock.now(), self._machine.base
            guard, axes = self._machine.guard, self._axes
            fault = guard.fault
            if fault is None and guard.at_drive:
                fault = "the emergency stop was pressed at a drive: release it with `vrg estop --release`"
            supplies = [(axis.voltage, axis.supplied) for axis in axes.values() if axis.voltage is not None]
            return TrainState(
                age=max(0.0, now - min(axis.measured for axis in axes.values())),
                speeds=base.speeds({node: axis.velocity for node, axis in axes.items()}),
                angles=base.angles,
                odometry=base.pose,
                armed=guard.armed,
                fault=fault,
                estop=guard.estop,
                volts=min(volts for volts, _ in supplies) if supplies else None,
                volts_age=max(0.0, now - min(at for _, at in supplies)) if supplies else math.inf,
            )

    @property
    def serials(self) -> dict[int, str]:
        """The serial numbers of the drives by node, in words; empty where they are not known."""
        return {node: axis.serial for node, axis in self._axes.items()}

    @property
    def wheel_axes(self) -> tuple[WheelAxis, ...]:
        """The wiring of motors to wheels, as far as is known."""
        return self._machine.base.axes

    def rewire(self, axes: Mapping[int, tuple[int, float]]) -> None:
        """Give nodes another direction and ratio, as a calibration has found them; the odometry starts again."""
        with self._lock:
            changed = [replace(a, direction=axes[a.node][0], ratio=axes[a.node][1]) for a in self.wheel_axes]
            self._machine.rebind(DriveBase(changed, self._model))

    def restart_odometry(self) -> None:
        """Let the odometry start again where the robot stands."""
        with self._lock:
            self._machine.base.restart()

    def _obey(self, orders: Sequence[Order]) -> bool:
        """Carry out orders, also after another one has failed, but no setpoint after one that could not be sent.

        Returns:
            whether all were carried out; what could not be has latched.
        """
        done = True
        for order in orders:
            if order.act is AxisMethod.COMMAND and not done:
                break
            try:
                getattr(self._axes[order.node], order.act.value)(*order.arguments)
            except Exception as error:
                if not isinstance(error, RobotError):
                    log.exception("%s: node %d: %s", self.name, order.node, order.act.value)
                self._machine.failed(order.act, str(error) or repr(error))
                done = False
        return done

    def _look(self) -> None:
        self._obey(self._machine.look(self.clock.now()))

    def _on_frame(self, frame: Frame) -> None:
        with self._lock:
            axes: Sequence[Axis]
            if self._machine.phase is Phase.MET:
                key = (frame.id, frame.extended)
                route = self._routes.get(key)
                if route is None:
                    if len(self._routes) >= _ROUTES:
                        self._routes.clear()  # a node sends random identifiers
                    wanting = [a for a in self._axes.values() if any(f.passes(frame) for f in a.filters)]
                    route = self._routes[key] = tuple(wanting)
                axes = route
            else:
                self._heard.append(frame)
                axes = tuple(self._axes.values())
            news = False
            for axis in axes:
                before = axis.condition
                try:
                    axis.receive(frame)
                except RobotError as error:  # an answer that could not be sent
                    self._machine.guard.latch(str(error))
                news |= before != axis.condition
            nodes = [axis.node for axis in axes]
            self._obey(self._machine.hear(nodes, frame.at, self.clock.now(), news=news))

    def _on_trouble(self, words: str) -> None:
        with self._lock:
            self._obey(self._machine.trouble(words, self.clock.now()))

    def _on_quiet(self, heard_until: float) -> None:
        with self._lock:
            self._obey(self._machine.hear((), heard_until, self.clock.now()))
