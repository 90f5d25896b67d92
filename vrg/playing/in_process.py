"""Plays a whole match in this process, in lockstep: virtual robots, and those whose motor controllers are emulated."""

import gc
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from msgspec import structs

from vrg.agents.radio import link_of
from vrg.bus.lockstep import Lockstep
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.bus.stopping import StopSignal
from vrg.config.rules import rulebook_of
from vrg.config.setup import NOISE, CheckedMatch, MatchSetup, radio_seed
from vrg.coordinator.evidence import TINY
from vrg.coordinator.journal import Journal, NoJournal
from vrg.coordinator.rulebook import Observation
from vrg.errors import ConfigError
from vrg.files import write_json
from vrg.hal.backends import BACKENDS
from vrg.launch.nodes.player import player_node
from vrg.launch.nodes.referee import coordinator_node
from vrg.launch.nodes.tracker import tracker_node
from vrg.launch.nodes.world import world_node
from vrg.playing.stepped import Failure, SteppedPlayer
from vrg.playing.strategies import Strategies
from vrg.runs.change import Change, amended
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import Ended, Line, StepLog

if TYPE_CHECKING:
    from vrg.coordinator.coordinator import Coordinator
    from vrg.hal.can.workshop.simulation import Simulation
    from vrg.hal.sim.node import WorldNode

P = TypeVar("P", bound=Node)


STUCK: Final = 120.0
"""The match time in s without play after which a match is broken off."""
LINGER: Final = 1.0
"""The match time in s that a match goes on after its end, so that every node hears how it ended."""


@dataclass(frozen=True)
class Ending:
    """The end of a match.

    Args:
        state: the last state of the referee.
        time: the match time at the end, s.
        failures: what has failed in the code of players.
        thinking: the real time that the code of each player has taken, s.
    """

    state: RefereeState
    time: float
    failures: tuple[Failure, ...] = ()
    thinking: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Assembly(Generic[P]):
    """The nodes of a match in this process, and what ticks them.

    Args:
        executor: ticks all nodes. world, coordinator: their nodes. players: the nodes of the players, by name.
        trackers: the nodes that locate robots.
    """

    executor: Lockstep
    world: "WorldNode"
    coordinator: "Coordinator"
    players: dict[str, P]
    trackers: Sequence[Node] = ()


def assemble(
    setup: MatchSetup,
    journal: Journal | NoJournal,
    player: Callable[[str], P],
    *,
    watchers: Sequence[Node] = (),
    strict: bool = False,
    digested: Callable[[float, Mapping[str, str]], None] | None = None,
) -> Assembly[P]:
    """Make the nodes of a match, and their executor. Nothing is started.

    Args:
        journal: the open journal of the match.
        player: makes the node of a player, by its name.
        watchers, strict: as for `play`.
        digested: see `vrg.bus.lockstep.Lockstep`.

    Raises:
        ConfigError: the match cannot be played with this set-up.
        Exception: what `player` raises.
    """
    coordinator = coordinator_node(setup, journal)
    players = {entry.name: player(entry.name) for entry in setup.players}
    world = world_node(setup)
    trackers = [tracker_node(setup, name) for name in setup.trackers]
    nodes: list[Node] = [coordinator, *trackers, *players.values(), *watchers]
    executor = Lockstep(world, nodes, strict=strict, digested=digested, clock=time.monotonic)
    return Assembly(executor, world, coordinator, players, trackers)


def play(
    setup: CheckedMatch,
    journal: Journal,
    *,
    watchers: Sequence[Node] = (),
    limit: float = 3600.0,
    pace: Callable[[float], bool] | None = None,
    strict: bool = False,
    resumable: bool = False,
    stop: StopSignal | None = None,
    logs: Path | None = None,
    changes: Sequence[Change] = (),
    apart: Strategies | None = None,
    steps: StepLog | None = None,
    past: Sequence[Line] = (),
    bank_from: float = 0.0,
) -> Ending:
    """Play a match to its end.

    Args:
        journal: the open journal of the match.
        watchers: nodes that only watch, such as a recorder, a table or a window.
        limit: the match time in s after which the match is broken off.
        pace: called after each tick with the match time. It may wait; if it returns False, the match is broken off.
        strict: True passes every message through the codec of the bus.
        resumable: True if a watcher may be an official, who continues play after a HALT; otherwise a HALT is the end.
        stop: what tells that the match is to stop: then a further Ctrl-C interrupts code that decides in this process.
        logs: the folder for what players print; None lets them print.
        changes: what changes at some instants, in the order of time.
        apart: which strategies decide in processes of their own, whose logs are needed then; None lets all decide in
            this process, with nothing but exceptions caught: whoever calls this trusts them.
        steps: the log of steps; None keeps none.
        past: the log of the match when it was played before, of which all is missed again that was missed then.
        bank_from: the match time in s from which players spend their banks: what is only repeated takes its time.

    Raises:
        ConfigError: a robot of the match is a real one, or one of `changes` cannot be made.
        RobotError: an emulated motor controller cannot be set up as the match file wants it.
        GivenUpError: a player has failed too often, and the match file wants no disqualification.
    """
    simulation = emulation(setup)
    executor: Lockstep | None = None
    strategies = replace(
        apart or Strategies(),
        run=None if logs is None else RunFolder(logs.parent),
        past=past,
        write=(lambda _: None) if steps is None else steps.write,
        now=lambda: None if executor is None else executor.time,
    )

    def stepped(name: str) -> SteppedPlayer:
        return SteppedPlayer(
            player_node(setup, name, simulation, make := strategies.maker(setup, name)),
            setup.keys,
            make,
            None if logs is None else logs / f"{name}.log",
            inline=strategies.is_inline(setup, name),
            stop=stop,
            disqualify=setup.on_fault == "disqualify",
            bank=setup.bank,
            bank_from=bank_from,
            spent=lambda: strategies.spent(setup, name),
        )

    waiting, now = list(changes), setup
    linger, began = 0.0, None
    with ExitStack() as stack:
        stack.callback(strategies.close)
        strategies.begin(setup)
        digested = None if steps is None else steps.digest
        assembly = assemble(setup, journal, stepped, watchers=watchers, strict=strict, digested=digested)
        world, coordinator, players = assembly.world, assembly.coordinator, assembly.players
        executor = assembly.executor
        if simulation is not None:
            stack.callback(simulation.clock.close)
        stack.callback(executor.stop)
        # What is there now stays until the end: the garbage collector need not look at it again and again.
        stack.callback(gc.unfreeze)
        gc.freeze()
        played, since = coordinator.match.total, executor.time
        while linger < LINGER and executor.time < limit:
            while waiting and executor.time >= waiting[0].time - TINY:
                change = waiting.pop(0)
                before, now = now, amended(now, change)
                _go_on_by(assembly, before, now, setup.seed)
                if name := change.player:
                    players[name].play_by(strategies.maker(now, name), inline=strategies.is_inline(now, name))
            if simulation is not None and executor.time > 0:
                # The robots have been met in the first step, before the match began.
                began = simulation.clock.now() if began is None else began
                simulation.clock.sleep(began + executor.time - simulation.clock.now())
            executor.step()
            if pace is not None and not pace(executor.time):
                break
            if coordinator.match.over or (coordinator.match.halted is not None and not resumable):
                linger += world.period
            elif coordinator.match.total != played:
                played, since = coordinator.match.total, executor.time
            elif executor.time - since > STUCK:
                break
    _write_end(steps, logs, [*players.values(), *assembly.trackers], executor.time)
    failures = tuple(failure for player in players.values() for failure in player.failures)
    thinking = {name: player.thinking for name, player in players.items()}
    return Ending(coordinator.match.state(Observation({}), estop=False), executor.time, failures, thinking)


def _write_end(steps: StepLog | None, logs: Path | None, nodes: Iterable[Node], time: float) -> None:
    """Write when the match has ended, s of match time, and what nodes have counted."""
    if steps is not None:
        steps.write(Ended(time=round(time, 6)))
    if logs is not None:
        for node in nodes:
            write_json(logs / f"{node.name}.json", node.counted())


def _go_on_by(assembly: Assembly[SteppedPlayer], before: MatchSetup, now: MatchSetup, drawn: int) -> None:
    """Let a match go on by the rules, the radio and the seed of another match file, where they are others than before.

    Args:
        drawn: the seed by which the rules have drawn.
    """
    if now.rules != before.rules:
        assembly.coordinator.judge_by(rulebook_of(structs.replace(now, seed=drawn)))
    if now.seed != before.seed:
        assembly.world.world.reseed(now.draw(NOISE))
    if (now.radio, now.seed) != (before.radio, before.seed):
        for name, player in assembly.players.items():
            player.radio.link = link_of(now.radio.settings, now.draw(radio_seed(name)))


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
        if table is None or (emulated := table.emulation) is None:
            real += robots
        else:
            emulated.attach(robots, simulation, setup.seed)
    if real:
        raise ConfigError(
            f"{', '.join(real)}: expected virtual robots, or drives on an emulated CAN bus (`emulate = true` in "
            "[backends.can]): a match in steps waits for no others; leave --in-process or --lockstep out, or add --sim"
        )
    return simulation
