"""The simulated process of a player whose robot has emulated drives on a simulated CAN bus."""

from typing import TYPE_CHECKING

from vrg.faults.process import Process
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.workshop.faults import FaultKind as DriveFault
from vrg.hal.can.workshop.faults import FaultRequest
from vrg.hal.can.workshop.simulation import Simulation
from vrg.launch.nodes import player_node

if TYPE_CHECKING:
    from vrg.faults.simulation import SimulatedMatch


class CanProcess(Process):
    """See the module.

    The bus has a clock of its own, so that a driver can wait for its drives. It goes along with simulated real time.
    Where the driver has waited it is ahead, and the process does nothing until the time of the match has caught up.

    Args:
        match: to which it belongs. name: that of the player. settings: the buses and the drives of the match.

    Attributes:
        drives: those of its robot.
        silent: since when the drives hear nothing of it, simulated real time in s; None if they hear it.
        muted: since when one of them says nothing, s; None if all speak.
    """

    def __init__(self, match: "SimulatedMatch", name: str, settings: CanSettings) -> None:
        self._simulation = Simulation()
        settings.simulate([name], self._simulation, match.setup.seed)
        self._wire = self._simulation.wire(settings.link(name))
        self.drives = self._wire.drives
        self.silent: float | None = 0.0
        self.muted: float | None = None
        super().__init__(match, name, lambda: player_node(match.setup, name, self._simulation))

    def catch_up(self) -> None:
        """Let happen on the bus what has happened until now."""
        clock = self._simulation.clock
        behind = self._match.network.now - clock.now()
        if behind > 0.0:
            clock.sleep(behind)

    def look(self, *, quiet: bool) -> None:
        """As any process, unless it still waits for its drives."""
        if self._simulation.clock.now() <= self._match.network.now:
            super().look(quiet=quiet)

    def silence(self, silent: bool) -> None:
        """Let the bus fall silent, both ways, or pass frames again."""
        self._wire.tamper = (lambda _frame, _by_drive: ()) if silent else None
        self.note()

    def mute(self, length: float) -> None:
        """Let one drive say nothing for a while, s."""
        self._wire.fault(self.drives[0], FaultRequest(DriveFault.SILENCE, length))
        since = self.muted = self._simulation.clock.now()
        self._match.after(length, lambda: self._unmute(since))

    def reboot(self) -> None:
        """Let one drive start again: it forgets its mode."""
        self._wire.fault(self.drives[-1], FaultRequest(DriveFault.REBOOT))

    def freeze(self, frozen: bool) -> None:
        """Freeze it, or let it go on: what its drives have sent meanwhile comes at once."""
        self._wire.freeze(frozen and self.node is not None)
        super().freeze(frozen)

    def end(self) -> None:
        """End it at once. Its drives learn nothing of it."""
        self._wire.abandon()
        self._simulation.clock.close()
        super().end()

    def note(self) -> None:
        """Note whether it can publish now, and whether its drives hear it."""
        super().note()
        hears = self.runs and self._wire.tamper is None
        self.silent = None if hears else self._simulation.clock.now() if self.silent is None else self.silent

    def _unmute(self, since: float) -> None:
        if self.muted == since:
            self.muted = None
