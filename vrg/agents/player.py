"""The player's runtime: it reads the robot, decides who may command it, and asks the strategy.

From the strongest to the weakest, these command the robot: the emergency stop, a stopped clock, a silent or halting
referee, the referee's lease, a human with a lease, the strategy. If a tick ends with any of the first three, the robot
is stopped.

A tick has two halves. `look` returns the view, or None if the robot has to stand still; `drive` takes an action. So an
outer loop can ask for views and give actions in place of a strategy.
"""

import logging
from collections.abc import Mapping, Sequence
from typing import Any

from vrg.agents.messages import Once, TeamChannel, Telling, usable
from vrg.agents.radio import Radio
from vrg.agents.strategy import Action, RemoteStrategy, Strategy, View, decided
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import PlayerStatus, RefereeState, Report, shortened
from vrg.bus.node import Node, Tick, is_fresh
from vrg.bus.topics import Keys
from vrg.errors import RobotError, StaleDataError
from vrg.hal.actuators import UNUSED
from vrg.hal.device import Device
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.hal.readings import Readings
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.ins import Ins
from vrg.navigation.motion import VelocityEstimator
from vrg.regions import Region
from vrg.shared import shared
from vrg.types import STILL, Twist, Vector

EMERGENCY = "emergency stop"
NO_REFEREE = "no referee"
BY_REFEREE = "Referee"
"""The mode that a player reports while the referee drives its robot."""

PERIOD = 0.1
"""The match time in s between two decisions."""
SENSOR_TIMEOUT = 0.3
"""The match time in s without a reading after which a player stops."""
NONSENSE_LIMIT = 10
"""The number of decisions in a row that are no finite motion, after which the strategy has failed."""
log = logging.getLogger(__name__)


class Player(Node):
    """The node of one player.

    Args:
        mailbox: the node's own mailbox. keys: the keys of the match.
        device: the device of its robot. `start` connects it; it is armed only when the referee lets the match go on.
        team: the team that it plays for.
        strategy: decides what the robot does while nothing stronger commands it.
        radio: the radio to its team, which is an attribute too.
        obstacles: the ground that walls and obstacles of the map cover, m.
        period: the match time between ticks, s.
    """

    kind = "player"

    def __init__(
        self,
        mailbox: Mailbox,
        keys: Keys,
        device: Device,
        strategy: Strategy,
        *,
        team: str,
        radio: Radio,
        obstacles: Sequence[Region] = (),
        period: float = PERIOD,
    ) -> None:
        super().__init__(device.name, mailbox, period)
        self._report = keys.report(self.name)
        self._device = device
        self._strategy = strategy
        self._obstacles = obstacles
        self.radio = radio
        self._telling = Telling(mailbox, keys, self.name, radio)
        self._referee = mailbox.subscribe(keys.referee_state, sampled=True)
        self._team = TeamChannel(keys, mailbox, self.name, team)
        self._motion = VelocityEstimator()
        self._fault: str | None = None
        self._latched = False
        self._pressed = False
        self._armed = False
        self._manual = False
        self._mode = "-"
        self._command: Twist | None = None
        self._battery: float | None = None
        self._nonsense = 0
        self._looked = False
        self._view: View | None = None
        self._warn_once = Once()

    def start(self) -> None:
        """Connect to the robot.

        Raises:
            RobotError: it cannot be reached.
        """
        self._device.start()

    def begin(self, tick: Tick) -> None:
        """Look, and let a strategy that decides elsewhere begin to."""
        if isinstance(self._strategy, RemoteStrategy):
            self._looked = True
            self._view = self.look(tick)
            if self._view is not None:
                self._strategy.send(self._view)

    def tick(self, tick: Tick) -> None:
        """Look, let the strategy decide, drive, and report.

        Raises:
            StrategyError: the strategy has failed. The robot is stopped.
        """
        view = self._view if self._looked else self.look(tick)
        self._looked = False
        if view is not None:
            # The strategy is always asked, so that it sees every event. Its twist counts only while no human drives.
            self.drive(view, self._decision(view))
        elif isinstance(self._strategy, RemoteStrategy):
            self._strategy.check()
        self.report()
        self._telling.count(tick.time)

    def look(self, tick: Tick) -> View | None:
        """Return what the player sees, or None if its robot has to stand still. The robot is then stopped already."""
        self._fault, self._latched, self._pressed, self._manual = None, False, False, False
        self._command, self._battery = None, None
        self._device.hear()
        referee = self._referee.latest
        readings = self._read()
        self._armed = readings is not None and readings.armed
        why = self._reason_to_stand(tick, referee)
        view = None
        if why is None and referee is not None and readings is not None and self._arm(readings):
            view = self._seen(tick, referee, readings)
        if view is None:
            self._mode = f"Stop/{why or 'fault'}"
            if why == EMERGENCY:
                self._device.disarm()
            else:
                self._device.stop()
        return view

    def drive(self, view: View, action: Action) -> None:
        """Carry out an action. Its twist does not count while the referee or a human leases the robot.

        Messages that cannot be sent are left out, with a warning in the log.

        Raises:
            StrategyError: it has been no finite motion for long.
        """
        for problem in self._telling.tell(action, view.position):
            if self._warn_once(problem):
                log.warning("%s", self._strategy.complaint(problem))
        manual = self._device.manual_twist(view.time)
        sensible = self._makes_sense(action.twist)
        self._manual = manual is not None
        if view.me.lease is not None:
            self._mode = BY_REFEREE
        elif self._manual:
            self._mode = "Manual"
        wanted, use = manual or (action.twist if sensible else STILL), {}
        if action.use is not UNUSED and sensible and not self._manual and view.me.lease is None:
            try:
                use = usable(action.use, self._device.features)
            except (TypeError, ValueError, AttributeError) as error:
                if self._warn_once(str(error)):
                    log.warning("%s", self._strategy.complaint(f"use left out: {error}"))
        try:
            self._command = self._device.drive(wanted.quantised, use)
        except RobotError as error:
            # The robot was disarmed since its last reading. The next tick tries to arm it again.
            self._fault = error.text
            self._device.stop()

    def give_way(self, why: str) -> None:
        """Stop the robot and report why, in place of a tick: the strategy has failed."""
        self._device.stop()
        self._mode, self._fault, self._manual, self._command = "Stop/failed", why, False, None
        self.report()

    def play_by(self, strategy: Strategy) -> None:
        """Let another strategy decide from now on."""
        self._end_strategy()
        self._strategy = strategy
        self._nonsense = 0

    def report(self) -> None:
        """Publish what the player does and what keeps it from playing, and where its robot is."""
        self._device.report()
        self.mailbox.publish(
            self._report,
            Report(
                mode=shortened(self._mode),
                armed=self._armed,
                manual=self._manual,
                fault=None if self._fault is None else shortened(self._fault),
                latched=self._latched,
                pressed=self._pressed,
                estop=self._device.estop,
                command=self._command,
                battery=self._battery,
            ),
        )

    def counted(self) -> dict[str, Any]:
        """The messages that came over the radio, counted by team mate."""
        forfeited = self._strategy.forfeited if isinstance(self._strategy, RemoteStrategy) else 0
        return {"radio": self._telling.counted(), **({"forfeited": forfeited} if forfeited else {})}

    def stop(self) -> None:
        """Stop the robot and close its device."""
        self._device.close()
        self._end_strategy()

    def _end_strategy(self) -> None:
        if isinstance(self._strategy, RemoteStrategy):
            self._strategy.close()

    def _reason_to_stand(self, tick: Tick, referee: Received[RefereeState] | None) -> str | None:
        """The reason why the robot has to stand still whatever a human or the strategy wants, or None."""
        if referee is None:
            return NO_REFEREE if tick.live else "no clock"
        state, why = referee.body, None
        if not tick.live:
            why = "no clock"
        elif self._device.estop or state.estop:
            why = EMERGENCY
        elif not is_fresh(referee.stamp, tick.time, REFEREE_TIMEOUT):
            why = NO_REFEREE
        elif self.name not in _statuses(state):
            why = "not in this match"
        elif state.halted is not None:
            why = "halt"
        return why

    def _seen(self, tick: Tick, referee: Received[RefereeState], readings: Readings) -> View | None:
        state = self._team.seen(referee.body, referee.stamp)
        me = _statuses(state).get(self.name)
        ins = readings.latest(Ins)
        if me is None or ins is None or ins.age > SENSOR_TIMEOUT:
            age = "never came" if ins is None else f"is {ins.age:.1f} s old"
            self._fault = f"its own pose {age}"
            return None
        self._motion.update(referee.stamp, _positions(state))
        return View(
            time=tick.time,
            me=me,
            readings=readings,
            referee=state,
            velocities=self._motion.velocities,
            robot=self._device.features,
            pose=ins.value.pose,
            priority=self._team.priority(tick.time, self._strategy.priorities),
            heard=self._telling.heard((ins.value.pose.x, ins.value.pose.y)),
            obstacles=self._obstacles,
            uncertainty=ins.value.uncertainty,
        )

    def _decision(self, view: View) -> Action:
        action, self._mode = decided(self._strategy, view)
        return action

    def _makes_sense(self, twist: Twist) -> bool:
        """True if a motion is finite. If it is not, the robot stands and its player reports why.

        Raises:
            StrategyError: NONSENSE_LIMIT motions in a row were not.
        """
        if twist.is_finite:
            self._nonsense = 0
            return True
        self._nonsense += 1
        wrong = self._strategy.complaint(f"expected finite numbers of m/s and rad/s, got {twist}")
        if self._nonsense >= NONSENSE_LIMIT:
            raise wrong
        self._fault = str(wrong)
        return False

    def _read(self) -> Readings | None:
        try:
            readings = self._device.read()
        except StaleDataError as error:
            self._fault = error.text
            return None
        self._latched = readings.latched
        self._pressed = readings.latched and readings.estop and not self._device.estop
        battery = readings.latest(Battery)
        self._battery = None if battery is None else battery.value.charge
        if readings.age > SENSOR_TIMEOUT:
            self._fault = readings.fault or f"its newest reading is {readings.age:.1f} s old"
            return None
        if readings.fault:
            self._fault = readings.fault
            return None
        return readings

    def _arm(self, readings: Readings) -> bool:
        """True if the robot may be driven. Arms the robot at every tick until the readings report that it is armed."""
        if readings.armed:
            return True
        try:
            self._device.arm()
        except RobotError as error:
            self._fault = error.text
            return False
        return True


@shared
def _statuses(state: RefereeState) -> Mapping[str, PlayerStatus]:
    """The players by name."""
    return {player.name: player for player in state.players}


@shared
def _positions(state: RefereeState) -> Mapping[str, Vector]:
    """The positions that the referee has published, by the player's name, m."""
    return {player.name: (player.pose.x, player.pose.y) for player in state.players if player.pose is not None}
