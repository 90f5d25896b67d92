"""The match's side of a robot, written once for every driver.

It enforces what the match has to say to a robot, whatever its player does: the referee's gate, the speed limit, the
emergency stop (also between two ticks), the recovery from faults, and the lease of a human. It knows where a physical
robot is on the map, and tells the world.
"""

import logging
import threading
from collections.abc import Sequence

from vrg.bus.codec import Received
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Estop, Manual, MeasuredPose, SensorMessage
from vrg.bus.node import is_fresh
from vrg.bus.topics import Keys
from vrg.errors import RobotError
from vrg.hal.driver import Driver
from vrg.hal.estop import EstopLatch, decisive
from vrg.hal.gate import RefereeGate
from vrg.hal.location import Location
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Pose, Twist

log = logging.getLogger(__name__)

RECOVERY_PATIENCE = 2.0
"""s for a recovery to end when the robot is closed; its motors are off."""
FEED = "feed"
"""The localisation of a robot whose pose somebody else measures, a motion-capture system say."""


class Device:
    """See the module.

    Args:
        driver: of the robot; connected by `start`.
        keys: of the match. mailbox: of the player's node.
        start: where the robot stands when the match begins.
        localisation: `odometry`: the robot's own measurement tells where it is; `feed`: somebody else publishes it.
    """

    def __init__(
        self,
        driver: Driver,
        keys: Keys,
        mailbox: Mailbox,
        *,
        start: Pose = Pose(0.0, 0.0, 0.0),  # noqa: B008 - it cannot change
        localisation: str = "odometry",
    ) -> None:
        self.name = driver.name
        self._driver = driver
        self._mailbox = mailbox
        self._latch = EstopLatch()
        self._gate = RefereeGate()
        self._limit: float | None = None
        self._recovery: threading.Thread | None = None
        self._asked_to_recover = False
        self._referee = mailbox.subscribe(keys.referee_state)
        self._estops = mailbox.subscribe(keys.estop, alarm=self._alarm)
        self._limits = mailbox.subscribe(keys.speed_limit(self.name))
        self._recovers = mailbox.subscribe(keys.recover(self.name))
        self._manual = mailbox.subscribe(keys.manual(self.name))
        self._location = (
            Location(keys, mailbox, self.name, start, fed=localisation == FEED) if driver.physical else None
        )
        self._synthesised: list[tuple[str, Inlet[SensorMessage]]] = []
        if driver.physical:
            self._synthesised = [
                (spec.name, mailbox.subscribe(keys.sensor(spec.message, self.name, spec.name)))
                for spec in driver.features.sensors
                if spec.synthesised and spec.kind not in driver.measures
            ]

    @property
    def features(self) -> RobotModel:
        """The robot's description."""
        return self._driver.features

    @property
    def estop(self) -> bool:
        """The emergency stop of the match holds this robot."""
        return self._latch.engaged

    def start(self) -> None:
        """Reach the robot; whatever a forerunner that crashed has left behind, it begins disarmed.

        Raises:
            RobotError: it cannot be reached.
        """
        self._driver.connect()
        self._driver.disarm()

    def hear(self) -> None:
        """Take in what the match has said since the last call; to be called at the begin of each tick."""
        for limit in self._limits.take():
            self._limit = limit.body.v_max
        before = self._latch.engaged
        order = decisive(self._estops.take())
        if order is not None:
            self._latch.order(order.engaged, self._mailbox.now)
        for state in self._referee.take():
            self._gate.hear(state.stamp, state.body)
            self._latch.referee(state.body.estop, state.stamp)
        if self._latch.engaged and not before:
            self._driver.emergency_stop()
        released = order is not None and not order.engaged
        if not self._latch.engaged and (before or released):
            self._driver.release()
        if self._location is not None:
            self._location.hear()
        self._recover()

    def read(self) -> Readings:
        """The newest readings, with what the world simulates for a physical robot; tells the world where that is.

        Raises:
            StaleDataError: the robot has said nothing yet, or it is not known where it is.
        """
        readings = self._driver.read()
        if self._location is None:
            return readings
        samples = [*readings.samples, *self._of_the_world()]
        own = readings.ins
        if own is None:
            place = self._location.locate(readings.odometry)
            own = Sample(place.stamp, place.age, Ins(pose=place.pose))
            samples.append(own)
            age = max(readings.age, own.age)
        else:
            place = self._location.measured(own)
            age = readings.age
        if place.publish:
            twist = STILL if readings.odometry is None else readings.odometry.value.twist
            pose = MeasuredPose(pose=place.pose, v=twist.v, w=twist.w)
            self._mailbox.publish(self._location.topic, pose, stamp=place.stamp)
        return Readings(
            stamp=self._mailbox.now - age,
            age=age,
            armed=readings.armed,
            estop=readings.estop,
            fault=readings.fault,
            latched=readings.latched,
            samples=samples,
        )

    def lease(self, now: float) -> Twist | None:
        """The motion that a human asks for who holds the lease at match time `now`; None where nobody does."""
        manual: Received[Manual] | None = self._manual.latest
        if manual is None or now >= manual.stamp + manual.body.lease or not is_fresh(manual.stamp, now, 1.0):
            return None
        return Twist(manual.body.forward * self.features.v_max, manual.body.turn * self.features.w_max)

    def arm(self) -> None:
        """Let the motors accept commands; `read().armed` tells when they do.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        if self._latch.engaged:
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm")
        if self._is_recovering:
            raise RobotError(f"{self.name}: it is being recovered")
        self._driver.arm()

    def drive(self, twist: Twist) -> Twist:
        """Command a motion, as far as the match allows it.

        Returns:
            what was really sent, after the referee's limits and the robot's.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a number that is not finite.
        """
        if self._latch.engaged:
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm again")
        if not twist.is_finite:
            raise RobotError(f"{self.name}: expected a finite motion, got {twist}")
        if self._gate.closed(self._mailbox.now) or self._gate.holds(self.name):
            twist = STILL
        return self._driver.drive(self.features.limited(twist, self._limit))

    def stop(self) -> None:
        """Command zero speed; stays armed."""
        self._driver.stop()

    def disarm(self) -> None:
        """Switch the motors off, until armed again. Idempotent."""
        self._driver.disarm()

    def close(self) -> None:
        """Disarm and let go of the robot. Idempotent."""
        self._driver.disarm()
        if self._recovery is not None:
            self._recovery.join(RECOVERY_PATIENCE)
        self._driver.close()

    def _alarm(self, message: Received[Estop]) -> None:
        """The executor calls this the moment that an order arrives, between two ticks."""
        if message.body.engaged:
            self._latch.order(True, self._mailbox.now)
            self._driver.emergency_stop()

    @property
    def _is_recovering(self) -> bool:
        return self._recovery is not None and self._recovery.is_alive()

    def _recover(self) -> None:
        """Let the driver recover where the referee asks for it: a robot may be waited for, and a tick may not wait."""
        self._asked_to_recover |= bool(self._recovers.take())
        if self._asked_to_recover and not self._is_recovering:
            self._asked_to_recover = False
            self._recovery = threading.Thread(target=self._try_to_recover, name=f"recover {self.name}", daemon=True)
            self._recovery.start()

    def _try_to_recover(self) -> None:
        try:
            self._driver.recover()
        except Exception:
            # The fault is still latched, and is shown as such.
            log.exception("%s: it could not be recovered", self.name)

    def _of_the_world(self) -> Sequence[Sample[SensorMessage]]:
        """What the world simulates for this robot.

        The age of a sample is the distance of its stamp from now either way: one that is far ahead is of before the
        world was set back to a snapshot.
        """
        now = self._mailbox.now
        return [
            Sample(received.stamp, abs(now - received.stamp), received.body, name)
            for name, inlet in self._synthesised
            if (received := inlet.latest) is not None
        ]
