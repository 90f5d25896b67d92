"""Runs commands of `vrg` on other machines with the system's OpenSSH.

OpenSSH and no library: what a person has set up for `ssh HOST` then works here too, such as the configuration, known
hosts, the key agent, jump hosts and shared connections.
"""

import os
import shlex
import signal
import subprocess
from pathlib import Path
from typing import Generic, TypeVar

from vrg.config.files import Machine
from vrg.errors import LaunchError
from vrg.launch.fork_server import Spawned
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.wire import Frames
from vrg.system import POSIX

M = TypeVar("M")

SSH = "VRG_SSH"
"""The environment variable that holds the command for ssh, if it is not `ssh`."""
_OPTIONS = (
    # No person can be asked for a password while several machines are reached at once.
    "-T", "-o", "BatchMode=yes", "-o", "ConnectTimeout=10",
    # The launcher gives up a machine that is silent before ssh does.
    "-o", "ServerAliveInterval=2", "-o", "ServerAliveCountMax=7",
)  # fmt: skip
_ADVICE = (
    ("could not resolve", "check `host` in [machines.{name}], and the name in ~/.ssh/config"),
    ("host key verification failed", "run `ssh {host}` once and compare the key that it shows with the machine's own"),
    ("permission denied", "put your key there with `ssh-copy-id {host}`, or load it into your agent with `ssh-add`"),
    ("connection refused", "start the ssh server there, or write its port into ~/.ssh/config"),
    ("no route to host", "is the machine switched on, and in this network?"),
    ("network is unreachable", "is this machine in the network of the other one?"),
    ("timed out", "is the machine switched on, and does a firewall let ssh through?"),
)
"""Advice on the most common messages of OpenSSH before it gives up."""
_NO_COMMAND = 127
_SSH_FAILED = 255
_END = 3.0
"""The real time in s that ssh may take to end once it is terminated."""


def _ssh() -> list[str]:
    """The command for ssh.

    Raises:
        LaunchError: the value in the environment is no command.
    """
    typed = os.environ.get(SSH) or "ssh"
    try:
        return shlex.split(typed)
    except ValueError as error:
        raise LaunchError(f"{SSH}: expected a command such as `ssh -F file`, got {typed!r}: {error}") from error


def advice(message: str, name: str, host: str) -> str:
    """Advice for a person when ssh has failed.

    Args:
        message: the last line of ssh. name: the machine's name in the match file. host: what ssh was to connect to.
    """
    found = next((text.format(name=name, host=host) for words, text in _ADVICE if words in message.lower()), "")
    return f"{found}{'; ' if found else ''}`ssh {host} true` must work without asking anything"


class Connection(Generic[M]):
    """A command of `vrg` that runs on another machine, and the ssh that holds it.

    Args:
        name: the machine's name in the match file. machine: how it is reached. log: the file for its output.
        what: the command. frames: cuts what it sends into messages.

    Attributes:
        process: that of ssh. channel: the messages to the command and from it.

    Raises:
        LaunchError: there is no ssh; or this is Windows.
    """

    def __init__(self, name: str, machine: Machine, log: Path, what: str, frames: Frames[M]) -> None:
        if not POSIX:
            raise LaunchError("a match on Windows cannot use other machines: play it with --here")
        self._name = name
        self._machine = machine
        self._log = log
        self._log_begins = log.stat().st_size if log.exists() else 0
        command = [*_ssh(), *_OPTIONS, machine.host, "--", f"exec {machine.vrg} {what}"]
        try:
            errors = log.open("ab")
        except OSError as error:
            raise LaunchError(f"{log}: cannot be written: {error.strerror}") from error
        with errors:
            try:
                process = subprocess.Popen(
                    command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, start_new_session=True
                )
            except OSError as error:
                raise LaunchError(f"{command[0]} cannot be run: {error.strerror}: install OpenSSH's client") from error
        assert process.stdin is not None
        assert process.stdout is not None
        self.channel = Channel(os.dup(process.stdout.fileno()), os.dup(process.stdin.fileno()), frames)
        self.process = Spawned(process, process.stdin)
        process.stdin.close()
        process.stdout.close()

    @property
    def ended(self) -> bool:
        """True if ssh has ended, or the connection was closed."""
        return self.channel.closed or self.gone

    @property
    def gone(self) -> bool:
        """True if ssh has ended."""
        return self.process.poll() is not None

    def why_ended(self) -> str:
        """Why the command does not run there, in words."""
        self.process.wait(_END)
        status = self.process.poll()
        with self._log.open("rb") as log:
            log.seek(self._log_begins)
            printed = log.read() or self.channel.frames.skipped
        lines = [line for line in printed.decode(errors="replace").splitlines() if line.strip()]
        message = lines[-1] if lines else ""
        if status == _SSH_FAILED:
            given = advice(message, self._name, self._machine.host)
            return f"{message.rstrip('.: ') or 'ssh has failed'}: {given}"
        if status == _NO_COMMAND or "No such file" in message:
            return (
                f"{message}: install VRG there, or write its path into [machines.{self._name}], such as "
                '`vrg = "~/vrg/.venv/bin/vrg"`'
            )
        return f"it has ended with status {status}: {message or 'without an error message'} (log: {self._log})"

    def end(self, *, patience: float | None = None) -> None:
        """Close the connection, and let ssh end. The command then ends, too. Idempotent.

        Args:
            patience: the real time in s that ssh may take to end by itself before it is killed; None does not wait.
        """
        self.channel.close()
        if not self.gone and not patience:
            self.process.send_signal(signal.SIGTERM)
        if patience is not None and not self.process.wait(patience or _END):
            self.process.kill()
            self.process.wait(_END)
