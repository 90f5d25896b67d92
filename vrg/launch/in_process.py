"""Plays a whole virtual match in this process, in lockstep."""

import gc
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from msgspec import Struct

from vrg.agents.strategy import Strategy
from vrg.bus.lockstep import Lockstep
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal
from vrg.coordinator.rulebook import Field
from vrg.errors import ConfigError
from vrg.launch.bounds import DecisionAlarm, MemoryBound
from vrg.launch.contained import ContainedPlayer
from vrg.launch.nodes import coordinator_node, player_node, strategy_of, world_node
from vrg.launch.run_folder import write_json


class Change(Struct, frozen=True):
    """From an instant on a player plays by another strategy.

    Args:
        time: the match time of the instant, s. player: its name.
        strategy: as `vrg.config.setup.PlayerSetup.strategy`.
    """

    time: float
    player: str
    strategy: str

    @property
    def name(self) -> str:
        """The strategy as people call it: without the folder of its file."""
        return Path(self.strategy).name if ":" in self.strategy else self.strategy


@dataclass(frozen=True)
class Ending:
    """How a match ended.

    Args:
        state: the last state of the referee.
        time: the match time at the end, s.
        failures: what has failed in the code of players, in words.
    """

    state: RefereeState
    time: float
    failures: tuple[str, ...] = ()


def play(
    setup: MatchSetup,
    journal: Journal,
    *,
    watchers: Sequence[Node] = (),
    limit: float = 3600.0,
    pace: Callable[[float], bool] | None = None,
    strict: bool = False,
    stop: StopSignal | None = None,
    logs: Path | None = None,
    changes: Sequence[Change] = (),
) -> Ending:
    """Play a match to its end.

    Args:
        journal: the open journal of the match.
        watchers: nodes that only watch, such as a recorder, a table or a window.
        limit: the match time in s after which the match is broken off.
        pace: called after each tick with the match time. It may wait; if it returns False, the match is broken off.
        strict: True passes every message through the codec of the bus.
        stop: what tells that the match is to stop, so that a strategy in an endless loop is interrupted.
        logs: the folder for what players print; None lets them print.
        changes: the players that play by another strategy from some instant on, in the order of time.

    Raises:
        ConfigError: a robot of the match is a physical one, or a strategy of `changes` cannot be made.
        LaunchError: a player has failed too often, and the match file wants no disqualification.
    """
    if setup.physical:
        raise ConfigError([f"{', '.join(setup.physical)}: only robots of backend 'sim' can be played in one process"])
    coordinator = coordinator_node(setup, journal)
    alarm, memory = DecisionAlarm(stop), MemoryBound(setup.memory)
    players = {player.name: _contained(setup, player.name, alarm, memory, logs) for player in setup.players}
    waiting = list(changes)
    world = world_node(setup)
    executor = Lockstep(world, [coordinator, *players.values(), *watchers], strict=strict)
    linger = 0.0
    with ExitStack() as stack:
        stack.callback(executor.stop)
        stack.enter_context(alarm)
        stack.enter_context(memory)
        # What is there now stays until the end: the garbage collector need not look at it again and again.
        stack.callback(gc.unfreeze)
        gc.freeze()
        # The match goes on for one more second, so that every node hears how it ended.
        while linger < 1.0 and executor.time < limit:
            while waiting and executor.time >= waiting[0].time - world.period / 2:
                change = waiting.pop(0)
                players[change.player].play_by(_maker(setup.substituted(change.player, change.strategy), change.player))
            executor.step()
            if pace is not None and not pace(executor.time):
                break
            if coordinator.match.over:
                linger += world.period
    if logs is not None:
        for player in players.values():
            write_json(logs / f"{player.name}.json", player.counted())
    failures = tuple(failure for player in players.values() for failure in player.failures)
    return Ending(coordinator.match.state(Field({}), estop=False), executor.time, failures)


def _maker(setup: MatchSetup, name: str) -> Callable[[], Strategy]:
    """What makes the strategy of a player."""
    return lambda: strategy_of(setup, name)


def _contained(
    setup: MatchSetup, name: str, alarm: DecisionAlarm, memory: MemoryBound, logs: Path | None
) -> ContainedPlayer:
    """A player whose failures do not end the match."""
    return ContainedPlayer(
        player_node(setup, name),
        setup.keys,
        _maker(setup, name),
        alarm,
        memory,
        None if logs is None else logs / f"{name}.log",
        disqualify=setup.on_fault == "disqualify",
    )
