"""The player's runtime: it reads the robot, keeps the order of who may command it, and asks the strategy.

From the strongest to the weakest: the emergency stop, a stopped clock, a silent or halting referee, a human with a
lease, the strategy. Every way out of a tick but the last two leaves the robot stopped.
"""

from vrg.agents.control import STILL, Twist
from vrg.agents.motion import VelocityEstimator
from vrg.agents.strategy import Strategy, View
from vrg.bus.codec import Received
from vrg.bus.estop import decisive
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Manual, RefereeState, Report
from vrg.bus.node import Node, Tick, is_fresh
from vrg.bus.topics import Keys
from vrg.errors import RobotError, StaleDataError
from vrg.hal.robot import Readings, Robot

EMERGENCY = "emergency stop"
NO_REFEREE = "no referee"

PERIOD = 0.1
"""s between decisions."""
REFEREE_TIMEOUT = 0.3
"""s of match time without the referee's state after which a player stops."""
SENSOR_TIMEOUT = 0.3
"""s of match time without a reading after which a player stops."""


class Player(Node):
    """One player.

    Args:
        robot: is connected here; armed only once the referee lets the match go on.
        strategy: decides where nothing stronger does.
    """

    kind = "player"

    def __init__(self, mailbox: Mailbox, keys: Keys, robot: Robot, strategy: Strategy, period: float = PERIOD) -> None:
        super().__init__(robot.name, mailbox, period)
        self._keys = keys
        self._robot = robot
        self._strategy = strategy
        self._referee = mailbox.subscribe(keys.referee_state)
        self._manual = mailbox.subscribe(keys.manual(robot.name))
        self._estops = mailbox.subscribe(keys.estop)
        self._motion = VelocityEstimator()
        self._estop = False
        self._fault: str | None = None
        self._latched = False
        self._mode = "-"
        robot.connect()
        # Whatever a forerunner that crashed has left behind, this player begins disarmed.
        robot.disarm()

    def tick(self, tick: Tick) -> None:
        """Decide once, drive once, report once."""
        estop = decisive(self._estops.take())
        if estop is not None:
            self._estop = estop.engaged
        self._fault, self._latched = None, False
        referee = self._referee.latest
        readings = self._read()
        why = self._reason_to_stand(tick, referee)
        manual = None
        if why is not None or referee is None or readings is None or not self._arm(readings):
            self._mode = f"Stop/{why or 'fault'}"
            if why == EMERGENCY:
                self._robot.disarm()
            else:
                self._robot.stop()
        else:
            manual = self._lease(tick.time)
            self._command(self._decide(tick, referee, readings, manual))
        armed = readings is not None and readings.armed
        self.mailbox.publish(
            self._keys.report(self.name),
            Report(
                mode=self._mode,
                armed=armed,
                manual=manual is not None,
                fault=self._fault,
                latched=self._latched,
            ),
        )

    def stop(self) -> None:
        """Stop the robot and let go of it."""
        self._robot.close()

    def _reason_to_stand(self, tick: Tick, referee: Received[RefereeState] | None) -> str | None:
        """What is stronger than a human's lease and the strategy, if anything is."""
        if referee is None:
            return NO_REFEREE if tick.live else "no clock"
        state = referee.body
        checks = (
            (not tick.live, "no clock"),
            (self._estop or state.estop, EMERGENCY),
            (not is_fresh(referee.stamp, tick.time, REFEREE_TIMEOUT), NO_REFEREE),
            (state.player(self.name) is None, "not in this match"),
            (state.halted is not None, "halt"),
        )
        return next((why for stands, why in checks if stands), None)

    def _decide(self, tick: Tick, referee: Received[RefereeState], readings: Readings, manual: Manual | None) -> Twist:
        """The strategy is always asked, so that it sees every event; it is obeyed only while nobody holds the lease."""
        me = referee.body.player(self.name)
        assert me is not None
        robot = self._robot.features
        self._observe(referee)
        view = View(tick.time, me, readings, referee.body, self._motion.velocities, robot)
        twist = self._strategy.act(view)
        if not isinstance(twist, Twist):
            name = type(self._strategy).__name__
            raise TypeError(f"{name}.act of {self.name}: expected a Twist(v, w), got {twist!r}")
        self._mode = "Manual" if manual else self._strategy.mode
        if not me.may_move:
            return STILL
        if manual:
            return Twist(manual.forward * robot.v_max, manual.turn * robot.w_max)
        return twist

    def _read(self) -> Readings | None:
        try:
            readings = self._robot.read()
        except StaleDataError as error:
            self._fault = str(error)
            return None
        self._latched = readings.latched
        if readings.age > SENSOR_TIMEOUT:
            self._fault = readings.fault or f"the newest reading of {self.name} is {readings.age:.1f} s old"
            return None
        if readings.fault:
            self._fault = readings.fault
            return None
        return readings

    def _observe(self, referee: Received[RefereeState]) -> None:
        seen = {p.name: (p.pose.x, p.pose.y) for p in referee.body.players if p.pose is not None}
        self._motion.update(referee.stamp, seen)

    def _lease(self, now: float) -> Manual | None:
        manual = self._manual.latest
        if manual is None or now >= manual.stamp + manual.body.lease or not is_fresh(manual.stamp, now, 1.0):
            return None
        return manual.body

    def _arm(self, readings: Readings) -> bool:
        """Whether the robot may be driven; asked for again until the robot itself says that it is armed."""
        if readings.armed:
            return True
        try:
            self._robot.arm()
        except RobotError as error:
            self._fault = str(error)
            return False
        return True

    def _command(self, twist: Twist) -> None:
        if twist == STILL:
            self._robot.stop()
            return
        try:
            self._robot.drive(*self._robot.features.wheels(twist.v, twist.w))
        except RobotError as error:
            # The robot was disarmed since its last reading; it is armed again at the next tick, if it may be.
            self._fault = str(error)
            self._robot.stop()
