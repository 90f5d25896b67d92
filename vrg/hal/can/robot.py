"""The backend of a robot whose motors are on a CAN bus: a drive train, and what the match has to say to it."""

import math
import threading
from dataclasses import replace

from vrg.bus.codec import Received
from vrg.bus.estop import decisive
from vrg.bus.messages import Estop, MeasuredPose, Pose
from vrg.errors import ConfigError, RobotError, StaleDataError
from vrg.geometry import compose
from vrg.hal.backends import RobotContext
from vrg.hal.can.base import TURN
from vrg.hal.can.calibration import load_calibration
from vrg.hal.can.guard import HEARTBEAT_TIMEOUT
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.train import DriveTrain
from vrg.hal.gate import RefereeGate
from vrg.hal.robot import Readings, Robot, Scan, Wheels, limit_wheels, scan_of

_RECOVERY_PATIENCE = 2.0
"""s for a recovery to end when the robot is closed; its motors are off."""


class CanRobot(Robot):
    """See the module.

    The match clock stamps readings: a match with physical robots runs at rate 1, so that the bus' real seconds, in
    which ages are measured, are the match's too.

    Args:
        context: its options are those of `CanSettings`.

    Raises:
        ConfigError: the settings or the calibration file have problems.
    """

    settings = CanSettings

    def __init__(self, context: RobotContext) -> None:
        settings = CanSettings.model_validate(dict(context.options))
        name, keys = context.name, context.keys
        wiring = settings.robots.get(name)
        if wiring is None:
            raise ConfigError([f"{name}: expected its wiring in [backends.can.robots.{name}]"])
        model, calibration = context.model, None
        if wiring.calibration:
            calibration = load_calibration(context.base / wiring.calibration, wiring.nodes)
            model = replace(model, effective_track=calibration.track)
        super().__init__(name, model)
        self._wiring = wiring
        self._train = DriveTrain(
            name, settings.link(name), settings.axis_type(name), wiring.wheel_axes(calibration), model
        )
        self._mailbox = context.mailbox
        self._start = context.start
        self._located = False
        self._pose_topic = keys.robot_pose(name)
        self._feed = context.mailbox.subscribe(self._pose_topic) if wiring.pose == "feed" else None
        self._world = context.mailbox.subscribe(keys.poses)
        self._lasers = context.mailbox.subscribe(keys.laser(name))
        self._limits = context.mailbox.subscribe(keys.speed_limit(name))
        self._referee = context.mailbox.subscribe(keys.referee_state)
        self._recovers = context.mailbox.subscribe(keys.recover(name))
        self._estops = context.mailbox.subscribe(keys.estop, alarm=self._alarm)
        self._recovery: threading.Thread | None = None
        self._asked_to_recover = False
        self._gate = RefereeGate()
        self._wheel_limit = model.wheel_speed_max

    def connect(self) -> None:
        """Open the bus and meet every drive; see `DriveTrain.connect`.

        Raises:
            RobotError: it cannot be used; says why.
        """
        self._located = self._located and self._train.connected
        self._train.connect()

    def arm(self) -> None:
        """Ask every motor for closed-loop control; `read().armed` tells when all are there.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        self._hear()
        self._train.arm()

    def drive(self, left: float, right: float) -> Wheels:
        """Command wheel speeds, rad/s.

        Returns:
            what was sent, after the limits of model, match and referee.

        Raises:
            RobotError: not armed, a fault, the emergency stop, a speed that is not finite, or a bus that is full.
        """
        if not (math.isfinite(left) and math.isfinite(right)):
            raise RobotError(f"{self.name}: expected finite wheel speeds, got {left} and {right}")
        self._hear()
        wheels = limit_wheels(left, right, self._wheel_limit)
        if self._gate.closed(self._mailbox.now) or self._gate.holds(self.name):
            wheels = Wheels(0.0, 0.0)
        self._train.drive(wheels)
        return wheels

    def read(self) -> Readings:
        """The newest readings. Tells the world where the robot is, if it measures that itself.

        Raises:
            StaleDataError: not connected, no encoder has spoken yet, or the feed has not told where the robot is.
        """
        if not self._train.connected:
            raise StaleDataError(f"{self.name}: expected a connected robot to read: call connect() first")
        self._hear()
        self._locate()
        state = self._train.state()
        if state.age == math.inf:
            raise StaleDataError(f"{self.name}: expected encoder estimates, but none has come yet")
        v, w = self.features.velocity(state.wheels.left, state.wheels.right)
        ticks = self.features.encoder_ticks / TURN
        pose, age = self._pose(state.odometry, v, w, state.age)
        return Readings(
            stamp=self._mailbox.now - age,
            age=age,
            ins=pose,
            odometry=state.odometry,
            v=v,
            w=w,
            encoders=(round(state.angles[0] * ticks), round(state.angles[1] * ticks)),
            touch=(False,) * self.features.bumpers,
            battery=self._charge(state.volts),
            armed=state.armed,
            estop=state.estop,
            fault=f"{self.name}: {state.fault}" if state.fault else None,
            laser=self._scan(),
            latched=state.fault is not None,
        )

    def stop(self) -> None:
        """Command zero speed; stays armed."""
        self._train.stand()

    def disarm(self) -> None:
        """Switch every motor off, until armed again. Idempotent."""
        self._train.disarm()

    def recover(self) -> None:
        """Forget what has latched, as a person has decided; see `DriveTrain.recover`."""
        self._train.recover()

    def close(self) -> None:
        """Disarm and let go. Idempotent."""
        self._train.disarm()
        if self._recovery is not None:
            self._recovery.join(_RECOVERY_PATIENCE)
        self._train.close()

    def _hear(self) -> None:
        """What the match has said since the last look."""
        for limit in self._limits.take():
            self._wheel_limit = min(limit.body.v_max, self.features.v_max) / self.features.wheel_radius
        for state in self._referee.take():
            self._gate.hear(state.stamp, state.body)
        estop = decisive(self._estops.take())
        if estop is not None and estop.engaged:
            self._train.engage()
        elif estop is not None:
            self._train.release()
        self._asked_to_recover |= bool(self._recovers.take())
        if self._asked_to_recover and (self._recovery is None or not self._recovery.is_alive()):
            # Drives that do not answer are waited for, and a tick may not wait.
            self._asked_to_recover = False
            self._recovery = threading.Thread(target=self._train.recover, name=f"recover {self.name}", daemon=True)
            self._recovery.start()

    def _alarm(self, message: Received[Estop]) -> None:
        """The executor calls this the moment that an emergency stop arrives, between two ticks."""
        if message.body.engaged:
            self._train.engage()

    def _locate(self) -> None:
        """Begin where the world last saw this robot: a player that was restarted has forgotten how far it had come."""
        poses = self._world.latest
        if self._located or poses is None:
            return
        for body in poses.body.bodies:
            if body.name == self.name:
                self._start = body.pose
                self._train.restart_odometry()
                self._located = True

    def _pose(self, odometry: Pose, v: float, w: float, age: float) -> tuple[Pose, float]:
        """Where the robot is on the map, and the age of the older of pose and encoders, s.

        The world is told where this side measures it.
        """
        if self._feed is not None:
            fed = self._feed.latest
            if fed is None:
                raise StaleDataError(f"{self.name}: expected its pose on {self._pose_topic.key}, but none has come yet")
            return fed.body.pose, max(age, abs(self._mailbox.now - fed.stamp))
        pose = compose(self._start, odometry)
        if self._located and age <= HEARTBEAT_TIMEOUT:
            self._mailbox.publish(self._pose_topic, MeasuredPose(pose=pose, v=v, w=w))
        return pose, age

    def _scan(self) -> Scan | None:
        received = self._lasers.latest
        return scan_of(received, self._mailbox.now) if received is not None else None

    def _charge(self, volts: float | None) -> float:
        """The battery's charge by its voltage, 0 to 1; full as long as no drive has told."""
        if volts is None:
            return 1.0
        empty, full = self._wiring.supply
        return min(1.0, max(0.0, (volts - empty) / (full - empty)))
