"""The processes of a match, and those of them that run on one machine."""

from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.games import game_of
from vrg.kinds import KINDS, PLAYER, ROUTER, SPECTATOR, TRACKER, WEB, Kind, every_kind
from vrg.launch.child import Job
from vrg.launch.managed import ProcessSpec
from vrg.seats.seat import Seat

if TYPE_CHECKING:
    from vrg.ui.web.admission import Admission


def placed(
    setup: MatchSetup,
    *,
    window: bool,
    record: bool,
    served: Collection[str] = (),
) -> dict[str, str]:
    """The machine of each process of a match, by the process' name, in the order in which they are started.

    Args:
        window: True opens the window. record: True runs the recorder.
        served: the names of the processes that serve views of the match to other programs.
    """
    names = ["world", "referee", *setup.trackers, *(companion.name for companion in setup.companions)]
    names += ["recorder"] if record else []
    names += [SPECTATOR.process] if window else []
    names += served
    names += [player.name for player in setup.players]
    routers = {"router": setup.place.get("router", HERE)}
    routers |= {f"router-{name}": name for name, machine in setup.machines.items() if machine.router}
    return routers | {name: setup.place.get(name, HERE) for name in names}


def kind_of(setup: MatchSetup, process: str) -> Kind | None:
    """The kind of a process of a match; None for a companion, which has no part in the bus.

    Args:
        process: its name.
    """
    if process in [player.name for player in setup.players]:
        return PLAYER
    if process in setup.trackers:
        return TRACKER
    if process in [companion.name for companion in setup.companions]:
        return None
    # The window of a match has one name, whatever it shows; and a match may have further routers.
    if process == SPECTATOR.process:
        return window_of(setup)[0]
    return next((kind for kind in every_kind() if kind.process == process), ROUTER)


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
    where = placed(setup, window=window, record=record)
    kinds = {process: kind_of(setup, process) for process, at in where.items() if at == machine}
    names = {process: window_of(setup)[1] if process == SPECTATOR.process else process for process in kinds}
    seats = [kind.seats_of(names[process])[-1] for process, kind in kinds.items() if kind is not None]
    return list(dict.fromkeys(seats))


def specs(
    setup: MatchSetup,
    folder: Path,
    endpoint: str,
    *,
    window: bool,
    record: bool,
    machine: str = HERE,
    upstream: str | None = None,
    keys: Path | None = None,
    page: "Admission | None" = None,
    served: Mapping[str, str] = MappingProxyType({}),
) -> list[ProcessSpec]:
    """The processes of a match that run on one machine, the router first.

    The router starts first, then all others at once. Only players of physical robots wait, until all companions are
    ready.

    Args:
        folder: the run folder on that machine. endpoint: the endpoint of the router that its processes use.
        window: True opens the window. record: True runs the recorder.
        machine: the name of the machine.
        upstream: the endpoint of the router of the match, if the machine has a further one.
        keys: the folder of the keys of the seats on that machine; None in a match without them.
        page: where the page is served, and for whom; None without one.
        served: where the processes of further views serve, such as `127.0.0.1:8765`, by their names; as their kinds
            open them (see `vrg.kinds.Opening`). Those that are missing do not run.
    """
    run, given = str(folder.resolve()), None if keys is None else str(keys)
    companions = {companion.name: companion for companion in setup.companions}

    def spec(process: str) -> ProcessSpec:
        kind = kind_of(setup, process)
        if kind is None:
            arguments, says = (*companions[process].arguments, "--leash"), companions[process].says
            return ProcessSpec(process, arguments, None, 1, 2, says=says, command=True)
        if kind is ROUTER:
            job = Job(kind=kind.name, router=endpoint, run=run, keys=given, upstream=upstream)
            return ProcessSpec(process, job.arguments, None, 0, kind.stop_order)
        own = window_of(setup)[1] if process == SPECTATOR.process else process
        name = {WEB.process: "", **served}.get(process, own)
        return ProcessSpec(
            process,
            Job(kind=kind.name, router=endpoint, run=run, name=name, keys=given).arguments,
            setup.keys.pulse(kind.pulse or kind.name, process if kind.views else name).key,
            group=2 if process in setup.physical and companions else 1,
            stop_order=kind.stop_order,
            essential=kind.essential,
            seat=kind.plays,
            physical=process in setup.physical,
            trusted=not (kind.plays and setup.sandboxed(process, seats=keys is not None)),
            secret=page.encoded() if page is not None and kind is WEB else "",
        )

    where = placed(setup, window=window, record=record, served=[*([] if page is None else [WEB.process]), *served])
    return [spec(process) for process, at in where.items() if at == machine]
