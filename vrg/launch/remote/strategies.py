"""Starts strategies on other machines, for a match in lockstep: each is what an ssh of its own runs there."""

import contextlib
import os
import select
import shutil
import signal
import socket
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO

from vrg.bus.stopping import stop_on_signals
from vrg.config.files import Machine
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError
from vrg.games import file_of
from vrg.launch.code_files import imported, readable_parts
from vrg.launch.fork_server import Child, Spawned
from vrg.launch.remote.ssh import command_for, why_ended
from vrg.launch.remote.wire import BANNER

_LOOK = 0.2
"""The longest real time in s to wait for the next byte."""
_GREETING = 100_000
"""The number of bytes that a login shell may print before."""


class RemoteStarter:
    """Starts processes of strategies on one machine, in place of a fork server.

    Args:
        name: its name in the match file. machine: how it is reached.
    """

    def __init__(self, name: str, machine: Machine) -> None:
        self._name, self._machine = name, machine

    def run(self, module: str, arguments: Sequence[str], log: IO[bytes]) -> Child:
        """Start a process that answers as `vrg.launch.apart.main` does.

        Args:
            log: the file for what it prints, and ssh.

        Raises:
            LaunchError: that machine cannot be reached, or has no VRG.
        """
        began, command = log.tell(), command_for(self._machine, "node strategy")
        ours, theirs = socket.socketpair()
        with theirs:
            try:
                process = subprocess.Popen(
                    command, stdin=theirs.fileno(), stdout=theirs.fileno(), stderr=log, start_new_session=True
                )
            except OSError as error:
                ours.close()
                raise LaunchError(f"{command[0]} cannot be run: {error.strerror}: install OpenSSH's client") from error
        skipped = bytearray()
        while not skipped.endswith(BANNER):
            # ssh itself gives up a machine that does not answer.
            there = select.select([ours], [], [], _LOOK)[0]
            byte = ours.recv(1) if there else b""
            skipped += byte
            if (there and not byte) or len(skipped) > _GREETING:
                process.kill()
                ours.close()
                process.wait()
                path = Path(log.name)
                with path.open("rb") as written:
                    written.seek(began)
                    printed = written.read() or bytes(skipped)
                why = why_ended(process.returncode, printed, self._name, self._machine, path)
                raise LaunchError(f"{self._name}: {why}")
        return Spawned(process, ours)


def files_of(setup: MatchSetup, name: str) -> tuple[str, dict[str, bytes]]:
    """The strategy of a player as it is named in a folder with its files alone, and these by their paths there.

    Raises:
        ConfigError: there is no such player, or a file cannot be read.
    """
    code, strategy = setup.strategy_file(name), setup.player(name).strategy
    if code is None:
        return strategy, {}
    parts = [part for path in (code, *imported(code)) for part in readable_parts(path.resolve())]
    try:
        files = {part.relative_to(code.parent).as_posix(): part.read_bytes() for part in parts}
    except (OSError, ValueError) as error:
        raise ConfigError(f"{strategy}: cannot be sent to another machine: {error}") from None
    file = file_of(strategy)
    return strategy if file is None else f"{code.name}{strategy.removeprefix(file)}", files


def serve(main: Callable[[Sequence[str]], int]) -> int:
    """Run a strategy on this machine for a match elsewhere, until it or the connection of ssh ends.

    Nothing is left of it then, whatever its code does.

    Args:
        main: runs it, in a process of its own; its arguments are the word `away`, and the folder for its files.

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
            status = main(["away", home])
        finally:
            os._exit(status)
    with stop_on_signals() as stop:
        ended = select.poll()
        ended.register(0, select.POLLRDHUP)  # only that it was closed: what comes is for the other process
        ended.register(os.pidfd_open(pid), select.POLLIN)
        while not stop.is_set() and not ended.poll(1000 * _LOOK):
            pass
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        shutil.rmtree(home, ignore_errors=True)
    return max(0, status)
