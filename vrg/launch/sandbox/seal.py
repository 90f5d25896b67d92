"""Seals this process: from then on it can do only what its policy allows, whatever code runs in it.

It must have one thread when it is sealed, because Landlock holds for the thread that asks for it and those that it
starts, and code in an unsealed thread of the same process could be made to work for a sealed one.
"""

import ctypes
import os
import platform
import struct
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from vrg.errors import SandboxError
from vrg.launch.sandbox import landlock
from vrg.launch.sandbox.bpf import program_bytes
from vrg.launch.sandbox.policy import SealPolicy
from vrg.launch.sandbox.seccomp import SyscallRule, program, rules
from vrg.launch.sandbox.syscalls import ARCHITECTURES
from vrg.launch.sandbox.variables import kept_in_sandbox
from vrg.system import POSIX

if POSIX:
    import resource

REFUSAL_ADVICE = "the sandbox refused it: see FILES and what a sandbox allows in docs/players.md"
"""The advice after each failure of sealed code at something that it may not do."""
FILE_SIZE = 50_000_000
"""The longest file that a sealed process may write, bytes."""
OPEN_FILES = 256
"""The number of files and sockets that it may have open."""
NICENESS = 5
"""The niceness of a sealed process, which comes behind the processes of the match itself on a busy machine."""
OWN_MEMORY = 500
"""The memory that VRG may use besides what the strategy may, MB."""
STACK = 64_000_000
"""The longest stack, bytes: no other bound counts it."""
_NO_NEW_PRIVILEGES, _AMBIENT, _AMBIENT_CLEAR, _DROP_BOUND = 38, 47, 4, 24
"""PR_SET_NO_NEW_PRIVS, PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL and PR_CAPBSET_DROP."""
_CAPABILITY_VERSION = 0x20080522
_SET_FILTER, _ALL_THREADS = 1, 1
"""SECCOMP_SET_MODE_FILTER and SECCOMP_FILTER_FLAG_TSYNC."""
_WHAT_TO_DO = "`sandbox = false` in the match file, or `vrg play --no-sandbox`, plays without a sandbox"


def missing() -> str | None:
    """The lack of this machine that keeps it from sealing a process, in a sentence; None if it can."""
    if sys.platform != "linux":
        return f"a sandbox needs Linux, and this is {sys.platform}"
    if platform.machine() not in ARCHITECTURES or sys.byteorder != "little" or sys.maxsize < 1 << 32:
        known = " or ".join(ARCHITECTURES)
        return f"a sandbox needs a processor {known}, and this is {platform.machine()}"
    abi = landlock.abi()
    if abi < landlock.NETWORK_ABI:
        found = "Landlock is not there, or switched off (see /sys/kernel/security/lsm)" if not abi else f"ABI {abi}"
        return (
            f"a sandbox needs Landlock with ABI {landlock.NETWORK_ABI} (Linux 6.7 or later), and Linux "
            f"{platform.release()} has less: {found}"
        )
    return None


def check_able() -> None:
    """Check that this machine can seal a process.

    Raises:
        SandboxError: it cannot.
    """
    if (lacking := missing()) is not None:
        raise SandboxError(f"{lacking}: {_WHAT_TO_DO}")


def seal(policy: SealPolicy) -> None:
    """Seal this process. The folder of the policy is made if it is missing.

    Raises:
        SandboxError: the machine cannot do it, or the process has more than one thread.
    """
    check_able()
    threads = len(os.listdir("/proc/self/task"))
    if threads != 1:
        raise SandboxError(f"a process must be sandboxed before it starts threads, and this one has {threads}")
    try:
        _forget_environment()
        _use_folder(policy.folder)
        _bound(policy)
        drop_capabilities()
        landlock.restrict(policy.files, policy.ports)
        filter_calls(rules(os.getpid()))
    except OSError as error:
        raise SandboxError(f"this process cannot be sandboxed: {error}: {_WHAT_TO_DO}") from error


def _forget_environment() -> None:
    """Forget the environment variables but for a few: see `variables`."""
    kept = kept_in_sandbox(os.environ)
    os.environ.clear()
    # The environment at its start would stay in its memory: proc(5), /proc/pid/stat, fields 50 and 51.
    fields = Path("/proc/self/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    begin, end = int(fields[47]), int(fields[48])
    if 0 < begin < end:
        ctypes.memset(begin, 0, end - begin)
    os.environ.update(kept)


def _use_folder(folder: Path) -> None:
    """Let libraries put temporary files and caches into the folder that may be written."""
    folder.mkdir(parents=True, exist_ok=True)
    own = str(folder)
    names = ("HOME", "TMPDIR", "XDG_CACHE_HOME", "MPLCONFIGDIR", "NUMBA_CACHE_DIR", "VRG_PLAYER_FOLDER")
    os.environ.update(dict.fromkeys(names, own))
    if "tempfile" in sys.modules:
        # It remembers the folder that it has found before.
        import tempfile  # noqa: PLC0415 - it is loaded already

        tempfile.tempdir = own
    # Compiled code could not be kept beside its source.
    sys.dont_write_bytecode = True


def _bound(policy: SealPolicy) -> None:
    """Bound its resources. These bounds cannot be raised again: capabilities are dropped afterwards."""
    lower_limits(policy.memory + OWN_MEMORY, {resource.RLIMIT_STACK: STACK})
    if policy.core is not None:
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[policy.core % len(cores)]})
        step_back()


def lower_limits(memory: int, others: Mapping[int, int]) -> None:
    """Lower the limits of this process' resources. None is raised that is lower already.

    Args:
        memory: of the process, MB. others: further limits, by their numbers in `resource`.
    """
    limits = {
        resource.RLIMIT_DATA: memory * 1_000_000, resource.RLIMIT_FSIZE: FILE_SIZE,
        resource.RLIMIT_NOFILE: OPEN_FILES, resource.RLIMIT_CORE: 0, **others,
    }  # fmt: skip
    for limit, value in limits.items():
        own = resource.getrlimit(limit)[1]
        lower = value if own == resource.RLIM_INFINITY else min(value, own)
        resource.setrlimit(limit, (lower, lower))


def step_back() -> None:
    """Leave the processor to the others when it is scarce."""
    os.nice(NICENESS)
    try:
        # Where sessions share the processor, niceness counts only within one, and each process has one of its own.
        Path("/proc/self/autogroup").write_text(str(NICENESS))
    except OSError:
        return  # this kernel has no such groups


def drop_capabilities() -> None:
    """Give up every capability, so that root's process is like anybody's; and that of getting any."""
    library = ctypes.CDLL(None, use_errno=True)
    unsigned = ctypes.c_ulong

    def prctl(option: int, *arguments: int) -> bool:
        padded = [*arguments, *[0] * (4 - len(arguments))]
        return bool(library.prctl(ctypes.c_int(option), *map(unsigned, padded)) == 0)

    number = 0
    # It ends at the first capability that this kernel does not have, or at once for a process that has none to drop.
    while prctl(_DROP_BOUND, number):
        number += 1
    prctl(_AMBIENT, _AMBIENT_CLEAR)
    header = struct.pack("=Ii", _CAPABILITY_VERSION, 0)
    if library.capset(header, bytes(24)) != 0 or not prctl(_NO_NEW_PRIVILEGES, 1):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


class _Program(ctypes.Structure):
    """The kernel's `struct sock_fprog`."""

    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_char_p))


def filter_calls(refused: Sequence[SyscallRule]) -> None:
    """Let the kernel filter the system calls of this process, and of the programs that it starts, for good."""
    architecture = ARCHITECTURES[platform.machine()]
    instructions = program(architecture, refused)
    wanted = ctypes.byref(_Program(len(instructions), program_bytes(instructions)))
    number, operation, flags = architecture.seccomp, ctypes.c_uint(_SET_FILTER), ctypes.c_uint(_ALL_THREADS)
    if thread := landlock.syscall(number, operation, flags, wanted):
        raise OSError(f"its thread {thread} cannot be sealed")
