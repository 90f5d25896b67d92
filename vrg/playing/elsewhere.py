"""Strategies on other machines, for a match in lockstep: each is what an ssh of its own runs there."""

import contextlib
import os
import select
import shutil
import signal
import tempfile
from functools import partial
from pathlib import Path

from msgspec import structs

from vrg import __version__
from vrg.bus.stopping import stop_on_signals
from vrg.config.code_files import imported, readable_parts
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError
from vrg.games import file_of
from vrg.launch.remote.travel import take_in
from vrg.launch.remote.wire import BANNER, FilePart
from vrg.playing.strategy_process import Assignment, decide
from vrg.runs.run_folder import RunFolder

_LOOK = 0.2
"""The longest real time in s between two looks at whether this is to stop."""


def assignment_elsewhere(setup: MatchSetup, name: str, *, sealed: bool) -> Assignment:
    """The assignment of a strategy's process on another machine, with the files of the strategy.

    Raises:
        ConfigError: there is no such player, or a file cannot be read.
    """
    code, target, files = setup.strategy_file(name), setup.player(name).strategy, {}
    if code is not None:
        parts = [part for path in (code, *imported(code)) for part in readable_parts(path.resolve())]
        try:
            files = {part.relative_to(code.parent).as_posix(): part.read_bytes() for part in parts}
        except (OSError, ValueError) as error:
            raise ConfigError(f"{target}: cannot be sent to another machine: {error}") from None
        if (file := file_of(target)) is not None:
            setup = setup.substituted(name, f"{code.name}{target.removeprefix(file)}")
    setup = structs.replace(setup, base="", origin="", map="")
    return Assignment(setup.for_player(name), name, "", sealed, make=True, files=files)


def _placed(home: Path, assignment: Assignment) -> Assignment:
    """The assignment, once its files are written to a folder.

    Raises:
        ConfigError: it comes from another version of VRG, or they cannot be written.
    """
    if assignment.version != __version__:
        raise ConfigError(
            f"expected VRG {__version__} as on this machine, got {assignment.version}: install one on both"
        )
    try:
        for name, data in assignment.files.items():
            take_in(home, FilePart(name, data, begins=True))
        run = RunFolder(home)
        run.prepare()
        os.chdir(home)
    except OSError as error:
        raise ConfigError(f"{home}: cannot be written: {error.strerror}") from None
    setup = structs.replace(assignment.setup, base=str(home), origin=str(run.match_file))
    return structs.replace(assignment, setup=setup, run=str(home))


def serve() -> int:
    """Run a strategy on this machine for a match elsewhere, until it or the connection of ssh ends.

    Nothing is left of it then, whatever its code does.

    Raises:
        LaunchError: this is not Linux.
    """
    if not hasattr(os, "pidfd_open"):
        raise LaunchError("strategies run for matches elsewhere on Linux alone: use a machine that has it")
    home = tempfile.mkdtemp(prefix="vrg-strategy-")
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            os.setsid()
            reader, writer = os.dup(0), os.dup(1)
            os.write(1, BANNER)
            os.dup2(2, 1)
            status = decide(reader, writer, partial(_placed, Path(home)))
        finally:
            os._exit(status)
    with stop_on_signals() as stop:
        ended = select.poll()
        ended.register(0, select.POLLRDHUP)  # only that it was closed: its data is for the other process
        ended.register(os.pidfd_open(pid), select.POLLIN)
        while not stop.is_set() and not ended.poll(1000 * _LOOK):
            pass
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        shutil.rmtree(home, ignore_errors=True)
    return max(0, status)
