"""The system calls that a sealed process is refused: rules as data, and the program that the kernel runs for them.

What is not named here is allowed, because the libraries of students use many harmless calls. System calls that are
newer than the list are refused as if the kernel did not have them.
"""

import errno
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.launch.sandbox import bpf
from vrg.launch.sandbox.bpf import Instruction, ProgramLine, argument, assembled
from vrg.launch.sandbox.syscalls import NEWEST, Architecture

ALLOW, ERRNO = 0x7FFF0000, 0x00050000
"""SECCOMP_RET_ALLOW and SECCOMP_RET_ERRNO."""
_AF_UNIX, _AF_INET, _AF_INET6 = 1, 2, 10
_STREAM, _KIND = 1, 0xF
_TCP = 6
_CLONE_THREAD = 0x10000
FAST_OPEN = 0x20000000
"""MSG_FASTOPEN connects where Landlock does not look."""
_OTHERS_NOTICE = (8, 10, 15, 1024)
"""F_SETOWN, F_SETSIG and F_SETOWN_EX let the kernel send a signal to another process; F_SETLEASE makes others wait."""
_SHARED_NOWHERE = 0x21
"""MAP_SHARED and MAP_ANONYMOUS: memory that RLIMIT_DATA does not count, and that the process need not have mapped."""
_GROWS = 0x100
"""MAP_GROWSDOWN: memory that RLIMIT_DATA does not count, as it is taken to be a stack."""
_DEVICE_SIGNALS = (0x8901, 0x8902, 0x5412, 0x541C)
"""FIOSETOWN and SIOCSPGRP do so, too; TIOCSTI and TIOCLINUX type into a terminal."""

REFUSED_CALLS = (
    # other processes
    "fork", "vfork", "execve", "execveat", "unshare", "setns", "ptrace", "process_vm_readv", "process_vm_writev",
    "process_madvise", "process_mrelease", "pidfd_open", "pidfd_getfd", "pidfd_send_signal", "kcmp", "tkill",
    "rt_tgsigqueueinfo",
    # a share of the machine
    "sched_setaffinity", "sched_setattr", "sched_setscheduler", "sched_setparam", "setpriority", "ioprio_set", "mbind",
    "migrate_pages", "move_pages", "set_mempolicy", "set_mempolicy_home_node",
    # the file system's shape, and what Landlock does not regulate of files
    "mount", "umount2", "pivot_root", "chroot", "move_mount", "open_tree", "fsopen", "fsconfig", "fsmount", "fspick",
    "mount_setattr", "swapon", "swapoff", "quotactl", "quotactl_fd", "name_to_handle_at", "open_by_handle_at",
    "fanotify_init", "chmod", "fchmod", "fchmodat", "chown", "fchown", "lchown", "fchownat", "utime", "utimes",
    "futimesat", "utimensat", "setxattr", "lsetxattr", "fsetxattr", "removexattr", "lremovexattr", "fremovexattr",
    "mknod", "mknodat",
    # space on the disk that no file size shows, and calls that slow or use up what all programs share
    "fallocate", "sync", "syncfs", "inotify_init", "inotify_init1",
    # the kernel
    "keyctl", "add_key", "request_key", "bpf", "perf_event_open", "userfaultfd", "io_uring_setup", "io_uring_enter",
    "io_uring_register", "io_setup", "io_submit", "vmsplice", "reboot", "kexec_load", "kexec_file_load", "init_module",
    "finit_module", "delete_module", "acct", "settimeofday", "clock_settime", "adjtimex", "clock_adjtime",
    "sethostname", "setdomainname", "syslog", "iopl", "ioperm", "personality",
    # memory that no bound counts, and that outlives the process
    "memfd_create", "memfd_secret", "shmget", "shmat", "shmctl", "semget", "semop", "semtimedop", "semctl", "msgget",
    "msgsnd", "msgrcv", "msgctl", "mq_open", "mq_unlink",
    # who is connected to
    "listen", "accept", "accept4",
)  # fmt: skip
"""The system calls that are refused altogether."""


@dataclass(frozen=True)
class ArgumentCheck:
    """A condition on an argument of a system call: its lower 32 bits, masked, are one of some values.

    Args:
        argument: the number of the argument, from 0. values: what is looked for.
        mask: the bits that count. not_in: True if it must be none of the values instead.
    """

    argument: int
    values: tuple[int, ...]
    mask: int = 0xFFFFFFFF
    not_in: bool = False


@dataclass(frozen=True)
class SyscallRule:
    """The permitted uses of a system call.

    Args:
        call: its name. unless: it is allowed if all checks of one of these hold.
        error: the error that it ends with otherwise, from `errno`.
    """

    call: str
    unless: tuple[tuple[ArgumentCheck, ...], ...] = ()
    error: int = errno.EPERM


def rules(pid: int) -> list[SyscallRule]:
    """The refused system calls of a sealed process.

    Args:
        pid: the process itself, which may send itself signals.
    """
    own = ArgumentCheck(0, (pid,))
    plain = ArgumentCheck(0, (_AF_INET, _AF_INET6)), ArgumentCheck(1, (_STREAM,), _KIND), ArgumentCheck(2, (0, _TCP))
    # A pair of connected sockets is what an event loop wakes itself with. Datagrams could be sent elsewhere over it.
    pair = (ArgumentCheck(0, (_AF_UNIX,)), ArgumentCheck(1, (_STREAM,), _KIND))
    found = [SyscallRule(name) for name in REFUSED_CALLS]
    found += [
        SyscallRule("bind", error=errno.EACCES),
        SyscallRule("clone", ((ArgumentCheck(0, (_CLONE_THREAD,), _CLONE_THREAD),),)),
        # The C library then uses `clone`, whose flags can be looked at.
        SyscallRule("clone3", error=errno.ENOSYS),
        SyscallRule("kill", ((own,),)),
        SyscallRule("tgkill", ((own,),)),
        SyscallRule("rt_sigqueueinfo", ((own,),)),
        SyscallRule("prlimit64", ((ArgumentCheck(0, (0, pid)),),)),
        SyscallRule("socket", (plain,), errno.EACCES),
        SyscallRule("socketpair", (pair,), errno.EACCES),
        SyscallRule("sendto", ((ArgumentCheck(3, (0,), FAST_OPEN),),), errno.EACCES),
        # With them an open file travels over a socket, and is nowhere to be found while it does.
        SyscallRule("sendmsg", error=errno.EACCES),
        SyscallRule("sendmmsg", error=errno.EACCES),
        SyscallRule("fcntl", ((ArgumentCheck(1, _OTHERS_NOTICE, not_in=True),),)),
        SyscallRule(
            "mmap", (tuple(ArgumentCheck(3, (flags,), flags, not_in=True) for flags in (_SHARED_NOWHERE, _GROWS)),)
        ),
        SyscallRule("ioctl", ((ArgumentCheck(1, _DEVICE_SIGNALS, not_in=True),),)),
    ]
    return found


def program(architecture: Architecture, wanted: Sequence[SyscallRule]) -> list[Instruction]:
    """The program by which the kernel keeps these rules.

    Calls of another processor's (32-bit calls on a 64-bit machine) are refused, and so are those of x32.
    """
    steps = [
        ProgramLine(bpf.LOAD, bpf.ARCHITECTURE),
        ProgramLine(bpf.EQUAL, architecture.audit, yes="known"),
        ProgramLine(bpf.RETURN, ERRNO | errno.EPERM),
        ProgramLine(label="known"),
        ProgramLine(bpf.LOAD, bpf.NUMBER),
        ProgramLine(bpf.AT_LEAST, NEWEST + 1, no="old"),
        ProgramLine(bpf.RETURN, ERRNO | errno.ENOSYS),
        ProgramLine(label="old"),
    ]
    for rule in wanted:
        number = architecture.numbers.get(rule.call)
        if number is not None:
            steps += _steps(rule, number)
    steps.append(ProgramLine(bpf.RETURN, ALLOW))
    return assembled(steps)


def _steps(rule: SyscallRule, number: int) -> list[ProgramLine]:
    after = f"{rule.call} after"
    steps = [ProgramLine(bpf.EQUAL, number, no=after)]
    for index, checks in enumerate(rule.unless):
        other = f"{rule.call} other {index}"
        for place, check in enumerate(checks):
            good = f"{rule.call} good {index} {place}"
            steps += [ProgramLine(bpf.LOAD, argument(check.argument)), ProgramLine(bpf.AND, check.mask)]
            steps += [ProgramLine(bpf.EQUAL, value, yes=other if check.not_in else good) for value in check.values]
            # A comparison that is never true and leads on either way is a jump.
            steps += [] if check.not_in else [ProgramLine(bpf.AT_LEAST, 0, yes=other)]
            steps.append(ProgramLine(label=good))
        steps += [ProgramLine(bpf.RETURN, ALLOW), ProgramLine(label=other)]
    steps += [ProgramLine(bpf.RETURN, ERRNO | rule.error), ProgramLine(label=after)]
    return steps
