"""The driver of a robot in the world. What other drivers have a wire for, it says to the world over the bus."""

import math
from collections.abc import Sequence

from vrg.bus.mailbox import Inlet
from vrg.bus.messages import Drive, SensorMessage
from vrg.errors import RobotError, StaleDataError
from vrg.hal.backends import MatchContext
from vrg.hal.driver import Driver
from vrg.hal.readings import Readings
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Twist

AGREE_TIME = 0.5
"""s of match time after which a robot that the world still calls disarmed takes itself for disarmed."""


class SimDriver(Driver):
    """See the module. The world applies the watchdog, the referee's limits and the emergency stop as well.

    A reading's age is the distance of its stamp from now either way: one that is far ahead is of before the world was
    set back to a snapshot.

    Where the world has disarmed the robot, by an emergency stop that may have come and gone unseen, this side follows
    at the next `read` or `drive` and tells the world so: the world arms nobody again who was not seen disarmed. Of
    several commands in one tick the world hears the last, so a robot armed in the very tick in which it was disarmed
    is armed by its first command of a later tick.
    """

    physical = False

    def __init__(self, context: MatchContext) -> None:
        super().__init__(context.name, context.model)
        keys, mailbox = context.keys, context.mailbox
        self._mailbox = mailbox
        self._drive_topic = keys.drive(context.name)
        self._states = mailbox.subscribe(keys.robot_state(context.name))
        self._sensors: list[tuple[str, Inlet[SensorMessage]]] = [
            (spec.name, mailbox.subscribe(keys.sensor(spec.message, context.name, spec.name)))
            for spec in context.model.sensors
        ]
        self._connected = False
        self._armed = False
        self._agreed = 0.0
        self._disarmed = -math.inf

    def connect(self) -> None:
        """Begin to listen. Idempotent."""
        self._connected = True

    def arm(self) -> None:
        """Let the motors accept commands.

        Raises:
            RobotError: not connected, or the emergency stop is engaged.
        """
        if not self._connected:
            raise RobotError(f"{self.name}: expected a connected robot to arm: call connect() first")
        if self._stopped():
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm")
        self._armed = True
        self._agreed = self._mailbox.now
        self._send(STILL)

    def drive(self, twist: Twist) -> Twist:
        """Command a motion.

        Returns:
            what was sent, after the model's limit.

        Raises:
            RobotError: not armed, stopped by the emergency stop, or a number that is not finite.
        """
        if not twist.is_finite:
            raise RobotError(f"{self.name}: expected a finite motion, got {twist}")
        if self._stopped():
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm again")
        if not self._armed:
            raise RobotError(f"{self.name}: expected an armed robot to drive: call arm() first")
        sent = self.features.limited(twist)
        self._send(sent)
        return sent

    def read(self) -> Readings:
        """The newest readings.

        Raises:
            StaleDataError: none has come yet.
        """
        if not self._connected:
            raise StaleDataError(f"{self.name}: expected a connected robot to read: call connect() first")
        received = self._states.latest
        if received is None:
            raise StaleDataError(f"{self.name}: expected a reading, but none has come yet: is the world running?")
        self._stopped()
        state = received.body
        return Readings(
            stamp=received.stamp,
            age=abs(self._mailbox.now - received.stamp),
            armed=self._armed and state.armed,
            estop=state.estop,
            fault=state.fault,
            samples=self._samples(),
        )

    def stop(self) -> None:
        """Command zero speed; stays armed."""
        if self._connected:
            self._send(STILL)

    def disarm(self) -> None:
        """Stop, and let the motors accept no command until armed again. Idempotent."""
        self._armed = False
        if self._connected:
            self._send(STILL)

    def close(self) -> None:
        """Disarm and let go. Idempotent."""
        self.disarm()
        self._connected = False

    def _samples(self) -> Sequence[Sample[SensorMessage]]:
        now = self._mailbox.now
        return [
            Sample(received.stamp, abs(now - received.stamp), received.body, name)
            for name, inlet in self._sensors
            if (received := inlet.latest) is not None
        ]

    def _stopped(self) -> bool:
        """Whether the world reports the emergency stop; follows where the world has disarmed the robot."""
        received = self._states.latest
        if received is None:
            return False
        state = received.body
        if state.armed:
            self._agreed = received.stamp
        if self._armed and (state.estop or received.stamp - self._agreed > AGREE_TIME):
            self.disarm()
        return state.estop

    def _send(self, twist: Twist) -> None:
        now = self._mailbox.now
        if not self._armed:
            self._disarmed = now
        self._mailbox.publish(self._drive_topic, Drive(twist=twist, armed=self._armed and now > self._disarmed))
