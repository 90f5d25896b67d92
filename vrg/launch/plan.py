"""The plan of a match: its processes, and those of them that run on one machine."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec import structs

from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.games import game_of
from vrg.kinds import COORDINATOR, KINDS, PLAYER, RECORDER, ROUTER, SPECTATOR, TRACKER, WORLD, Kind
from vrg.launch.process import Process
from vrg.seats.seat import Seat


def planned(setup: MatchSetup, *, window: bool, record: bool, views: Sequence[Process] = ()) -> Iterator[Process]:
    """The processes of a match on all machines, in the order in which they are started; routers come first.

    Args:
        window: True opens the window. record: True runs the recorder.
        views: the processes that serve views of the match to other programs.
    """

    def process(kind: Kind, name: str, node: str | None = None, machine: str | None = None) -> Process:
        node = name if node is None else node
        return Process(
            name=name,
            kind=kind.name,
            node=node,
            machine=setup.place.get(name, HERE) if machine is None else machine,
            pulse=setup.keys.pulse(kind.pulse or kind.name, name if kind.views else node).key,
            physical=name in setup.physical,
            waits=name in setup.physical and bool(setup.companions),
        )

    routers = [("router", setup.place.get("router", HERE))]
    routers += [(f"router-{name}", name) for name, machine in setup.machines.items() if machine.router]
    for name, machine in routers:
        yield Process(name=name, kind=ROUTER.name, machine=machine)
    yield process(WORLD, WORLD.process)
    yield process(COORDINATOR, COORDINATOR.process)
    for name in setup.trackers:
        yield process(TRACKER, name)
    for companion in setup.companions:
        at, command = setup.place.get(companion.name, HERE), (*companion.arguments, "--leash")
        yield Process(name=companion.name, machine=at, command=command, says=companion.says)
    if record:
        yield process(RECORDER, RECORDER.process)
    if window:
        # The window of a match has one name, whatever it shows.
        kind, node = window_of(setup)
        yield process(kind, SPECTATOR.process, node)
    for view in views:
        yield process(KINDS.get(view.kind), view.name, view.node, HERE)
    for player in setup.players:
        yield process(PLAYER, player.name)


def window_of(setup: MatchSetup) -> tuple[Kind, str]:
    """The kind of the window that a match opens, as its game names it, and the name of the window's node.

    A window of one player or one team is that of the first.

    Raises:
        ConfigError: there is no such kind, or it is that of no window.
    """
    kind, first = KINDS.get(game_of(setup.game).window), setup.players[0]
    if kind.runner != SPECTATOR.runner:
        raise ConfigError(f"game {setup.game}: window: expected the kind of a window, got {kind.name!r}")
    return kind, {"player": first.name, "team": first.team}.get(kind.named, "window")


def seats_at(setup: MatchSetup, machine: str, *, window: bool, record: bool) -> list[Seat]:
    """The seats of the processes of a machine, each once.

    A window on another machine may watch, and engage the emergency stop; it may not decide.
    """
    own = [one for one in planned(setup, window=window, record=record) if one.machine == machine]
    return list(dict.fromkeys(one.of.seats_of(one.node)[-1] for one in own if one.of is not None))


def processes_at(
    setup: MatchSetup,
    folder: Path,
    endpoint: str,
    *,
    window: bool,
    record: bool,
    machine: str = HERE,
    upstream: str | None = None,
    keys: Path | None = None,
    views: Sequence[Process] = (),
) -> list[Process]:
    """The processes of a match that run on one machine, the router first.

    Args:
        folder: the run folder on that machine. endpoint: the endpoint of the router that its processes use.
        window, record, views: see `planned`.
        machine: the name of the machine.
        upstream: the endpoint of the router of the match, if the machine has a further one.
        keys: the folder of the keys of the seats on that machine; None in a match without them.
    """
    run, given = str(folder.resolve()), None if keys is None else str(keys)
    return [
        structs.replace(
            one,
            router=endpoint,
            upstream=upstream if one.is_router else None,
            run=run,
            keys=given,
            trusted=not (one.plays and setup.sandboxed(one.name, seats=keys is not None)),
        )
        for one in planned(setup, window=window, record=record, views=views)
        if one.machine == machine
    ]
