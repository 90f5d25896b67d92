"""The process of an author that is a program: it gives up what the policy does not allow, and becomes the program."""

import os
import resource
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec
import psutil

from vrg.launch.sandbox import landlock
from vrg.launch.sandbox.policy import Access, Policy
from vrg.launch.sandbox.seal import FILE_SIZE, NICENESS, OPEN_FILES, drop_capabilities, filter_calls
from vrg.launch.sandbox.seccomp import ArgumentCheck, SyscallRule, rules

THREADS: Final = 256
"""The number of threads of all its programs."""
_ALLOWED: Final = frozenset(
    (
        # starting and stopping programs
        "fork", "vfork", "clone", "clone3", "execve", "execveat", "kill", "tkill", "tgkill", "rt_sigqueueinfo",
        "rt_tgsigqueueinfo", "pidfd_open", "pidfd_send_signal",
        # what they commonly do with their files and their memory
        "chmod", "fchmod", "fchmodat", "utime", "utimes", "futimesat", "utimensat", "fallocate", "inotify_init",
        "inotify_init1", "memfd_create", "mmap",
    )
)  # fmt: skip
"""The system calls that a player is refused, and programs of many processes need. Landlock holds for these, too."""
_FAST_OPEN: Final = 0x20000000
_Packed = tuple[list[tuple[str, int]], list[int], int]


def refused() -> list[SyscallRule]:
    """The system calls that an author is refused: of sockets, it has those of TCP, and pairs within it."""
    kept = [rule for rule in rules(0) if rule.call not in _ALLOWED | {"sendmsg", "sendmmsg"}]
    # They connect where Landlock does not look, as `sendto` does.
    fast = {"sendmsg": 2, "sendmmsg": 3}
    return kept + [SyscallRule(call, ((ArgumentCheck(at, (0,), _FAST_OPEN),),)) for call, at in fast.items()]


def packed(policy: Policy) -> str:
    """The files, the ports and the memory of a policy, as a text."""
    files = [(str(path), access.value) for path, access in policy.files]
    return msgspec.json.encode((files, policy.ports, policy.memory)).decode()


def main(arguments: Sequence[str]) -> int:
    """Seal this process, and run a command in its place.

    Unlike a strategy it may start programs.

    Args:
        arguments: a policy, see `packed`, and the command.
    """
    files, ports, memory = msgspec.json.decode(arguments[0], type=_Packed)
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
    drop_capabilities()
    landlock.restrict([(Path(path), Access(value)) for path, value in files], ports)
    filter_calls(refused())
    try:
        os.execvp(arguments[1], list(arguments[1:]))
    except OSError as error:
        sys.stderr.write(f"{arguments[1]}: cannot be run: {error.strerror}\n")
        return 127


def _threads_of_user() -> int:
    own = os.getuid()
    found = [process.info for process in psutil.process_iter(["uids", "num_threads"])]
    return sum(info["num_threads"] or 0 for info in found if info["uids"] and info["uids"].real == own)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
