"""The backend of a robot in the world: its HAL speaks to the world process over the bus."""

import math

from vrg.bus.messages import Drive
from vrg.errors import RobotError, StaleDataError
from vrg.hal.backends import RobotContext
from vrg.hal.robot import Readings, Robot, Wheels, limit_wheels, scan_of

AGREE_TIME = 0.5
"""s of match time after which a robot that the world still calls disarmed takes itself for disarmed."""


class SimRobot(Robot):
    """See the module. The world applies the watchdog, the referee's limits and the emergency stop.

    A reading's age is the distance of its stamp from now either way: one that is far ahead is of before the world was
    set back to a snapshot.

    Where the world has disarmed the robot, by an emergency stop that may have come and gone unseen, this side follows
    at the next `read` or `drive` and tells the world so: the world arms nobody again who was not seen disarmed. Of
    several commands in one tick the world hears the last, so a robot armed in the very tick in which it was disarmed
    is armed by its first command of a later tick.
    """

    def __init__(self, context: RobotContext) -> None:
        super().__init__(context.name, context.model)
        self._mailbox = context.mailbox
        self._drive_topic = context.keys.drive(context.name)
        self._states = context.mailbox.subscribe(context.keys.robot_state(context.name))
        self._lasers = context.mailbox.subscribe(context.keys.laser(context.name))
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
        self._send(0.0, 0.0)

    def drive(self, left: float, right: float) -> Wheels:
        """Command wheel speeds, rad/s.

        Returns:
            what was sent, after the model's limit.

        Raises:
            RobotError: not armed, stopped by the emergency stop, or a speed that is not finite.
        """
        if not (math.isfinite(left) and math.isfinite(right)):
            raise RobotError(f"{self.name}: expected finite wheel speeds, got {left} and {right}")
        if self._stopped():
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm again")
        if not self._armed:
            raise RobotError(f"{self.name}: expected an armed robot to drive: call arm() first")
        wheels = limit_wheels(left, right, self.features.wheel_speed_max)
        self._send(wheels.left, wheels.right)
        return wheels

    def read(self) -> Readings:
        """The newest readings.

        Raises:
            StaleDataError: none has come yet.
        """
        received = self._states.latest
        if not self._connected:
            raise StaleDataError(f"{self.name}: expected a connected robot to read: call connect() first")
        if received is None:
            raise StaleDataError(f"{self.name}: expected a reading, but none has come yet: is the world running?")
        self._stopped()
        state, scan = received.body, self._lasers.latest
        return Readings(
            stamp=received.stamp,
            age=abs(self._mailbox.now - received.stamp),
            ins=state.ins,
            odometry=state.odometry,
            v=state.v,
            w=state.w,
            encoders=state.encoders,
            touch=tuple(state.touch),
            battery=state.battery,
            armed=self._armed and state.armed,
            estop=state.estop,
            fault=state.fault,
            laser=scan_of(scan, self._mailbox.now) if scan is not None else None,
        )

    def stop(self) -> None:
        """Command zero speed; stays armed."""
        if self._connected:
            self._send(0.0, 0.0)

    def disarm(self) -> None:
        """Stop, and let the motors accept no command until armed again. Idempotent."""
        self._armed = False
        if self._connected:
            self._send(0.0, 0.0)

    def close(self) -> None:
        """Disarm and let go. Idempotent."""
        self.disarm()
        self._connected = False

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

    def _send(self, left: float, right: float) -> None:
        now = self._mailbox.now
        if not self._armed:
            self._disarmed = now
        drive = Drive(left=left, right=right, armed=self._armed and now > self._disarmed)
        self._mailbox.publish(self._drive_topic, drive)
