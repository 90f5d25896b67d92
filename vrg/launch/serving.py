"""The life of every process of a match, from its start to its end: it runs one node, or the router."""

import json
import logging
import os
import select
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrg.blame import tell_of_refusals
from vrg.bus.access import rules
from vrg.bus.credentials import Credentials, find_credentials, is_official
from vrg.bus.node import Node
from vrg.bus.process import Statistics, run_node, run_world
from vrg.bus.refusals import refusals_logged
from vrg.bus.seats import seats_of_node
from vrg.bus.session import Session, joined, open_router, open_session
from vrg.bus.stopping import Stop, StopSignal, stop_on_signals
from vrg.bus.topics import Keys
from vrg.config.files import LIVE, ROS, THREE
from vrg.config.setup import MatchSetup, write_setup
from vrg.errors import LaunchError, SandboxError, StrategyError
from vrg.files import read_bytes, write_whole
from vrg.launch import nodes
from vrg.launch.bounds import BoundedOutput, MemoryBound, printing_to, say_where_on_request
from vrg.launch.run_folder import RunFolder
from vrg.launch.running import gone
from vrg.system import POSIX, bound_processor_time

if TYPE_CHECKING:
    from vrg.ui.window_node import WindowNode

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 5
"""The number of world ticks between two snapshots. With the default tick this is 0.1 s of match time."""
WINDOW_PERIOD = 1 / 30
"""The real time in s between two looks at a window's keys."""
LEASH_TIMEOUT = 10.0
"""The real time in s that a node has to stop once its supervisor is gone."""
STUCK = 30.0
"""The processor time in s that a node may use while no thread of Python comes to run, as in a loop in C code, before it
is ended. This does not need a supervisor."""
DISPLAY_KINDS = ("spectator", "developer", "hud", "web", "foxglove", "three", "ros")
"""The kinds of nodes that show the match to people."""
KINDS = ("world", "coordinator", "recorder", "tracker", *DISPLAY_KINDS, "player")
"""The kinds of nodes that `serve` can run."""


def serve(
    kind: str,
    setup: MatchSetup,
    *,
    router: str,
    run: Path | None = None,
    name: str = "",
    keys: Path | None = None,
    leash: bool = False,
    secret: str = "",
) -> Stop:
    """Run a node of a match until it is stopped, and return the stop, which tells the reason.

    Args:
        kind: one of KINDS. name: the name of a player, also for its display, or of a window, or where others serve.
        router: the endpoint of the router.
        keys: the folder of the keys of the match's seats; None in a match without them.
        run: the run folder. A world goes on from its snapshot there, and a coordinator from its journal, in HALT.
        leash: True if the process must stop when its standard input is closed, which happens when its parent dies.
        secret: of the page, who may do what there: an encoded `vrg.ui.web.admission.Admission`.

    Raises:
        VrgError: the router or the robot cannot be reached, the set-up has problems, or a node of that name runs.
    """
    folder = RunFolder(run or Path("runs") / setup.name)
    if run is not None or kind not in ("player", "spectator", "developer", "hud"):
        folder.prepare()
    if kind in ("world", "coordinator") and keys is not None and not setup.secret:
        # Where no launcher has drawn one; nothing that these two draw is the same.
        setup = setup.with_secret(folder.secret())
    credentials = None if keys is None else find_credentials(keys, seats_of_node(kind, name))
    sealed = kind == "player" and is_sealed(setup, name, seats=keys is not None)
    if sealed:
        # Threads that run already would stay as they are, so this comes before there are any.
        folder.prepare()
        _seal(setup, name, router, folder, credentials)
    with ExitStack() as stack:
        stop = stack.enter_context(child_process(leash))
        if sealed:
            log.info("sealed: it reaches the router, reads its own files, and writes in %s", folder.of_player(name))
        session = stack.enter_context(
            open_session(router, stop=stop, credentials=credentials, shared_memory=not sealed)
        )
        if kind == "world":
            world = nodes.world_node(setup)
            if folder.snapshot.exists():
                world.restore(read_bytes(folder.snapshot))
                log.info("going on from the snapshot at tick %d", world.start_tick)
            keeper = _SnapshotKeeper(folder, world.snapshot)
            first = world.start_tick
            statistics = run_world(
                world, session, setup.keys, stop, first_tick=first, rate=setup.rate, after_tick=keeper
            )
            _report(folder, "world", statistics, world.counted())
            return stop
        node: Node
        run_it: Callable[..., Statistics] = run_node
        if kind == "coordinator":
            if not folder.setup.exists():
                # Where no launcher has written it, `vrg run result` and `vrg run plot` need it.
                write_setup(setup, folder.setup)
            journal = stack.enter_context(nodes.open_journal(setup, folder, aside=True))
            node = nodes.coordinator_node(setup, journal)
        elif kind in ("recorder", "tracker"):
            node = nodes.recorder_node(setup, folder) if kind == "recorder" else nodes.tracker_node(setup, name)
        elif kind == "player":
            stack.enter_context(_students_code(setup.memory))
            node = nodes.player_node(setup, name)
        elif kind in DISPLAY_KINDS:
            official = is_official(credentials)
            node, run_it = _shown(
                kind, setup, session, name, run, secret, official=official,
                join=lambda to: stack.enter_context(joined(to, stop)) if to else session,
                ended=None if leash else gone(setup.name, router),
            )  # fmt: skip
        else:
            raise LaunchError(f"expected one of {', '.join(KINDS)}, got {kind!r}")
        statistics = run_it(node, session, setup.keys, stop)
        kept = run is not None or sealed or kind == "coordinator"
        _report(folder if kept else None, node.name, statistics, node.counted())
        return stop


def run_window(
    window: "WindowNode", session: Session, keys: Keys, stop: StopSignal, ended: Callable[[], bool]
) -> Statistics:
    """Run a window that is none of the match's own, until the user closes it or it is stopped.

    Once the match has ended it leaves the session, and shows how the match was left; another match that is played at
    the same place is not shown.

    Args:
        ended: returns True if the match does not run any more, as far as that is known.
    """

    def finished() -> bool:
        return window.closed or window.has_ended(ended())

    statistics = run_node(window, session, keys, stop, finished=finished, idle=WINDOW_PERIOD)
    session.close()
    window.linger(stop)
    return statistics


def _shown(
    kind: str,
    setup: MatchSetup,
    session: Session,
    name: str,
    run: Path | None,
    secret: str,
    *,
    official: bool,
    join: Callable[[str], Session],
    ended: Callable[[], bool] | None,
) -> tuple[Node, Callable[..., Statistics]]:
    """Make a node that shows the match to people, and what runs it until they have closed it.

    Args:
        join: returns a session with another router than the match's, or with the match's for an empty endpoint.
        ended: returns True if the match does not run any more; None if the node is one of the match. Any number of
            others may be opened beside it.
    """

    def named(usual: str) -> str:
        return usual if ended is None else f"{usual}-{os.getpid()}"

    served: Mapping[str, Callable[[], Node]] = {
        "web": lambda: nodes.web_node(setup, secret),
        "foxglove": lambda: nodes.live_node(setup, name, named(LIVE)),
        "three": lambda: nodes.three_node(setup, name, named(THREE)),
        "ros": lambda: nodes.ros_node(setup, name, join, name=ROS, official=official),
    }
    if kind in served:
        return served[kind](), partial(run_node, idle=WINDOW_PERIOD)
    window: WindowNode
    if kind == "hud":
        window = nodes.hud_node(setup, name)
    elif kind == "developer":
        view = nodes.developer_node(setup, name or f"developer-{os.getpid()}", run, official=official)
        view.traffic.attach(session)
        window = view
    else:
        window = nodes.spectator_node(setup, name or f"window-{os.getpid()}", run, official=official)
    if ended is None:
        return window, partial(run_node, finished=lambda: window.closed, idle=WINDOW_PERIOD)
    return window, partial(run_window, ended=ended)


def is_sealed(setup: MatchSetup, name: str, *, seats: bool) -> bool:
    """True if the process of a player is sealed on this machine.

    One that cannot refuses where the match file wants it or the match has seats; the default for strangers' files is
    only for machines that can.

    Raises:
        ConfigError: there is no such player.
    """
    from vrg.launch.sandbox.seal import missing  # noqa: PLC0415 - most matches have no sandboxes

    wanted = setup.sandboxed(name, seats=seats)
    return wanted and (seats or bool(setup.sandbox) or missing() is None)


def _seal(setup: MatchSetup, name: str, router: str, folder: RunFolder, credentials: Credentials | None) -> None:
    """Seal this process for a player's code.

    Raises:
        ConfigError: there is no such player. SandboxError: this machine cannot do it.
    """
    from vrg.launch.sandbox.player import policy_of  # noqa: PLC0415 - most matches have no sandboxes
    from vrg.launch.sandbox.seal import REFUSAL_ADVICE, seal  # noqa: PLC0415

    seat = None if credentials is None else credentials.folder
    try:
        (folder.logs / f"{name}.json").touch()
    except OSError as error:
        raise SandboxError(f"{folder.logs}: a sealed player's statistics need a file there: {error}") from error
    seal(policy_of(setup, name, router=router, run=folder, seat=seat))
    tell_of_refusals(REFUSAL_ADVICE)


@contextmanager
def _students_code(memory: int) -> Iterator[None]:
    """Bound what the code of a strategy uses and prints, and log where it fails.

    Args:
        memory: the most memory that it may use, MB.
    """
    say_where_on_request()
    try:
        with MemoryBound(memory), printing_to(BoundedOutput(sys.stdout)):
            yield
    except StrategyError as error:
        log.error("the strategy has failed", exc_info=error.__cause__ or error)
        raise


def serve_router(
    endpoint: str,
    *,
    upstream: str | None = None,
    setup: MatchSetup | None = None,
    keys: Path | None = None,
    leash: bool = False,
) -> Stop:
    """Run the router that all processes of a match connect to, and return the stop, which tells the reason.

    Args:
        upstream: the endpoint of another router to be linked with.
        setup: the match, whose seats may connect. keys: the folder of their keys. Without both, everybody may.
        leash: see `child_process`.

    Raises:
        BusError: the endpoint is taken or cannot be listened on.
    """
    with ExitStack() as stack:
        stop = stack.enter_context(child_process(leash))
        credentials, access = None, None
        if keys is not None and setup is not None:
            credentials, access = find_credentials(keys, seats_of_node("router", "")), rules(setup.roster)
            stack.enter_context(refusals_logged())
        stack.enter_context(open_router(endpoint, upstream=upstream, credentials=credentials, access=access))
        log.info("routing at %s%s", endpoint, "" if credentials is None else ", for seats only")
        stop.wait()
    return stop


@contextmanager
def child_process(leash: bool) -> Iterator[Stop]:
    """Set up logging, signals and the leash of a process.

    Args:
        leash: True if the process must stop when its standard input is closed, which happens when its parent dies.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    # zenoh's threads wait for the interpreter's lock, so it must be released sooner than after the default 5 ms.
    sys.setswitchinterval(1e-3)
    with stop_on_signals() as stop:
        if leash:
            threading.Thread(target=_hold_leash, args=(stop,), daemon=True).start()
        yield stop


def _hold_leash(stop: Stop) -> None:
    # It reads the bare descriptor, because a thread that holds the lock of sys.stdin keeps the interpreter from ending.
    held = True
    while held:
        # Code that never gives up the interpreter's lock keeps this thread from running. Then the kernel ends it all.
        bound_processor_time(STUCK)
        held = _held()
    log.info("stopping: the supervisor %s", "is gone" if POSIX else "is gone, or has asked for it")
    stop.set()
    # A node that is stuck, in a student's endless loop say, never looks at `stop`, and no process is left to kill it.
    time.sleep(LEASH_TIMEOUT)
    os._exit(1)


def _held() -> bool:
    """Wait a second, or until the leash is let go; return whether it is still held.

    On Windows the leash is a pipe, which cannot be waited for.
    """
    try:
        return (POSIX and not select.select([0], [], [], 1.0)[0]) or bool(os.read(0, 64))
    except OSError:
        return False  # it was closed in this process


def _report(folder: RunFolder | None, name: str, statistics: Statistics, counted: Mapping[str, Any]) -> None:
    report = {**asdict(statistics), **counted}
    log.info("statistics: %s", report)
    if folder is not None:
        try:
            # A sealed process can write this file, but make no other beside it.
            (folder.logs / f"{name}.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        except OSError as error:
            log.warning("statistics cannot be kept: %s", error)


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
