"""The driver of a virtual robot. Where other drivers use a cable to the robot, it speaks to the world over the bus."""

import math

from vrg.bus.messages import Drive
from vrg.errors import RobotError, StaleDataError
from vrg.hal.backends import MatchContext
from vrg.hal.driver import Driver
from vrg.hal.readings import Readings, SensorInlets
from vrg.types import STILL, Twist

AGREE_TIME = 0.5
"""The match time in s after which an armed driver gives up if the world still reports its robot as disarmed."""


class SimDriver(Driver):
    """The driver of a virtual robot. The world applies the watchdog, the referee's limits and the emergency stop too.

    The age of a reading is the absolute difference of its stamp and now. A stamp far in the future is from before the
    world was set back to a snapshot, so the reading is old.

    An emergency stop may come and go without this driver seeing it. If the world has disarmed the robot, the driver
    disarms itself at the next `drive`, `arm` or `stop` and sends a disarmed command, because after an emergency stop
    the world arms a robot only after it has heard such a command. The world hears only the last of several commands in
    one tick. So a robot that is disarmed and armed in the same tick is armed by its first command of a later tick.

    Args:
        context: the robot's name, its model, and the keys and the mailbox of its player's node.
    """

    physical = False

    def __init__(self, context: MatchContext) -> None:
        super().__init__(context.name, context.model)
        keys, mailbox = context.keys, context.mailbox
        self._mailbox = mailbox
        self._drive_topic = keys.drive(context.name)
        self._states = mailbox.subscribe(keys.robot_state(context.name), sampled=True)
        self._sensors = SensorInlets(keys, mailbox, context.name, context.model.sensors)
        self._use: dict[str, float] = {}
        self.uses = frozenset(actuator.name for actuator in context.model.actuators)
        self._connected = False
        self._armed = False
        self._agreed = 0.0
        self._disarmed = -math.inf

    def connect(self) -> None:
        """Begin to use what the world publishes about the robot. Idempotent."""
        self._connected = True

    def arm(self) -> None:
        """Let the motors accept commands.

        Raises:
            RobotError: not connected, or the emergency stop is engaged.
        """
        if not self._connected:
            raise RobotError("expected a connected robot to arm: call connect() first", self.name)
        if self._stopped():
            raise RobotError("the emergency stop is engaged: release it, then arm", self.name)
        if not self._armed:
            self._armed, self._agreed = True, self._mailbox.now
        self._send(STILL)

    def drive(self, twist: Twist) -> None:
        """Command a motion.

        Raises:
            RobotError: not armed, or stopped by the emergency stop.
        """
        if self._stopped():
            raise RobotError("the emergency stop is engaged: release it, then arm again", self.name)
        if not self._armed:
            raise RobotError("expected an armed robot to drive: call arm() first", self.name)
        self._send(twist)

    def use(self, name: str, value: float) -> None:
        """Use an actuator of the robot with the next command.

        Raises:
            RobotError: its model has none of that name.
        """
        if name not in self.uses:
            super().use(name, value)
        self._use[name] = value

    def read(self) -> Readings:
        """Return the newest readings.

        Raises:
            StaleDataError: the driver is not connected, or no reading has arrived yet.
        """
        if not self._connected:
            raise StaleDataError("expected a connected robot to read: call connect() first", self.name)
        received = self._states.latest
        if received is None:
            raise StaleDataError("expected a reading, but none was received yet: is the world running?", self.name)
        state = received.body
        return Readings(
            stamp=received.stamp,
            age=abs(self._mailbox.now - received.stamp),
            armed=self._armed and state.armed,
            estop=state.estop,
            fault=state.fault,
            samples=self._sensors.samples(),
        )

    def stop(self) -> None:
        """Command zero speed; the robot stays armed, unless the world has disarmed it."""
        if self._connected:
            self._stopped()
            self._send(STILL)

    def disarm(self) -> None:
        """Stop, and let the motors accept no command until the robot is armed again. Idempotent."""
        self._armed = False
        if self._connected:
            self._send(STILL)

    def emergency_stop(self) -> None:
        """Accept no command until the robot is armed again. The world hears the order itself, and stops the robot."""
        self._armed = False

    def close(self) -> None:
        """Disarm the robot and end the connection. Idempotent."""
        self.disarm()
        self._connected = False

    def _stopped(self) -> bool:
        """True if the world reports the emergency stop. Disarms this side if the world has disarmed the robot."""
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
        use, self._use = self._use, {}
        armed = self._armed and now > self._disarmed
        self._mailbox.publish(self._drive_topic, Drive(twist=twist, armed=armed, use=use))
