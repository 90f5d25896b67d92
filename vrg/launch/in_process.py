"""Plays a whole match in this process, in lockstep: virtual robots, and those whose motor controllers are emulated."""

import gc
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from msgspec import Struct

from vrg.agents.strategy import Strategy
from vrg.bus.lockstep import Lockstep
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal, NoJournal
from vrg.coordinator.rulebook import Observation
from vrg.errors import ConfigError
from vrg.games import has_name
from vrg.hal.backends import BACKENDS
from vrg.launch.bounds import DecisionAlarm, MemoryBound
from vrg.launch.contained import ContainedPlayer
from vrg.launch.nodes import coordinator_node, player_node, strategy_of, world_node
from vrg.launch.repeating import RepeatedStrategy, past_of
from vrg.launch.run_folder import RunFolder, write_json
from vrg.launch.step_log import Ended, Line, Missed, StepLog

if TYPE_CHECKING:
    from vrg.coordinator.coordinator import Coordinator
    from vrg.hal.can.workshop.simulation import Simulation
    from vrg.launch.stepping import Apart

P = TypeVar("P", bound=Node)


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
        return self.strategy if has_name(self.strategy) else Path(self.strategy).name


@dataclass(frozen=True)
class Ending:
    """The end of a match.

    Args:
        state: the last state of the referee.
        time: the match time at the end, s.
        failures: what has failed in the code of players, in words.
    """

    state: RefereeState
    time: float
    failures: tuple[str, ...] = ()


@dataclass(frozen=True)
class Assembly(Generic[P]):
    """The nodes of a match in this process, and what ticks them.

    Args:
        executor: ticks all nodes. world, coordinator: their nodes. players: the nodes of the players, by name.
    """

    executor: Lockstep
    world: Node
    coordinator: "Coordinator"
    players: dict[str, P]


def assemble(
    setup: MatchSetup,
    journal: Journal | NoJournal,
    player: Callable[[str], P],
    *,
    watchers: Sequence[Node] = (),
    strict: bool = False,
    steps: StepLog | None = None,
) -> Assembly[P]:
    """Make the nodes of a match, and their executor. Nothing is started.

    Args:
        journal: the open journal of the match.
        player: makes the node of a player, by its name.
        watchers, strict, steps: as for `play`.

    Raises:
        ConfigError: the match cannot be played with this set-up.
        Exception: what `player` raises.
    """
    coordinator = coordinator_node(setup, journal)
    players = {entry.name: player(entry.name) for entry in setup.players}
    world, digested = world_node(setup), None if steps is None else steps.digest
    executor = Lockstep(world, [coordinator, *players.values(), *watchers], strict=strict, digested=digested)
    return Assembly(executor, world, coordinator, players)


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
    apart: "Apart | None" = None,
    steps: StepLog | None = None,
    past: Sequence[Line] = (),
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
        apart: which strategies decide in processes of their own, whose logs are needed then; None lets all decide in
            this process.
        steps: the log of steps; None keeps none.
        past: the log of the match when it was played before, of which all is missed again that was missed then.

    Raises:
        ConfigError: a robot of the match is a real one, or a strategy of `changes` cannot be made.
        RobotError: an emulated motor controller cannot be set up as the match file wants it.
        LaunchError: a player has failed too often, and the match file wants no disqualification.
    """
    simulation = emulation(setup)
    alarm, memory = DecisionAlarm(stop), MemoryBound(setup.memory)

    def write(missed: Missed) -> None:
        if steps is not None:
            steps.write(missed)

    def is_apart(setup: MatchSetup, name: str) -> bool:
        return apart is not None and logs is not None and apart.wanted(setup, name)

    def maker(setup: MatchSetup, name: str) -> Callable[[], Strategy]:
        missed = past_of(past, name)

        def make() -> Strategy:
            strategy: Strategy
            if apart is not None and logs is not None and is_apart(setup, name):
                strategy = apart.made(setup, name, RunFolder(logs.parent), None if past else write)
            else:
                strategy = strategy_of(setup, name)
            return RepeatedStrategy(strategy, missed, write) if missed else strategy

        return make

    def contained(name: str) -> ContainedPlayer:
        return ContainedPlayer(
            player_node(setup, name, simulation, make := maker(setup, name)),
            setup.keys,
            make,
            alarm,
            memory,
            None if logs is None else logs / f"{name}.log",
            disqualify=setup.on_fault == "disqualify",
            apart=is_apart(setup, name),
        )

    assembly = assemble(setup, journal, contained, watchers=watchers, strict=strict, steps=steps)
    executor, world, coordinator, players = assembly.executor, assembly.world, assembly.coordinator, assembly.players
    waiting = list(changes)
    linger, began = 0.0, None
    with ExitStack() as stack:
        if simulation is not None:
            stack.callback(simulation.clock.close)
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
                players[change.player].play_by(maker(setup.substituted(change.player, change.strategy), change.player))
            if simulation is not None and executor.time > 0:
                # The robots have been met in the first step, before the match began.
                began = simulation.clock.now() if began is None else began
                simulation.clock.sleep(began + executor.time - simulation.clock.now())
            executor.step()
            if pace is not None and not pace(executor.time):
                break
            if coordinator.match.over:
                linger += world.period
    if steps is not None:
        steps.write(Ended(time=round(executor.time, 6)))
    if logs is not None:
        for player in players.values():
            write_json(logs / f"{player.name}.json", player.counted())
    failures = tuple(failure for player in players.values() for failure in player.failures)
    return Ending(coordinator.match.state(Observation({}), estop=False), executor.time, failures)


def emulation(setup: MatchSetup, *, strict: bool = False) -> "Simulation | None":
    """The emulated motor controllers of the match; None if it has none.

    Args:
        strict: as for `vrg.hal.can.workshop.simulation.Simulation`.

    Raises:
        ConfigError: a robot is a real one.
    """
    if not setup.physical:
        return None
    from vrg.hal.can.workshop.simulation import Simulation  # noqa: PLC0415 - no other match needs it

    simulation, real = Simulation(strict=strict), []
    for backend in sorted({player.backend for player in setup.players if player.physical}):
        robots = [player.name for player in setup.players if player.backend == backend]
        settings = BACKENDS.get(backend).settings
        table = None if settings is None else settings.model_validate(setup.backends.get(backend, {}))
        if table is None or not table.simulate(robots, simulation, setup.seed):
            real += robots
    if real:
        raise ConfigError(
            f"{', '.join(real)}: expected virtual robots, or emulated motor controllers (`emulate = true` in "
            "[backends.can]): a match in one process does not wait for real ones; leave --in-process out"
        )
    return simulation
