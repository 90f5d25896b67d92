"""`vrg router | world | coordinator | player | recorder | spectator`: one node in a process of its own."""

import logging
import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node
from vrg.bus.process import Statistics, run_node, run_world
from vrg.bus.session import DEFAULT_ENDPOINT, open_router, open_session
from vrg.bus.topics import Keys
from vrg.commands.options import (
    BaseOption,
    EndpointOption,
    LeashOption,
    MatchArgument,
    NameOption,
    RouterOption,
    RunOption,
    child_process,
    which_match,
)
from vrg.config import MatchSetup, load_match, match_path
from vrg.errors import LaunchError
from vrg.launch import nodes
from vrg.launch.run_folder import RunFolder, write_json, write_whole

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 5
"""World ticks between snapshots: 0.1 s of match time with the default tick."""

WINDOW_PERIOD = 1 / 30
"""s of real time between looks at a window's keys."""


def _setup(match: str, base: Path | None) -> MatchSetup:
    return load_match(match_path(match), base=base)


def _run_folder(run: Path | None, setup: MatchSetup) -> RunFolder:
    folder = RunFolder(run or Path("runs") / setup.file.name)
    folder.prepare()
    return folder


def _report(folder: RunFolder | None, name: str, statistics: Statistics) -> None:
    log.info("statistics: %s", asdict(statistics))
    if folder is not None:
        try:
            write_json(folder.logs / f"{name}.json", asdict(statistics))
        except OSError as error:
            log.warning("statistics cannot be kept: %s", error)


def _run(build: Callable[[], Node], keys: Keys, router: str, leash: bool, folder: RunFolder | None) -> None:
    with child_process(leash) as stop, open_session(router, stop=stop) as session:
        node = build()
        _report(folder, node.name, run_node(node, session, keys, stop))


def router(endpoint: RouterOption = DEFAULT_ENDPOINT, leash: LeashOption = False) -> None:
    """Serve as the router that all processes of a match connect to."""
    with child_process(leash) as stop, open_router(endpoint):
        log.info("routing at %s", endpoint)
        stop.wait()


def world(
    match: MatchArgument,
    router: RouterOption = DEFAULT_ENDPOINT,
    run: RunOption = None,
    base: BaseOption = None,
    leash: LeashOption = False,
) -> None:
    """Run the world: physics, sensors and the match clock. Goes on from the run folder's snapshot, if there is one."""
    setup = _setup(match, base)
    folder = _run_folder(run, setup)
    with child_process(leash) as stop, open_session(router, stop=stop) as session:
        node = nodes.world_node(setup)
        if folder.snapshot.exists():
            node.restore(folder.snapshot.read_bytes())
            log.info("going on from the snapshot at tick %d", node.start_tick)
        keeper = _SnapshotKeeper(folder, node.snapshot)
        first, rate = node.start_tick, setup.world.rate
        statistics = run_world(node, session, setup.keys, stop, first_tick=first, rate=rate, after_tick=keeper)
        _report(folder, "world", statistics)


class _SnapshotKeeper:
    """Saves the world now and then, so that a world that crashed is taken up again."""

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


def coordinator(
    match: MatchArgument,
    router: RouterOption = DEFAULT_ENDPOINT,
    run: RunOption = None,
    base: BaseOption = None,
    leash: LeashOption = False,
) -> None:
    """Run the referee. Goes on from the run folder's journal, in HALT, if there is one."""
    setup = _setup(match, base)
    folder = _run_folder(run, setup)
    with nodes.open_journal(setup, folder) as journal:
        _run(lambda: nodes.coordinator_node(setup, journal), setup.keys, router, leash, folder)


def player(
    match: MatchArgument,
    name: Annotated[str, typer.Argument(help="Name of the player in the match file.")],
    router: RouterOption = DEFAULT_ENDPOINT,
    run: RunOption = None,
    base: BaseOption = None,
    leash: LeashOption = False,
) -> None:
    """Run one player with its robot."""
    setup = _setup(match, base)
    setup.player(name)
    folder = RunFolder(run) if run else None
    _run(lambda: nodes.player_node(setup, name), setup.keys, router, leash, folder)


def recorder(
    match: MatchArgument,
    router: RouterOption = DEFAULT_ENDPOINT,
    run: RunOption = None,
    base: BaseOption = None,
    leash: LeashOption = False,
) -> None:
    """Record a match to the run folder, for Foxglove."""
    setup = _setup(match, base)
    folder = _run_folder(run, setup)
    _run(lambda: nodes.recorder_node(setup, folder), setup.keys, router, leash, folder)


def spectator(
    match: Annotated[
        str | None,
        typer.Argument(metavar="[GAME|match.toml]", help="The match file, for the map's walls and the robots' sizes."),
    ] = None,
    name: NameOption = None,
    router: EndpointOption = None,
    run: RunOption = None,
    base: BaseOption = None,
    leash: LeashOption = False,
) -> None:
    """Watch a match in a window; several may. Closing the window does not end the match."""
    from vrg.ui.spectator import Spectator, display_available  # noqa: PLC0415 - pygame takes half a second to load

    if not display_available():
        raise LaunchError("expected a display to open a window on, found none: set DISPLAY or WAYLAND_DISPLAY")
    setup = _setup(match, base) if match else None
    if setup is not None and router is not None:
        keys, endpoint = setup.keys, router
    else:
        found, endpoint = which_match(setup.file.name if setup else name, router)
        keys = Keys(found)
    pictures = run or Path()
    own = "window" if leash else f"window-{os.getpid()}"
    with child_process(leash) as stop, open_session(endpoint, stop=stop) as session:
        if setup is None:
            node = Spectator(own, Mailbox(), keys, pictures=pictures)
        else:
            node = nodes.spectator_node(setup, own, pictures)
        statistics = run_node(node, session, keys, stop, finished=lambda: node.closed, idle=WINDOW_PERIOD)
        _report(RunFolder(run) if run else None, own, statistics)
