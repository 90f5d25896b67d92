"""The process of an author that is a program: it gives up what the policy does not allow, and runs the program.

It stays as the program's parent, to end all that the program has started: its signals reach these alone. The program
is sealed within, so that its own do not reach its parent.
"""

import contextlib
import ctypes
import errno
import os
import resource
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NoReturn

import msgspec
import psutil

from vrg.launch.sandbox import landlock
from vrg.launch.sandbox.policy import Access, SealPolicy
from vrg.launch.sandbox.seal import drop_capabilities, filter_calls, lower_limits, missing, step_back
from vrg.launch.sandbox.seccomp import FAST_OPEN, ArgumentCheck, SyscallRule, rules

THREADS: Final = 256
"""The number of threads of all programs of an author."""
_PROCESS_CALLS: Final = frozenset(
    ("fork", "vfork", "clone", "execve", "execveat", "kill", "tkill", "tgkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo")
)
"""The system calls by which programs start and stop others. Landlock keeps their signals within what is sealed."""
_ATTRIBUTE_CALLS: Final = frozenset(
    ("chmod", "fchmod", "fchmodat", "utime", "utimes", "futimesat", "utimensat")
)  # fmt: skip
"""Those that change the mode and the times of files. Landlock does not regulate them."""
_NAMESPACES: Final = 0x7E020080
"""All CLONE_NEW* of clone(2): in a namespace of its own a program has capabilities again."""
_PARENT_DEATH_SIGNAL, _SUBREAPER = 1, 36
"""PR_SET_PDEATHSIG and PR_SET_CHILD_SUBREAPER of prctl(2)."""
_SIGNALS: Final = frozenset((signal.SIGTERM, signal.SIGCHLD))
_Packed = tuple[list[tuple[str, int]], list[int], int]


def lacking() -> str | None:
    """The lack of this machine that keeps it from sealing an author, in a sentence; None if it can."""
    if (why := missing()) is not None:
        return why
    if (abi := landlock.abi()) < landlock.SCOPE_ABI:
        return f"this needs Landlock with ABI {landlock.SCOPE_ABI} (Linux 6.12 or later), and here it has ABI {abi}"
    return None


def refused() -> list[SyscallRule]:
    """The system calls that an author is refused: of sockets, it has those of TCP, and pairs within it."""
    others = _PROCESS_CALLS | _ATTRIBUTE_CALLS | {"sendmsg", "sendmmsg"}
    return [
        *(rule for rule in rules(0) if rule.call not in others),
        SyscallRule("clone", ((ArgumentCheck(0, (0,), _NAMESPACES),),)),
        # They connect where Landlock does not look, as `sendto` does.
        SyscallRule("sendmsg", ((ArgumentCheck(2, (0,), FAST_OPEN),),), errno.EACCES),
        SyscallRule("sendmmsg", ((ArgumentCheck(3, (0,), FAST_OPEN),),), errno.EACCES),
        # They do nothing, and no error says so: programs that copy and unpack files go on.
        *(SyscallRule(call, error=0) for call in sorted(_ATTRIBUTE_CALLS)),
    ]


def packed(policy: SealPolicy) -> str:
    """The files, the ports and the memory of a policy, as a text."""
    files = [(str(path), access.value) for path, access in policy.files]
    return msgspec.json.encode((files, policy.ports, policy.memory)).decode()


def main(arguments: Sequence[str]) -> int:
    """Run a command that is sealed, and end what it has left behind.

    Unlike a strategy it may start programs. SIGTERM, or the end of this process' parent, ends them all.

    Args:
        arguments: the number of the parent's process, a policy, see `packed`, and the command.

    Returns:
        the status of the command; 128 and the signal that has ended it, as shells have it.
    """
    if (why := lacking()) is not None:
        sys.exit(why)
    # They wait until they are looked for: none is lost, and none ends anything before the signals are kept within.
    signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    library = ctypes.CDLL(None)
    library.prctl(_PARENT_DEATH_SIGNAL, signal.SIGTERM, 0, 0, 0)
    if os.getppid() != int(arguments[0]):
        return 1
    library.prctl(_SUBREAPER, 1, 0, 0, 0)
    files, ports, memory = msgspec.json.decode(arguments[1], type=_Packed)
    threads = _threads_of_user() + THREADS
    drop_capabilities()
    landlock.keep_signals_within()
    child = os.fork()
    if child == 0:
        # The kernel counts the threads of the user, and lets root have any number.
        lower_limits(memory, {resource.RLIMIT_NPROC: threads})
        step_back()
        landlock.restrict([(Path(path), Access(value)) for path, value in files], ports)
        filter_calls(refused())
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        _become(arguments[2:])
    try:
        return _status_of(child)
    finally:
        _end_all()


def _status_of(child: int) -> int:
    """The status of a child, when it and all that it has started have ended. SIGTERM ends them."""
    status = 0
    while True:
        if signal.sigwait(_SIGNALS) == signal.SIGTERM:
            _end_all()
        try:
            while (ended := os.waitpid(-1, os.WNOHANG))[0]:
                if ended[0] == child:
                    code = os.waitstatus_to_exitcode(ended[1])
                    status = code if code >= 0 else 128 - code
                    _end_all()
        except ChildProcessError:
            return status


def _end_all() -> None:
    """End all that this process has started; the kernel lets nobody of it start another one meanwhile."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(-1, signal.SIGKILL)


def _become(command: Sequence[str]) -> NoReturn:
    try:
        os.execvp(command[0], list(command))
    except OSError as error:
        sys.stderr.write(f"{command[0]}: cannot be run: {error.strerror}\n")
        sys.stderr.flush()
    os._exit(127)


def _threads_of_user() -> int:
    own = os.getuid()
    found = [process.info for process in psutil.process_iter(["uids", "num_threads"])]
    return sum(info["num_threads"] or 0 for info in found if info["uids"] and info["uids"].real == own)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
