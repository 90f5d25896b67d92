"""The backend `ros`: the driver of a robot that runs ROS 2, by its topics."""

import logging
import math
import queue
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, Final

from vrg.errors import BusError, ConfigError, MessageError, Problem, RobotError, StaleDataError
from vrg.hal.clock import REAL_CLOCK, Clock, Task
from vrg.hal.driver import COMMAND_TIMEOUT, Driver, DriverContext
from vrg.hal.readings import Readings
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.ros import messages as ros
from vrg.ros.meeting import ODOMETRY, STAMPED, graph_of, met, no_router
from vrg.ros.reported import Reported
from vrg.ros.settings import RosSettings
from vrg.ros.wire import ros_name
from vrg.types import STILL, Twist

if TYPE_CHECKING:
    from vrg.bus.session import Session
    from vrg.ros.graph import RosNode

log = logging.getLogger(__name__)

PERIOD: Final = 0.05
"""The time in s between two commands to the robot."""
SILENT: Final = 0.5
"""The age in s of the odometry above which the robot is not driven."""
ZEROS: Final = 1.0
"""The time in s for which a robot that was disarmed is commanded to stand. Then another node may drive it."""
PATIENCE: Final = 5.0
"""The time in s to wait for the robot's nodes in the graph."""


class RosDriver(Driver):
    """See `Driver`. ROS has no arming: this driver commands zeros, or nothing, while the robot is disarmed.

    A thread of its own repeats the command every PERIOD, and commands zeros when no new one has come for
    COMMAND_TIMEOUT. If this process dies, the robot's own driver must stop it.

    Args:
        context: its options are those of `RosSettings`. clock: monotonic time, and the thread.

    Raises:
        ConfigError: the settings have no table for this robot.
    """

    settings = RosSettings
    measures = frozenset({Odometry.kind, Laser.kind, Battery.kind})

    def __init__(self, context: DriverContext, *, clock: Clock = REAL_CLOCK) -> None:
        super().__init__(context.name, context.model)
        settings = RosSettings.model_validate(dict(context.options))
        if context.name not in settings.robots:
            where = ("backends", "ros", "robots")
            raise ConfigError([Problem(f"expected its topics in [backends.ros.robots.{context.name}]", where)])
        self._robot = settings.robots[context.name]
        self._router, self._domain = settings.reached(context.name)
        lacks = {Laser.kind: not self._robot.scan, Battery.kind: not self._robot.battery}
        has = {spec.kind for spec in context.model.sensors}
        self.measures = frozenset(kind for kind in self.measures & has if not lacks.get(kind))
        self._now, self._clock = context.now, clock
        self._lock = threading.Lock()
        self._changed: queue.Queue[None] = queue.Queue(maxsize=1)
        """Wakes the thread."""
        self._reported = self._no_report()
        self._inlets: list[tuple[Callable[[], list[dict[str, Any]]], Callable[[dict[str, Any], float], None]]] = []
        self._open: ExitStack | None = None
        self._session: Session | None = None
        self._task: Task | None = None
        self._closing = False
        self._armed = self._engaged = False
        self._command, self._commanded = STILL, -math.inf
        self._stood = -math.inf
        """The time since when the robot is commanded to stand, s."""
        self._failure: BaseException | None = None
        self._warned: set[str] = set()

    def connect(self) -> None:
        """Open a session with the router, and find the robot in the graph. Idempotent.

        Raises:
            RobotError: there is no router, or no node that obeys commands and publishes odometry; it says which.
        """
        # Match files are checked, and players are sealed, by processes that must not have zenoh's threads yet.
        from vrg.bus.session import open_session  # noqa: PLC0415
        from vrg.ros.graph import RosNode  # noqa: PLC0415

        if self._open is not None:
            return
        with ExitStack() as stack:
            try:
                session = stack.enter_context(open_session(self._router, shared_memory=False))
            except BusError:
                raise RobotError(f"{self.name}: {no_router(self._router)}") from None
            of = self._found(session)
            node = RosNode(session, self._domain, f"vrg_{ros_name(self.name)}", self._robot.place)
            self._reported, self._failure, self._closing = self._no_report(), None, False
            self._inlets = [(node.subscribe(self._robot.topic(self._robot.odom), ODOMETRY), self._reported.odometry)]
            if Laser.kind in self.measures:
                scans = node.subscribe(self._robot.topic(self._robot.scan), "sensor_msgs/LaserScan")
                self._inlets.append((scans, lambda message, _: self._reported.scan(message)))
            if Battery.kind in self.measures:
                charges = node.subscribe(self._robot.topic(self._robot.battery), "sensor_msgs/BatteryState")
                self._inlets.append((charges, lambda message, _: self._reported.battery(message)))
            self._session = session
            self._stood = self._clock.now()
            self._task = self._clock.spawn(lambda: self._run(node, of), f"ros {self.name}")
            stack.callback(self._end)
            self._open = stack.pop_all()

    def arm(self) -> None:
        """Let the robot accept commands, if its odometry is fresh.

        Raises:
            RobotError: not connected, or the emergency stop is engaged.
        """
        with self._lock:
            if self._open is None:
                raise RobotError(f"{self.name}: expected a connected robot to arm: call connect() first")
            if self._engaged:
                raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm")
            if not self._armed and self._fault() is None:
                self._armed, self._command = True, STILL

    def drive(self, twist: Twist) -> None:
        """Command a motion of the body.

        Raises:
            RobotError: not armed, a fault, or the emergency stop.
        """
        with self._lock:
            if not self._armed:
                fault = self._fault() if self._open is not None else None
                raise RobotError(f"{self.name}: {fault or 'expected an armed robot to drive'}: call arm() first")
            self._command, self._commanded = twist, self._clock.now()
        self._wake()

    def read(self) -> Readings:
        """The newest readings, as the robot's nodes have published them.

        Raises:
            StaleDataError: not connected, or no odometry has come yet.
        """
        with self._lock:
            if self._open is None:
                raise StaleDataError(f"{self.name}: expected a connected robot to read: call connect() first")
            self._hear()
            now = self._clock.now()
            age = self._reported.age(now)
            if age == math.inf:
                topic = self._robot.topic(self._robot.odom)
                raise StaleDataError(f"{self.name}: expected odometry on {topic}, but none has come yet")
            fault = self._fault()
            return Readings(
                stamp=self._now() - age,
                age=age,
                armed=self._armed,
                estop=self._engaged,
                fault=f"{self.name}: {fault}" if fault else None,
                samples=self._reported.samples(now, self._now()),
            )

    def stop(self) -> None:
        """Command zero speed; stays armed."""
        with self._lock:
            self._command, self._commanded = STILL, self._clock.now()
        self._wake()

    def disarm(self) -> None:
        """Command zero speed for ZEROS, and nothing from then on, until armed again. Idempotent."""
        with self._lock:
            self._let_go()
        self._wake()

    def emergency_stop(self) -> None:
        """Command zero speed, again and again, until `release`."""
        with self._lock:
            self._let_go()
            self._engaged = True
        self._wake()

    def release(self) -> None:
        """Let go of the emergency stop; the robot stays disarmed."""
        with self._lock:
            if self._engaged:
                self._engaged, self._stood = False, self._clock.now()

    def close(self) -> None:
        """Disarm, command the robot to stand, and close the session. Idempotent."""
        with self._lock:
            self._let_go()
            stack, self._open = self._open, None
        if stack is not None:
            stack.close()

    def _no_report(self) -> Reported:
        return Reported(self.name, self.features, self._robot.frame, math.radians(self._robot.scan_yaw))

    def _found(self, session: "Session") -> str:
        """Wait for the robot in the graph, and return the type of commands that it obeys.

        Raises:
            RobotError: it is not there, or of a distribution that VRG cannot speak to.
        """
        cmd_vel, odom = self._robot.topic(self._robot.cmd_vel), self._robot.topic(self._robot.odom)
        deadline = self._clock.now() + PATIENCE
        while True:
            try:
                return met(graph_of(session, self._domain), cmd_vel, odom)
            except RobotError as error:
                if self._clock.now() >= deadline:
                    raise RobotError(
                        f"{self.name}: {error}, in the domain {self._domain} of the router {self._router}: see "
                        "`namespace`, `domain` and `router` in [backends.ros]"
                    ) from None
            self._clock.sleep(0.2)

    def _run(self, node: "RosNode", of: str) -> None:
        """Take in what the robot reports, and repeat the command, until the driver is closed."""
        topic = self._robot.topic(self._robot.cmd_vel)
        try:
            while True:
                with self._lock:
                    self._hear()
                    if self._armed and (fault := self._fault()) is not None:
                        log.warning("%s: it is disarmed: %s", self.name, fault)
                        self._let_go()
                    command, closing = self._wanted(), self._closing
                    stamp = self._reported.stamp(self._clock.now())
                    frame = self._reported.frame
                if command is not None:
                    message = ros.twist(command)
                    if of == STAMPED:
                        message = {"header": {"stamp": stamp, "frame_id": frame}, "twist": message}
                    node.publish(topic, of, message)
                if closing:
                    return
                with suppress(queue.Empty):
                    self._clock.take(self._changed, PERIOD)
        except BaseException as error:  # the readings have it as a fault
            log.exception("%s: its driver has failed", self.name)
            with self._lock:
                self._failure = error
                self._let_go()

    def _end(self) -> None:
        """End the thread; its last command is zero."""
        self._closing = True
        self._wake()
        if self._task is not None:
            self._task.join(2.0)
        self._session = None

    def _hear(self) -> None:
        """Take in what has come. Needs the lock."""
        now = self._clock.now()
        before = self._reported.begun_anew
        for take, into in self._inlets:
            for message in take():
                try:
                    into(message, now)
                except MessageError as error:
                    self._warn(str(error))
        if self._reported.begun_anew > before:
            log.warning("%s: its odometry has begun anew; it is taken to stand where it was", self.name)

    def _warn(self, text: str) -> None:
        """Log once what was not taken in."""
        if text not in self._warned:
            self._warned.add(text)
            log.warning("%s: a message is left out: %s", self.name, text)

    def _fault(self) -> str | None:
        """The reason why the robot must not drive. Needs the lock."""
        if self._failure is not None:
            return f"its driver has failed: {self._failure!r}"
        if self._session is not None and not self._session.connected:
            return f"the link to the router {self._router} was lost"
        age = self._reported.age(self._clock.now())
        if age > SILENT:
            topic = self._robot.topic(self._robot.odom)
            since = "yet" if age == math.inf else f"for {age:.1f} s"
            return f"no odometry on {topic} {since}"
        return None

    def _wanted(self) -> Twist | None:
        """The command to publish now; None leaves the robot to others. Needs the lock."""
        now = self._clock.now()
        if self._armed:
            return self._command if now - self._commanded < COMMAND_TIMEOUT else STILL
        return STILL if self._engaged or self._closing or now - self._stood < ZEROS else None

    def _let_go(self) -> None:
        """Disarm. Needs the lock."""
        if self._armed:
            self._armed, self._stood = False, self._clock.now()
        self._command = STILL

    def _wake(self) -> None:
        """Let the thread publish at once."""
        with suppress(queue.Full):
            self._changed.put_nowait(None)
