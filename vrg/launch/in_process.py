"""Plays a whole virtual match in this process, in lockstep."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vrg.bus.lockstep import Lockstep
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal
from vrg.coordinator.rulebook import Field
from vrg.errors import ConfigError
from vrg.launch.nodes import coordinator_node, player_node, world_node


@dataclass(frozen=True)
class Ending:
    """How a match ended.

    Args:
        state: the last state of the referee.
        time: the match time at the end, s.
    """

    state: RefereeState
    time: float


def play(
    setup: MatchSetup,
    journal: Journal,
    *,
    watchers: Sequence[Node] = (),
    limit: float = 3600.0,
    pace: Callable[[float], bool] | None = None,
    strict: bool = False,
) -> Ending:
    """Play a match to its end.

    Args:
        journal: the open journal of the match.
        watchers: nodes that only watch, such as a recorder, a table or a window.
        limit: the match time in s after which the match is broken off.
        pace: called after each tick with the match time. It may wait; if it returns False, the match is broken off.
        strict: True passes every message through the codec of the bus.

    Raises:
        ConfigError: a robot of the match is a physical one.
    """
    if setup.physical:
        raise ConfigError([f"{', '.join(setup.physical)}: only robots of backend 'sim' can be played in one process"])
    coordinator = coordinator_node(setup, journal)
    players = [player_node(setup, p.name) for p in setup.players]
    world = world_node(setup)
    executor = Lockstep(world, [coordinator, *players, *watchers], strict=strict)
    linger = 0.0
    try:
        # The match goes on for one more second, so that every node hears how it ended.
        while linger < 1.0 and executor.time < limit:
            executor.step()
            if pace is not None and not pace(executor.time):
                break
            if coordinator.match.over:
                linger += world.period
    finally:
        executor.stop()
    return Ending(coordinator.match.state(Field({}), estop=False), executor.time)
