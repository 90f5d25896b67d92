"""The process of an author that is a program: it gives up what the policy does not allow, and runs the program.

It stays as the program's parent, to end all that the program has started: its signals reach what is sealed within it,
and nothing else.
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
from typing import Final

import msgspec
import psutil

from vrg.launch.sandbox import landlock
from vrg.launch.sandbox.policy import Access, Policy
from vrg.launch.sandbox.seal import FILE_SIZE, NICENESS, OPEN_FILES, drop_capabilities, filter_calls, missing
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


def packed(policy: Policy) -> str:
    """The files, the ports and the memory of a policy, as a text."""
    files = [(str(path), access.value) for path, access in policy.files]
    return msgspec.json.encode((files, policy.ports, policy.memory)).decode()


def main(arguments: Sequence[str]) -> int:
    """Seal this process, run a command in it, and end what it has left behind.

    Unlike a strategy it may start programs. SIGTERM, or the end of this process' parent, ends them all.

    Args:
        arguments: a policy, see `packed`, and the command.

    Returns:
        the status of the command; 128 and the signal that has ended it, as shells have it.
    """
    if (why := lacking()) is not None:
        sys.exit(why)
    library = ctypes.CDLL(None)
    library.prctl(_PARENT_DEATH_SIGNAL, signal.SIGTERM, 0, 0, 0)
    library.prctl(_SUBREAPER, 1, 0, 0, 0)
    files, ports, memory = msgspec.json.decode(arguments[0], type=_Packed)
    allowed = [(Path(path), Access(value)) for path, value in files]
    _bound(memory)
    drop_capabilities()
    landlock.restrict(allowed, ports)
    signal.signal(signal.SIGTERM, lambda *_: _end_all())  # only now: before, it would end all programs of the user
    filter_calls(refused())
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        landlock.restrict(allowed, ports)  # so that it cannot end its parent
        _become(arguments[1:])
    status = 0
    while True:
        try:
            ended, how = os.wait()
        except ChildProcessError:
            return status
        if ended == child:
            code = os.waitstatus_to_exitcode(how)
            status = code if code >= 0 else 128 - code
            _end_all()


def _end_all() -> None:
    """End all that is sealed within this process; the kernel lets nobody of it start another one meanwhile."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(-1, signal.SIGKILL)


def _become(command: Sequence[str]) -> None:
    try:
        os.execvp(command[0], list(command))
    except OSError as error:
        sys.stderr.write(f"{command[0]}: cannot be run: {error.strerror}\n")
        sys.stderr.flush()
        os._exit(127)


def _bound(memory: int) -> None:
    """Bound the resources; `memory` is that of each program, MB."""
    limits = {
        resource.RLIMIT_DATA: memory * 1_000_000, resource.RLIMIT_FSIZE: FILE_SIZE,
        resource.RLIMIT_NOFILE: OPEN_FILES, resource.RLIMIT_CORE: 0,
        # The kernel counts those of the user, and lets root have any number.
        resource.RLIMIT_NPROC: _threads_of_user() + THREADS,
    }  # fmt: skip
    for limit, value in limits.items():
        most = resource.getrlimit(limit)[1]
        lower = value if most == resource.RLIM_INFINITY else min(value, most)
        resource.setrlimit(limit, (lower, lower))
    os.nice(NICENESS)


def _threads_of_user() -> int:
    own = os.getuid()
    found = [process.info for process in psutil.process_iter(["uids", "num_threads"])]
    return sum(info["num_threads"] or 0 for info in found if info["uids"] and info["uids"].real == own)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
