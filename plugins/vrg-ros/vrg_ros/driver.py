"""The backend `ros`: the driver of a robot that runs ROS 2, by its topics."""

import logging
import math
import queue
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, Final

from vrg.errors import BusError, ConfigError, MessageError, Problem, RobotError, StaleDataError
from vrg.hal.clock import REAL_CLOCK, MonotonicClock, Task
from vrg.hal.driver import COMMAND_TIMEOUT, Driver, DriverContext
from vrg.hal.readings import Readings
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.laser import RANGES_LIMIT, Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.types import STILL, Twist
from vrg_ros import messages as ros
from vrg_ros.meeting import ODOMETRY, STAMPED, commanders, graph_of, met, no_router, node_name
from vrg_ros.reported import Reported
from vrg_ros.settings import RosSettings

if TYPE_CHECKING:
    from vrg.bus.session import Session
    from vrg_ros.graph import RosNode

log = logging.getLogger(__name__)

PERIOD: Final = 0.05
"""The time in s between two commands to the robot."""
ODOMETRY_TIMEOUT: Final = 0.5
"""The age in s of the odometry above which the robot is not driven."""
ZEROS: Final = 1.0
"""The time in s for which a robot that was disarmed is commanded to stand. Then another node may drive it."""
OTHERS: Final = 1.0
"""The time in s since the last command of another node for which the robot is left to that."""
LAST_ZEROS: Final = 4
"""The number of zeros that the thread commands before it ends."""
HANGS: Final = 0.5
"""The time in s without a round of the thread after which the robot is not driven."""
PATIENCE: Final = 5.0
"""The time in s to wait for the router, and then for the robot's nodes in the graph."""
LONGEST_SCAN: Final = 8 * RANGES_LIMIT + 1024
"""The bytes of the longest scan that is decoded, which may have intensities."""
Inlet = tuple[str, Callable[[], Mapping[str, Any] | None], Callable[[Mapping[str, Any], float], None]]
"""A topic of the robot, what returns its newest message, and what takes it in at a monotonic time, s."""


class RosDriver(Driver):
    """See `Driver`. ROS has no arming: this driver commands zeros, or nothing, while the robot is disarmed.

    A thread of its own repeats the command every PERIOD, and commands zeros when no new one has come for
    COMMAND_TIMEOUT. It alone publishes. If this process dies, the robot's own driver must stop it.

    Args:
        context: its options are those of `RosSettings`. clock: monotonic time, and the thread.

    Raises:
        ConfigError: the settings have no table for this robot.
    """

    settings = RosSettings
    measures = frozenset({Odometry.kind, Laser.kind, Battery.kind})

    def __init__(self, context: DriverContext, *, clock: MonotonicClock = REAL_CLOCK) -> None:
        super().__init__(context.name, context.model)
        settings = RosSettings.model_validate(dict(context.options))
        if context.name not in settings.robots:
            where = ("backends", "ros", "robots")
            raise ConfigError([Problem(f"expected its topics in [backends.ros.robots.{context.name}]", where)])
        self._robot = settings.robots[context.name]
        topic = self._robot.topic
        self._cmd_vel, self._odom = topic(self._robot.cmd_vel), topic(self._robot.odom)
        self._router, self._domain = settings.reached(context.name)
        lacks = {Laser.kind: not self._robot.scan, Battery.kind: not self._robot.battery}
        has = {spec.kind for spec in context.model.sensors}
        self.measures = frozenset(kind for kind in self.measures & has if not lacks.get(kind))
        self._now, self._clock = context.now, clock
        self._lock = threading.Lock()
        self._changed: queue.Queue[None] = queue.Queue(maxsize=1)
        """Wakes the thread."""
        self._reported = Reported(
            self.features,
            self._robot.frame,
            math.radians(self._robot.scan_yaw),
            simulated=self._robot.use_sim_time,
        )
        self._inlets: list[Inlet] = []
        self._node: RosNode | None = None
        self._open: ExitStack | None = None
        self._session: Session | None = None
        self._task: Task | None = None
        self._closing = False
        self._armed = self._engaged = False
        self._command, self._commanded = STILL, -math.inf
        self._stood = -math.inf
        """The time since when the robot is commanded to stand, s."""
        self._beat = -math.inf
        """The time at which the thread last went round, s."""
        self._overheard = -math.inf
        """The time at which a command of another node was last heard, s."""
        self._taken = False
        """True once a command of another node was heard while the robot was armed, until a person recovers it."""
        self._failure: BaseException | None = None

    def connect(self) -> None:
        """Open a session with the router, and find the robot in the graph. Idempotent.

        Raises:
            RobotError: there is no router, or no node that obeys commands and publishes odometry.
        """
        # Match files are checked, and players are sealed, by processes that must not have zenoh's threads yet.
        from vrg.bus.session import open_session  # noqa: PLC0415
        from vrg_ros.graph import RosNode  # noqa: PLC0415

        if self._open is not None:
            return
        with ExitStack() as stack:
            try:
                session = stack.enter_context(open_session(self._router, patience=PATIENCE, shared_memory=False))
            except BusError:
                raise RobotError(no_router(self._router), self.name) from None
            of = self._found(session)
            node = RosNode(session, self._domain, node_name(self.name), self._robot.place)
            self._reported.forget()
            self._failure, self._closing = None, False
            self._inlets = [(self._odom, node.subscribe(self._odom, ODOMETRY), self._odometry)]
            if Laser.kind in self.measures:
                scan = self._robot.topic(self._robot.scan)
                scans = node.subscribe(scan, "sensor_msgs/LaserScan", LONGEST_SCAN)
                self._inlets.append((scan, scans, self._reported.scan))
            if Battery.kind in self.measures:
                battery = self._robot.topic(self._robot.battery)
                charges = node.subscribe(battery, "sensor_msgs/BatteryState")
                self._inlets.append((battery, charges, self._reported.battery))
            others = node.overheard(self._cmd_vel)
            self._session, self._node, self._overheard = session, node, -math.inf
            self._stood = self._beat = self._clock.now()
            self._task = self._clock.spawn(lambda: self._run(node, of, others), f"ros {self.name}")
            stack.callback(self._end)
            self._open = stack.pop_all()

    def arm(self) -> None:
        """Let the robot accept commands, if its odometry is fresh.

        Raises:
            RobotError: not connected, or the emergency stop is engaged.
        """
        with self._lock:
            if self._open is None:
                raise RobotError("expected a connected robot to arm: call connect() first", self.name)
            if self._engaged:
                raise RobotError("the emergency stop is engaged: release it, then arm", self.name)
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
                raise RobotError(f"{fault or 'expected an armed robot to drive'}: call arm() first", self.name)
            self._command, self._commanded = twist, self._clock.now()
        self._wake()

    def read(self) -> Readings:
        """The newest readings, as the robot's nodes have published them.

        Raises:
            StaleDataError: not connected, or no odometry has arrived yet.
        """
        if self._open is None:
            raise StaleDataError("expected a connected robot to read: call connect() first", self.name)
        self._hear()
        with self._lock:
            now = self._clock.now()
            age = self._reported.age(now)
            if age == math.inf:
                raise StaleDataError(f"expected odometry on {self._odom}, but none was received yet", self.name)
            fault = self._fault()
            return Readings(
                stamp=self._now() - age,
                age=age,
                armed=self._armed,
                estop=self._engaged,
                fault=fault or None,
                latched=self._taken or self._failure is not None,
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
        self._engaged = True  # the thread looks at it first, also while another has the lock
        with self._lock:
            self._let_go()
        self._wake()

    def release(self) -> None:
        """Let go of the emergency stop; the robot stays disarmed."""
        with self._lock:
            if self._engaged:
                self._engaged, self._stood = False, self._clock.now()

    def recover(self) -> None:
        """Take the robot back from other nodes, and connect again if the thread has failed. It stays disarmed."""
        with self._lock:
            self._taken = False
        if self._failure is not None:
            self.close()
            self.connect()

    def close(self) -> None:
        """Disarm, command the robot to stand, and close the session. Idempotent."""
        with self._lock:
            self._let_go()
            stack, self._open = self._open, None
        if stack is not None:
            stack.close()

    def _found(self, session: "Session") -> str:
        """Wait for the robot in the graph, and return the type of commands that it obeys.

        Raises:
            RobotError: it is not there, or of a distribution that VRG cannot speak to.
        """
        deadline = self._clock.now() + PATIENCE
        while True:
            graph = graph_of(session, self._domain)
            try:
                of = met(graph, self._cmd_vel, self._odom)
            except RobotError as error:
                if self._clock.now() >= deadline:
                    raise RobotError(
                        f"{error}, in the domain {self._domain} of the router {self._router}: see `namespace`, "
                        "`domain` and `router` in [backends.ros]",
                        self.name,
                    ) from None
                self._clock.sleep(0.2)
                continue
            if others := commanders(graph, self._cmd_vel):
                log.warning("%s: %s is commanded by %s, too: stop it", self.name, self._cmd_vel, " and ".join(others))
            return of

    def _run(self, node: "RosNode", of: str, others: Callable[[], bool]) -> None:
        """Take in what the robot reports, and repeat the command, until the driver is closed."""
        try:
            while not self._closing:
                self._hear()
                with self._lock:
                    now = self._beat = self._clock.now()
                    if others():
                        self._overheard = now
                        self._taken |= self._armed
                    if self._armed and (fault := self._fault()) is not None:
                        log.warning("%s: it is disarmed: %s", self.name, fault)
                        self._let_go()
                    if self._session is not None and not self._session.connected:
                        self._stood = now  # zeros are for a robot that can hear them
                    command = self._wanted()
                if command is not None:
                    self._command_robot(node, of, command)
                with suppress(queue.Empty):
                    self._clock.take(self._changed, PERIOD)
        except BaseException as error:  # the readings have it as a fault
            log.exception("%s: its driver has failed", self.name)
            with self._lock:
                self._failure = error
                self._let_go()
        for _ in range(LAST_ZEROS):
            with suppress(Exception):  # one that cannot be published must not keep back the next
                self._command_robot(node, of, STILL)
            self._clock.sleep(PERIOD)

    def _command_robot(self, node: "RosNode", of: str, command: Twist) -> None:
        message = ros.twist(command)
        if of == STAMPED:
            header = ros.header(self._reported.time(self._clock.now()), self._reported.frame)
            message = {"header": header, "twist": message}
        node.publish(self._cmd_vel, of, message)

    def _end(self) -> None:
        """End the thread; its last commands are zeros."""
        self._closing = True
        self._wake()
        if self._task is not None:
            self._task.join(2.0)
        self._session = self._node = None

    def _hear(self) -> None:
        """Take in what has arrived. Only what is done with a decoded message waits for the lock."""
        node = self._node
        for topic, newest, into in self._inlets:
            message = newest()
            if message is not None and node is not None:
                try:
                    with self._lock:
                        into(message, self._clock.now())
                        node.problems.pop(topic, None)
                except (MessageError, ArithmeticError, ValueError) as error:
                    node.complain(topic, error)

    def _odometry(self, message: Mapping[str, Any], now: float) -> None:
        """Take in odometry. Needs the lock."""
        if self._reported.odometry(message, now) and not self._reported.jumps(now):
            log.warning("%s: its odometry has restarted; the robot is taken to stand where it was", self.name)

    def _fault(self) -> str | None:
        """The reason why the robot must not drive. Needs the lock."""
        now = self._clock.now()
        if self._failure is not None:
            return f"its driver has failed: {self._failure!r}"
        if now - self._beat > HANGS:
            return f"its driver has hung for {now - self._beat:.1f} s"
        if self._session is not None and not self._session.connected:
            return f"the link to the router {self._router} was lost"
        if self._taken or now - self._overheard < OTHERS:
            return f"another node commands {self._cmd_vel}, too: stop it"
        if self._reported.jumps(now):
            return f"the odometry on {self._odom} jumps to and fro: do two nodes publish it?"
        return self._silence(now)

    def _silence(self, now: float) -> str | None:
        """The reason why there is no odometry that is fresh. Needs the lock."""
        if (age := self._reported.age(now)) <= ODOMETRY_TIMEOUT:
            return None
        delay = self._reported.delay()
        if age - delay <= ODOMETRY_TIMEOUT < delay:
            return (
                f"the odometry on {self._odom} is {delay:.1f} s old when it arrives: the link is slow, or the robot's "
                "clock has stood still (a simulated robot needs `use_sim_time = true` in the match file)"
            )
        problem = "" if self._node is None else self._node.problems.get(self._odom, "")
        why = f", but messages are dropped: {problem}" if problem else ""
        return f"no odometry on {self._odom} {'yet' if age == math.inf else f'for {age:.1f} s'}{why}"

    def _wanted(self) -> Twist | None:
        """The command to publish now; None leaves the robot to others. Needs the lock."""
        now = self._clock.now()
        if self._armed and not self._engaged:
            return self._command if now - self._commanded < COMMAND_TIMEOUT else STILL
        return STILL if self._engaged or now - self._stood < ZEROS else None

    def _let_go(self) -> None:
        """Disarm. Needs the lock."""
        if self._armed:
            self._armed, self._stood = False, self._clock.now()
        self._command = STILL

    def _wake(self) -> None:
        """Let the thread publish at once."""
        with suppress(queue.Full):
            self._changed.put_nowait(None)
