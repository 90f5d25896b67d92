"""Conditions on robots with emulated drives, whatever fails, judged by the true motion of their motors."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from vrg.bus.messages import Stage
from vrg.bus.pacing import STALL
from vrg.bus.process import STALLED_PERIOD
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg_faults.observer import Spans
from vrg_faults.plan import REFEREE, WORLD, FaultKind

if TYPE_CHECKING:
    from vrg_faults.can import CanRobots
    from vrg_faults.simulation import SimulatedMatch

PERIOD: Final = 0.05
"""The simulated time in s between two looks."""
TURNING_SPEED: Final = 2.0
"""The speed in turn/s of a motor above which its robot does not stand."""
BRAKED: Final = 0.8
"""The time in s within which motors stand without commands: watchdogs of 0.25 s, an order after 0.2 s, brakes."""
AWAY: Final = STALL + STALLED_PERIOD + BRAKED
"""The time in s within which a robot stands whose player hears no clock."""
REPORTED: Final = 1.5
"""The time in s within which play is halted if a robot's drives are silent."""


class CanChecker:
    """Looks at the motors of a match at regular times.

    Args:
        match: which. can: its drives. note: called with what does not hold, in words.
        slow: the time in s by which messages are late.
    """

    def __init__(self, match: "SimulatedMatch", can: "CanRobots", note: Callable[[str], None], slow: float) -> None:
        self._match, self._can, self._note = match, can, note
        self._spans = Spans()
        late = sum(fault.size for fault in match.faults if fault.kind is FaultKind.BUS_LATE)
        lossy = any(fault.kind is FaultKind.BUS_LOSSY for fault in match.faults)
        self._slow, self._late = slow, late + (1.0 if lossy else 0.0)
        match.network.after(PERIOD, self._look)

    def _look(self) -> None:
        for robot in self._can.drives:
            self._look_at(robot)
        self._match.network.after(PERIOD, self._look)

    def _look_at(self, robot: str) -> None:
        match, can, now = self._match, self._can, self._match.clock.now()
        player, world, referee = (match.processes[name] for name in (robot, WORLD, REFEREE))
        speed = max(abs(drive.motor.velocity) for drive in can.drives[robot])
        silent = can.silent(robot)
        for why, holds, within in (
            ("its player does not run", not player.runs, BRAKED),
            ("its bus is silent", can.bus_silent(robot), BRAKED),
            ("one of its drives is silent", silent, AWAY),
            ("its player is not linked", player.unable is not None, AWAY + self._slow),
            ("the world is away", world.unable is not None, AWAY + self._slow),
            ("the referee is away", referee.unable is not None, REFEREE_TIMEOUT + AWAY + self._slow),
            ("the emergency stop is engaged", match.observer.pressed is not None and player.runs, AWAY + self._slow),
        ):
            passed = self._spans.passed((robot, why), holds, now)
            if passed > within + self._late and speed > TURNING_SPEED:
                self._note(f"a motor of {robot} turns at {speed:.1f} turn/s, though {why}, for {passed:.2f} s")
        state = match.observer.state
        goes_on = state is not None and state.stage is Stage.PLAY_ROUND and state.halted is None
        all_linked = all(process.unable is None for process in (player, world, referee))
        passed = self._spans.passed((robot, "unreported"), silent and goes_on and all_linked, now)
        if passed > REPORTED + self._slow:
            self._note(f"play goes on, though drives of {robot} are silent, for {passed:.2f} s")
