"""The node of the simulated source."""

from collections.abc import Iterable

from numpy.random import default_rng

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.localisation.sim.fixes import SimulatedFixes
from vrg.localisation.sim.settings import SimSettings
from vrg.localisation.source import Source, SourceContext


class SimSource(Source):
    """Sees the virtual robots of a match where they truly are, as well as its settings let it."""

    settings = SimSettings
    sees_physical = False

    def __init__(self, context: SourceContext, mailbox: Mailbox, keys: Keys) -> None:
        super().__init__(context, mailbox, keys)
        assert isinstance(context.settings, SimSettings)
        self._fixes = SimulatedFixes(context.settings, default_rng(context.seed))
        self._robots = frozenset(context.robots)
        self._poses = mailbox.subscribe(keys.poses)

    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The pictures whose fixes arrive now."""
        for poses in self._poses.take():
            bodies = poses.body.bodies
            self._fixes.capture(poses.stamp, {b.name: b.pose for b in bodies if b.name in self._robots})
        return self._fixes.arrived(tick.time)
