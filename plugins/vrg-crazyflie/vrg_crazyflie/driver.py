"""The backend `crazyflie`: the driver of a Crazyflie, by cflib."""

import logging
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Final

from vrg.bus.messages import SensorMessage
from vrg.errors import RobotError, StaleDataError
from vrg.hal.clock import REAL_CLOCK, MonotonicClock, Task
from vrg.hal.driver import Driver, DriverContext
from vrg.hal.readings import Readings
from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sensors.ins import Ins, InsSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sensors.spec import Sample, SensorSpec
from vrg.types import LEVEL, Pose, Twist
from vrg_crazyflie.flight import Flight, Order
from vrg_crazyflie.radio import Radio
from vrg_crazyflie.report import Info, Motion, Way, motion_of, status_of
from vrg_crazyflie.settings import CrazyflieSettings

log = logging.getLogger(__name__)

PERIOD: Final = 0.04
"""The time in s from one set-point to the next; the firmware levels the body after 0.5 s without one."""
HANGS: Final = 0.4
"""The time in s after which a thread that sends no set-point hangs."""
LANDING: Final = 10.0
"""The time in s that `close` waits for a landing."""
RECOVERY: Final = 20.0
"""The time in s that `recover` waits for a restart."""


class CrazyflieDriver(Driver):
    """A Crazyflie; see `Driver`. Armed means that it has taken off and hovers.

    Args:
        context: its options are those of `CrazyflieSettings`. clock: the time by which it flies.

    Raises:
        ConfigError: the settings have problems.
    """

    settings = CrazyflieSettings
    measures = frozenset({"odometry", "battery"})

    def __init__(self, context: DriverContext, clock: MonotonicClock = REAL_CLOCK) -> None:
        super().__init__(context.name, context.model)
        robot = CrazyflieSettings.read("crazyflie", context.options).robot(context.name)
        self._on_map = robot.pose == "map"
        if self._on_map:
            self.measures = self.measures | {"ins"}
        self._now, self._clock = context.now, clock
        self._radio = Radio(context.name, robot.uri, self._heard, self._lost)
        self._flight = Flight(context.name, robot.height, robot.ceiling, robot.battery_low)
        self._way = Way()
        self._last: Motion | None = None
        """The newest report of the motion; it stays while the link is lost."""
        self._lock = threading.RLock()
        self._task: Task | None = None
        self._closing = False
        self._work: Callable[[], None] | None = None
        """What the thread does before it flies on, such as a restart."""
        self._why_lost = ""
        self._beat = 0.0

    def connect(self) -> None:
        """Open the link, and start the thread that sends set-points. Idempotent; no motor turns.

        Raises:
            RobotError: it does not answer, or its firmware is too old.
        """
        if self._task is not None:
            return
        self._begin_anew(self._radio.open)
        self._closing, self._work = False, None
        self._beat = self._clock.now()
        self._task = self._clock.spawn(self._run, f"crazyflie {self.name}")

    def arm(self) -> None:
        """Take off. It is armed when it hovers at its height.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        with self._lock:
            if self._task is None:
                raise RobotError("expected a connected robot to arm: call connect() first", self.name)
            if self._work is None:
                self._flight.arm(self._clock.now())

    def drive(self, twist: Twist) -> None:
        """Fly at a velocity in the frame of the body. It climbs and sinks within its bounds, if it may.

        Raises:
            RobotError: it does not hover, a fault, or the emergency stop.
        """
        with self._lock:
            self._flight.drive(twist, self._clock.now())
            self._send()

    def stop(self) -> None:
        """Hover in place."""
        with self._lock:
            self._flight.stop()
            self._send()

    def disarm(self) -> None:
        """Land, then switch the motors off. It returns at once, while it still lands. Idempotent."""
        with self._lock:
            self._flight.disarm(self._clock.now())
            self._send()

    def emergency_stop(self) -> None:
        """Cut the motors at once, so that it falls. Its firmware then stays locked until it is restarted."""
        self._flight.engage()  # before the lock: the thread that has it sends no set-point any more
        with suppress(Exception):  # the thread orders it again
            self._radio.send(Order.CUT)

    def release(self) -> None:
        """Let go of the emergency stop, and restart what was cut: nothing else unlocks the firmware."""
        with self._lock:
            if self._flight.engaged:
                self._flight.release()
                self._ask(self._restart)

    def recover(self) -> None:
        """Clear a latched fault: connect again if the link was lost, restart it if its firmware is locked, and let the
        firmware forget a crash if it lies on its feet.

        Raises:
            RobotError: it cannot be reached, still flies, or the fault remains.
        """
        with self._lock:
            if self._task is None or self._flight.engaged or not (self._flight.latched or self._why_lost):
                return
            if self._flight.aloft:  # what it is asked to do would keep the set-points back
                raise RobotError("it still flies: recover it as soon as it has landed", self.name)
            status = self._flight.status
            if self._why_lost or status is None:
                self._ask(lambda: self._begin_anew(self._radio.open))
            else:
                self._ask(self._restart if Info.LOCKED in status.info else self._forgive)
        if not self._clock.wait(lambda: self._work is None, RECOVERY):
            raise RobotError(f"it was not recovered within {RECOVERY:g} s: try it again", self.name)
        if fault := self._flight.latched:
            raise RobotError(fault, self.name)

    def close(self) -> None:
        """Land, then close the link. Idempotent."""
        task = self._task
        if task is None:
            return
        self.disarm()
        if not self._clock.wait(lambda: not self._flight.aloft and self._work is None, LANDING):
            log.error("%s: it has not landed within %g s: its motors are cut", self.name, LANDING)
        self._closing = True
        task.join(2.0)
        self._task = None
        self._radio.close()

    def read(self) -> Readings:
        """The newest readings, as it has reported them.

        Raises:
            StaleDataError: not connected, or it has not reported yet.
        """
        with self._lock:
            if self._task is None:
                raise StaleDataError("expected a connected robot to read: call connect() first", self.name)
            if self._last is None:
                raise StaleDataError("expected a report of its motion, but none was received yet", self.name)
            now = self._clock.now()
            fault = self._fault(now)
            return Readings(
                stamp=self._now() - (now - self._last.heard), age=now - self._last.heard,
                armed=self._flight.armed, estop=self._flight.engaged, fault=fault or None,
                latched=bool(self._flight.latched) and self._work is None,
                samples=self._samples(now, self._last),
            )  # fmt: skip

    def _samples(self, now: float, motion: Motion) -> list[Sample[SensorMessage]]:
        """A sample of each sensor that the model has and it has reported."""
        told: list[tuple[type[SensorSpec], SensorMessage, float]] = [
            (OdometrySpec, Odometry(pose=self._way.pose, twist=motion.twist), motion.heard)
        ]
        if self._on_map:
            told.append(
                (InsSpec, Ins(pose=Pose(motion.x, motion.y, motion.yaw, max(0.0, motion.z) or LEVEL)), motion.heard)
            )
        if (status := self._flight.status) is not None:
            told.append((BatterySpec, Battery(charge=status.charge), status.heard))
        stamp = self._now() - now
        found = ((self.features.sensor(kind), message, heard) for kind, message, heard in told)
        return [Sample(stamp + heard, now - heard, message, spec.name) for spec, message, heard in found if spec]

    def _fault(self, now: float) -> str:
        if self._work is not None:
            return "it is being restarted"
        if now - self._beat > HANGS:
            return f"its driver has hung for {now - self._beat:.1f} s: its firmware levels it and cuts its motors"
        return self._flight.fault(now)

    def _heard(self, values: Mapping[str, float]) -> None:
        """Take in a log block, on cflib's thread."""
        now = self._clock.now()
        with self._lock:
            if "supervisor.info" in values:
                self._flight.hear_status(status_of(values, now))
                return
            motion = motion_of(values, now)
            self._flight.hear(motion)
            if motion.is_finite:
                self._way.move(motion, aloft=self._flies)
                self._last = motion

    @property
    def _flies(self) -> bool:
        """True if it is in the air as far as is known, also where VRG has just connected to it."""
        status = self._flight.status
        return self._flight.aloft or (status is not None and status.flies)

    def _lost(self, why: str) -> None:
        """The link is lost, a thread of cflib's says."""
        self._why_lost = why or "no reason was given"

    def _run(self) -> None:
        """Send what the flight needs, until the driver is closed."""
        while not self._closing:
            work = self._work
            if work is not None:
                try:
                    work()
                except Exception as error:  # the readings have it as a fault
                    log.exception("%s: it could not be recovered", self.name)
                    self._flight.lose(str(getattr(error, "text", error)))  # of a RobotError without the name
                self._beat, self._work = self._clock.now(), None
            with self._lock:
                if self._why_lost:
                    self._flight.lose(f"the link was lost ({self._why_lost}): its firmware cuts its motors: recover it")
                try:
                    self._send()
                except Exception as error:  # without set-points its firmware cuts its motors
                    log.exception("%s: nothing can be sent to it", self.name)
                    self._flight.lose(f"nothing can be sent to it ({error}): its firmware cuts its motors: recover it")
                self._beat = self._clock.now()
            self._clock.sleep(PERIOD)

    def _send(self) -> None:
        """Send what the flight needs now. Needs the lock."""
        if self._work is None and not self._why_lost:
            for command in self._flight.step(self._clock.now()):
                self._radio.send(command)

    def _ask(self, work: Callable[[], None]) -> None:
        """Let the thread do something before it flies on. Needs the lock."""
        if self._work is None and self._task is not None:
            self._work = work

    def _restart(self) -> None:
        self._begin_anew(lambda: self._radio.restart(self._clock))

    def _begin_anew(self, reach: Callable[[], None]) -> None:
        """Reach it again, as one that stands on the ground and knows of nothing."""
        self._radio.close()  # a last report of before would be taken for the first one of its new way
        with self._lock:
            self._flight.forget()
            self._way.anew()
        reach()
        self._why_lost = ""

    def _forgive(self) -> None:
        """Let the firmware forget a crash, and see whether it does."""
        self._radio.send(Order.RECOVER)
        self._clock.sleep(0.5)
        with self._lock:
            self._flight.latched = ""
            if self._flight.status is not None:
                self._flight.hear_status(self._flight.status)
