"""Plays a match in steps, as fast as it can or at a rate, and shows how it goes."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.bus.stopping import Stop
from vrg.config.setup import write_setup
from vrg.errors import LaunchError
from vrg.kinds import SPECTATOR
from vrg.launch.context import Made, NodeContext
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.launch.plan import window_of
from vrg.launch.process import Process
from vrg.playing import in_process
from vrg.playing.launch import Launch, Played
from vrg.registry import load_object
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import StepLog
from vrg.ui.banner import Help
from vrg.ui.table import TerminalTable

_LAG: Final = 0.2
"""The real time in s that a match in steps may make up for after it was late."""


def play(
    launch: Launch,
    folder: RunFolder,
    server: ForkServer,
    stop: Stop,
    over: Callable[[RefereeState | None], None],
) -> Played:
    """Play a match in lockstep; see `vrg.playing.launch.Way`."""
    setup = launch.setup
    resumable = launch.window and launch.paced
    means = Help.KEYS if resumable else Help.NONE  # no command reaches a match in one process
    watchers: list[Node] = []
    if not launch.console.quiet:
        watchers.append(TerminalTable("terminal", Mailbox(), setup.keys, console=launch.console, means=means))
    if launch.record:
        watchers.append(recorder_node(setup, folder))
    pace = _pace(stop, setup.rate)
    write_setup(setup, folder.setup)
    with ExitStack() as stack, open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        if resumable:
            kind, name = window_of(setup)
            process = Process(name=SPECTATOR.process, kind=kind.name, node=name, run=str(folder.path))
            made: Made = load_object(kind.node)(NodeContext(
                process=process, setup=setup, folder=folder, session=None, stop=stop, official=True, own=True,
                secret="", stack=stack,
            ))  # fmt: skip
            watchers.append(made.node)
        try:
            ending = in_process.play(
                setup,
                journal,
                watchers=watchers,
                limit=launch.limit,
                pace=pace,
                resumable=resumable,
                stop=stop,
                logs=folder.logs,
                apart=launch.strategies(server),
                steps=steps,
            )
        except LaunchError as failure:
            return Played(None, failure)
    return Played(ending.state)


def _pace(stop: Stop, rate: float, clock: Callable[[], float] = time.monotonic) -> Callable[[float], bool]:
    """Return a function that waits for real time between ticks. At rate 0 it only checks whether to stop.

    After a long start, or a stall, the match goes on later. It does not hurry to catch up.

    Args:
        clock: returns the real time, s.
    """
    began: float | None = None

    def wait(match_time: float) -> bool:
        nonlocal began
        if not rate:
            return not stop.is_set()
        since = clock() - match_time / rate
        began = since if began is None else max(began, since - _LAG)
        return not (stop.wait(began - since) if began > since else stop.is_set())

    return wait
