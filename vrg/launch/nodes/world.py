"""The world of a match."""

import logging
from collections.abc import Callable

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.files import read_bytes, write_whole
from vrg.hal.sim.node import WorldNode
from vrg.launch.context import Made, NodeContext
from vrg.runs.run_folder import RunFolder

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 5
"""The number of world ticks between two snapshots. With the default tick this is 0.1 s of match time."""


def world_node(setup: MatchSetup, snapshot: bytes | None = None) -> WorldNode:
    """Make the world of a match, which continues from the bytes of a snapshot if there are any.

    Raises:
        ConfigError: the set-up of the world has problems.
        WorldError: the snapshot is damaged, of another release, or of another set-up.
    """
    return WorldNode(setup.world, Mailbox(), setup.keys, snapshot)


def world(on: NodeContext) -> Made:
    """The world, which continues from the snapshot in the run folder."""
    snapshot = read_bytes(on.folder.snapshot) if on.folder.snapshot.exists() else None
    node = world_node(on.setup, snapshot)
    if snapshot is not None:
        log.info("continuing from the snapshot at tick %d", node.start_tick)
    keeper = _SnapshotKeeper(on.folder, node.snapshot)
    return Made(node, {"first_tick": node.start_tick, "rate": on.setup.rate, "after_tick": keeper})


class _SnapshotKeeper:
    """Saves the world every SNAPSHOT_PERIOD ticks, so that a restarted world can go on after a crash."""

    def __init__(self, folder: RunFolder, snapshot: Callable[[], bytes]) -> None:
        self._folder = folder
        self._snapshot = snapshot
        self._failed = False

    def __call__(self, tick: int) -> None:
        if tick % SNAPSHOT_PERIOD:
            return
        try:
            write_whole(self._folder.snapshot, self._snapshot())
            self._failed = False
        except OSError as error:
            if not self._failed:
                log.error("the world's snapshot cannot be saved; a crash would lose what follows: %s", error)
            self._failed = True
