"""The match's side of a robot, written once for every driver.

It enforces what the match demands of a robot, whatever its player does: what the referee permits, the
emergency stop (also while the strategy decides), the recovery from faults, and the lease of a human. It also knows
where a physical robot is on the map, and publishes it for the world.
"""

import logging
import threading
from collections.abc import Mapping

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Manual, MeasuredPose, Motion, OwnPlace
from vrg.bus.node import is_fresh
from vrg.bus.topics import Keys
from vrg.errors import RobotError
from vrg.hal.actuators import UNUSED
from vrg.hal.clock import REAL_CLOCK, MonotonicClock, Task
from vrg.hal.driver import Driver
from vrg.hal.estop import EstopLatch, EstopOrders
from vrg.hal.location import FUSION, ODOMETRY, Location
from vrg.hal.models import RobotModel
from vrg.hal.permission import REFEREE_TIMEOUT, Permission
from vrg.hal.readings import Readings, SensorInlets
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import LEVEL, STILL, Pose, Twist

log = logging.getLogger(__name__)

RECOVERY_TIMEOUT = 2.0
"""The time in s that `close` waits for a running recovery to end; the motors are off meanwhile."""


class Device:
    """The match's side of one robot, between its player and its driver.

    Args:
        driver: the robot's driver; `start` connects it.
        keys: the keys of the match. mailbox: the mailbox of the player's node.
        start: the pose of the robot when the match begins, in the map's frame.
        clock: the time by which a recovery is waited for, and its threads.
        localisation: ODOMETRY, FEED or FUSION of `vrg.hal.location`. A virtual robot may have fusion; without it, its
            own inertial navigation system measures its pose.
    """

    def __init__(
        self,
        driver: Driver,
        keys: Keys,
        mailbox: Mailbox,
        *,
        start: Pose = Pose(0.0, 0.0, 0.0),  # noqa: B008 - it cannot change
        localisation: str = ODOMETRY,
        clock: MonotonicClock = REAL_CLOCK,
    ) -> None:
        self.name = driver.name
        self._driver = driver
        self._mailbox = mailbox
        self._latch = EstopLatch()
        self._permission = Permission()
        self._clock = clock
        self._recovery: Task | None = None
        self._lock = threading.RLock()
        self._asked_to_recover = False
        self._referee = mailbox.subscribe(keys.referee_state, sampled=True)
        self._estops = EstopOrders(mailbox, keys, alarm=self._alarm)
        self._limits = mailbox.subscribe(keys.speed_limit(self.name))
        self._recovers = mailbox.subscribe(keys.recover(self.name))
        self._manual = mailbox.subscribe(keys.manual(self.name))
        self._location = (
            Location(keys, mailbox, self.name, start, localisation)
            if driver.physical or localisation == FUSION
            else None
        )
        self._measured: tuple[MeasuredPose, float] | None = None
        """The pose of the last `read` that is to be published to the world, and its stamp, s."""
        self._odometry: Sample[Odometry] | None = None
        """The odometry of the last `read` that is to be published to the fusion centre."""
        self._own: dict[str, OwnPlace] = {}
        """What sensors of the robot itself have last measured of its place, by the kind of sensor."""
        self._sent: dict[str, float] = {}
        """The stamps of those that were published last, s, by the kind of sensor."""
        synthesised = [s for s in driver.features.sensors if s.synthesised and s.kind not in driver.measures]
        self._synthesised = SensorInlets(keys, mailbox, self.name, synthesised if driver.physical else ())

    @property
    def features(self) -> RobotModel:
        """The description of the robot, which can be read before `start`."""
        return self._driver.features

    @property
    def estop(self) -> bool:
        """True if the emergency stop of the match holds this robot."""
        return self._latch.engaged

    def start(self) -> None:
        """Connect to the robot and disarm it, because an earlier process that crashed may have left it armed.

        Raises:
            RobotError: it cannot be reached.
        """
        self._driver.connect()
        self._driver.disarm()
        if idle := [a.name for a in self.features.actuators if a.name not in self._driver.uses]:
            log.warning(
                "%s: nothing drives its %s, so that using it does nothing: wire it to an output of a drive "
                "(docs/hardware.md), or write `Driver.use` of its backend",
                self.name, " and ".join(idle),
            )  # fmt: skip

    def hear(self) -> None:
        """Take in the messages of the match since the last call. It must be called at the start of each tick."""
        with self._lock:
            self._obey()
        if self._location is not None:
            self._location.hear()
        self._recover()

    def _obey(self) -> None:
        """Take in limits, states of the referee, and orders about the emergency stop."""
        for limit in self._limits.take():
            self._permission.limit(self.name, limit.body.v_max)
        before = self._latch.engaged
        order = self._estops.take()
        released = isinstance(order, EstopRelease)
        if order is not None:
            self._latch.order(not released, self._mailbox.now)
        if (state := self._referee.news()) is not None:
            self._permission.hear(state.stamp, state.body)
            # A referee that has just been restarted, and hears no clock yet, does not know of a stop.
            if state.body.estop or is_fresh(state.stamp, self._mailbox.now, REFEREE_TIMEOUT):
                self._latch.referee(state.body.estop, state.stamp)
        if self._latch.engaged and not before:
            self._driver.emergency_stop()
        if not self._latch.engaged and (before or released):
            self._driver.release()

    def read(self) -> Readings:
        """Return the newest readings, with the sensors that the world simulates for a physical robot.

        Raises:
            StaleDataError: the robot has not reported yet, or its pose is not known yet.
        """
        readings = self._driver.read()
        if self._location is None:
            return readings
        samples = [*readings.samples, *self._synthesised.samples()]
        own, odometry = readings.latest(Ins), readings.latest(Odometry)
        if self._location.fused:
            # What players get must not depend on whether the robot has another way to know where it is.
            samples = [sample for sample in samples if not isinstance(sample.value, Ins)]
            self._take_own(readings)
            own, self._odometry = None, odometry
        if own is None:
            place = self._location.locate(odometry)
            own = Sample(place.stamp, place.age, Ins(pose=place.pose, uncertainty=place.uncertainty))
            samples.append(own)
            age = max(readings.age, own.age)
        else:
            place = self._location.measured(own)
            age = readings.age
        twist = STILL if odometry is None else odometry.value.twist
        self._measured = (MeasuredPose(pose=place.pose, twist=twist), place.stamp) if place.publish else None
        return Readings(
            stamp=self._mailbox.now - age,
            age=age,
            armed=readings.armed,
            estop=readings.estop,
            fault=readings.fault,
            latched=readings.latched,
            samples=samples,
        )

    def _take_own(self, readings: Readings) -> None:
        """Keep what the robot's own sensors measure of its place, for the fusion centre.

        An inertial navigation system of a virtual robot is left out: it would know the pose as well as the world does.

        Args:
            readings: those of the driver. What the world simulates for a physical robot follows from its estimate.
        """
        if self._driver.physical and (ins := readings.latest(Ins)) is not None:
            self._own[Ins.kind] = OwnPlace(max(0.0, ins.stamp), pose=ins.value.pose)
        gps = readings.latest(Gps)
        if gps is not None and gps.value.latitude is not None and gps.value.longitude is not None:
            self._own[Gps.kind] = OwnPlace(max(0.0, gps.stamp), earth=(gps.value.latitude, gps.value.longitude))

    def report(self) -> None:
        """Publish what the last `read` has found: a physical robot's pose, or the odometry for the fusion centre."""
        measured, self._measured = self._measured, None
        odometry, self._odometry = self._odometry, None
        if self._location is None:
            return
        if measured is not None:
            self._mailbox.publish(self._location.topic, measured[0], stamp=measured[1])
        if odometry is not None:
            new = {kind: place for kind, place in self._own.items() if place.stamp > self._sent.get(kind, -1.0)}
            self._sent |= {kind: place.stamp for kind, place in new.items()}
            own = tuple(new.values())
            motion = Motion(odometry=odometry.value.pose, twist=odometry.value.twist, own=own)
            self._mailbox.publish(self._location.motion_topic, motion, stamp=max(0.0, odometry.stamp))

    def manual_twist(self, now: float) -> Twist | None:
        """The motion of the person who holds the lease at match time `now`; None if no person does."""
        manual: Received[Manual] | None = self._manual.latest
        if manual is None or now >= manual.stamp + manual.body.lease or not is_fresh(manual.stamp, now, 1.0):
            return None
        wanted, robot = manual.body, self.features
        climb = wanted.climb * robot.climb_max or LEVEL
        return Twist(wanted.forward * robot.v_max, wanted.turn * robot.w_max, wanted.side * robot.v_max, climb)

    def arm(self) -> None:
        """Let the motors accept commands; `read().armed` is True when they accept them.

        What flies takes off by this, and so is not armed before it may move.

        Raises:
            RobotError: not connected, a fault has latched, the emergency stop is engaged, or the robot is being
                recovered.
        """
        with self._lock:
            if self._latch.engaged:
                raise RobotError("the emergency stop is engaged: release it, then arm", self.name)
            if self._is_recovering:
                raise RobotError("it is being recovered", self.name)
            model = self.features
            if model.flies and self._permission.motion(self.name, model, STILL, self._mailbox.now) is None:
                return
            self._driver.arm()

    def drive(self, twist: Twist, use: Mapping[str, float] = UNUSED) -> Twist:
        """Command a motion, as far as the match permits it. While the referee leases the robot, its own motion counts.

        Args:
            use: what actuators do meanwhile, by their names, within what the robot can do. A robot that is held uses
                none.

        Returns:
            the twist that was really sent, within the limits of the referee and of the robot; STILL if it is held.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a number that is not finite.
        """
        with self._lock:
            if self._latch.engaged:
                raise RobotError("the emergency stop is engaged: release it, then arm again", self.name)
            if not twist.is_finite:
                raise RobotError(f"expected a finite motion, got {twist}", self.name)
            sent = self._permission.motion(self.name, self.features, twist, self._mailbox.now) or STILL
            for name, value in use.items() if self._permission.may_use(self.name, self._mailbox.now) else ():
                if name in self._driver.uses:
                    self._driver.use(name, value)
            if sent == STILL:
                self._driver.stop()
            else:
                self._driver.drive(sent)
            return sent

    def stop(self) -> None:
        """Command zero speed; the robot stays armed."""
        with self._lock:
            self._driver.stop()

    def disarm(self) -> None:
        """Switch the motors off until the robot is armed again. Idempotent."""
        with self._lock:
            self._driver.disarm()

    def close(self) -> None:
        """Disarm the robot and close its driver. Idempotent."""
        self.disarm()
        if self._recovery is not None:
            self._recovery.join(RECOVERY_TIMEOUT)
        self._driver.close()

    def _alarm(self, _order: Received[Estop]) -> None:
        """Stop the robot at once, on whatever thread the order arrives, also while the strategy decides.

        The lock is held while the driver is commanded: no command that began before the order comes after it.
        """
        with self._lock:
            stopped = self._latch.engaged
            self._latch.order(True, self._mailbox.now)
            if not stopped:  # who repeats the order fills no bus with it
                self._driver.emergency_stop()

    @property
    def _is_recovering(self) -> bool:
        return self._recovery is not None and self._recovery.is_alive()

    def _recover(self) -> None:
        """Let the driver recover if the referee asks for it, in its own thread, because a tick must not wait."""
        self._asked_to_recover |= bool(self._recovers.take())
        if self._asked_to_recover and not self._is_recovering:
            self._asked_to_recover = False
            self._recovery = self._clock.spawn(self._try_to_recover, f"recover {self.name}")

    def _try_to_recover(self) -> None:
        try:
            self._driver.recover()
        except Exception:
            # The fault is still latched, and the readings show it.
            log.exception("%s: it could not be recovered", self.name)
