"""The life of every process of a match, from its start to its end: it runs one node, or the router.

`python -P -m vrg.launch.process_main PROCESS` is one that the supervisor has started. It does the same as `vrg node
world`, `vrg node player` and so on, but it reads the set-up that the launcher has checked already, and it does not load
the command line. In most cases it is forked from the fork server and needs no new interpreter. So twelve processes
start in about the time of one.
"""

import json
import logging
import os
import select
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrg.blame import DecisionTimeoutError, failure_of
from vrg.bus.access import rules
from vrg.bus.process import Statistics, run_node
from vrg.bus.session import Session, open_router, open_session
from vrg.bus.stopping import Stop, StopSignal, stop_on_signals
from vrg.bus.topics import Keys
from vrg.config.setup import MatchSetup, read_setup
from vrg.errors import HangError, LaunchError, StrategyError, VrgError
from vrg.kinds import KINDS, PLAYER, ROUTER, WEB
from vrg.launch import ending
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.launch.ending import LEASH
from vrg.launch.folder_lock import delete_abandoned_keys
from vrg.launch.process import Process, process_of
from vrg.launch.process_log import LOG_FORMAT
from vrg.registry import load_object
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import find_credentials, is_official
from vrg.system import POSIX, bound_processor_time
from vrg.types import printable

if TYPE_CHECKING:
    from vrg.ui.window.window_node import WindowNode

log = logging.getLogger("vrg.launch.process_main")  # also where it is the program itself

FAILED_FOR_GOOD, HUNG = 3, 4
"""The exit status of a player whose strategy has failed in a way that makes another start useless, or hangs."""
LEASH_TIMEOUT = 10.0
"""The real time in s that a node has to stop once its supervisor is gone."""
STUCK = 30.0
"""The processor time in s that a node may use while no thread of Python comes to run, as in a loop in C code, before it
is ended. This does not need a supervisor."""


def main(arguments: Sequence[str]) -> int:
    """Be the process that the supervisor has started, and return its exit status.

    Args:
        arguments: a `Process` as JSON.
    """
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    process = process_of(arguments[0])
    setproctitle(process.title)
    folder, keys = RunFolder(Path(process.run)), None if process.keys is None else Path(process.keys)
    try:
        if process.is_router:
            routed = None if keys is None else read_setup(folder.setup)
            stop = serve_router(process.router, upstream=process.upstream, setup=routed, keys=keys, leash=True)
        else:
            setup = read_setup(folder.setup_of(process.node) if process.kind == PLAYER.name else folder.setup)
            if process.strategy:
                setup = setup.substituted(process.node, process.strategy)
            stop = serve(process, setup, leash=True, secret=read_secret() if process.kind == WEB.name else "")
    except VrgError as error:
        print(f"vrg: {printable(str(error), lines=True)}", file=sys.stderr)
        ending.tell(error, str(error), name=process.node)
        if isinstance(error, HangError):
            return HUNG
        return FAILED_FOR_GOOD if isinstance(error, StrategyError) and error.final else 1
    except KeyboardInterrupt:
        return 130
    except Exception as error:  # of the rules of any game, or the driver of any robot: the log has the whole of it
        traceback.print_exception(error)
        why = str(failure_of(error))
        print(f"vrg: {why}", file=sys.stderr)
        ending.tell(error, why, name=process.node)
        return 1
    finally:
        if keys is not None:
            delete_abandoned_keys([keys])  # if the launcher was killed
    return 130 if stop.interrupted else 0


def read_secret() -> str:
    """The line that the supervisor has written to this process's standard input.

    Raises:
        LaunchError: there is none.
    """
    # The leash is read by its descriptor, too: no more than the line may be taken from it.
    line = bytearray()
    while not line.endswith(b"\n"):
        byte = os.read(LEASH, 1)
        if not byte:
            raise LaunchError("expected a line on standard input, found its end: the supervisor is gone")
        line += byte
    return line.decode().rstrip("\n")


def serve(process: Process, setup: MatchSetup, *, leash: bool = False, secret: str = "", quiet: bool = False) -> Stop:
    """Run a node of a match until it is stopped, and return the stop, which tells the reason.

    Args:
        process: what the node is; not the router. A world continues from its snapshot in the run folder, and a
            coordinator from its journal, in HALT.
        leash: True if the process must stop when its standard input is closed, which happens when its parent dies.
        secret: see `vrg.launch.context.NodeContext`.
        quiet: True logs only warnings, and keeps no statistics: a person runs it beside a match.

    Raises:
        VrgError: the router or the robot cannot be reached, the set-up has problems, or a node of that name runs.
    """
    kind, name = KINDS.get(process.kind), process.node
    folder = RunFolder(Path(process.run) if process.run else Path("runs") / setup.name)
    keys = None if process.keys is None else Path(process.keys)
    if process.run or kind.keeps:
        folder.prepare()
    if kind.draws and keys is not None and not setup.secret:
        # Where no launcher has drawn one; nothing that these kinds draw is the same.
        setup = setup.with_secret(folder.secret())
    begun = load_object(kind.begins)(setup, name, folder, keys) if kind.begins else None
    credentials = None if keys is None else find_credentials(keys, kind.seats_of(name))
    with ExitStack() as stack:
        stop = stack.enter_context(child_process(leash, quiet=quiet))
        session = stack.enter_context(open_session(process.router, stop=stop, credentials=credentials))
        context = NodeContext(
            process=process,
            setup=setup,
            folder=folder,
            session=session,
            stop=stop,
            official=is_official(credentials),
            own=leash,
            secret=secret,
            begun=begun,
            stack=stack,
        )
        made: Made = load_object(kind.node)(context)
        node = made.node
        try:
            statistics: Statistics = load_object(kind.runner)(node, session, setup.keys, stop, **made.options)
        except DecisionTimeoutError as error:
            raise HangError(str(error)) from None
        kept = (process.run or kind.keeps) and not quiet
        _report(folder if kept else None, node.name, statistics, node.counted())
        return stop


def run_window(
    window: "WindowNode", session: Session, keys: Keys, stop: StopSignal, ended: Callable[[], bool] | None
) -> Statistics:
    """Run a window until the user closes it or it is stopped.

    Once the match of one that is none of its own has ended, it leaves the session, and shows how the match was left;
    another match that is played at the same place is not shown.

    Args:
        ended: returns True if the match does not run any more, as far as that is known; None in a window of the match.
    """

    def finished() -> bool:
        return window.closed or (ended is not None and window.has_ended(ended()))

    statistics = run_node(window, session, keys, stop, finished=finished, idle=DISPLAY_PERIOD)
    if ended is not None:
        session.close()
        window.linger(stop)
    return statistics


def is_sealed(setup: MatchSetup, name: str, *, seats: bool) -> bool:
    """True if the process in which a player's strategy decides is sealed on this machine.

    One that cannot refuses where the match file wants it or the match has seats; the default for strangers' files is
    only for machines that can.

    Raises:
        ConfigError: there is no such player.
    """
    from vrg.launch.sandbox.seal import missing  # noqa: PLC0415 - most matches have no sandboxes

    return setup.sandboxed(name, seats=seats) and (seats or bool(setup.sandbox) or missing() is None)


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
            credentials, access = find_credentials(keys, ROUTER.seats_of("")), rules(setup.roster)
        stack.enter_context(open_router(endpoint, upstream=upstream, credentials=credentials, access=access))
        log.info("routing at %s%s", endpoint, "" if credentials is None else ", for seats only")
        stop.wait()
    return stop


@contextmanager
def child_process(leash: bool, *, quiet: bool = False) -> Iterator[Stop]:
    """Set up logging, signals and the leash of a process.

    Args:
        leash: True if the process must stop when its standard input is closed, which happens when its parent dies.
        quiet: True logs only warnings.
    """
    level = logging.WARNING if quiet else logging.INFO
    logging.basicConfig(level=level, format=LOG_FORMAT)
    # zenoh's threads wait for the interpreter's lock, so it must be released sooner than after the default 5 ms.
    sys.setswitchinterval(1e-3)
    with stop_on_signals() as stop:
        if leash:
            threading.Thread(target=_hold_leash, args=(stop,), daemon=True).start()
        yield stop


def _hold_leash(stop: Stop) -> None:
    # It reads the bare descriptor, because a thread that holds the lock of sys.stdin keeps the interpreter from ending.
    is_held = True
    while is_held:
        # Code that never gives up the interpreter's lock keeps this thread from running. Then the kernel ends it all.
        bound_processor_time(STUCK)
        is_held = held()
    log.info("stopping: the supervisor %s", "is gone" if POSIX else "is gone, or has asked for it")
    stop.set()
    # A node that is stuck, in a student's endless loop say, never looks at `stop`, and no process is left to kill it.
    time.sleep(LEASH_TIMEOUT)
    os._exit(1)


def held() -> bool:
    """Wait a second, or until the leash is released; return whether it is still held.

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
            (folder.logs / f"{name}.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        except OSError as error:
            log.warning("statistics cannot be kept: %s", error)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
