"""Landlock, by which a process gives up what it may reach of the file system and the network, for good.

See the kernel's Documentation/userspace-api/landlock.rst. The numbers of its system calls are the same on every
processor. What holds for a thread holds for those that it starts later, and not for those that run already.
"""

import ctypes
import os
import struct
from collections.abc import Iterable
from pathlib import Path

from vrg.launch.sandbox.policy import Access

_CREATE, _ADD, _RESTRICT = 444, 445, 446
_VERSION = 1
"""LANDLOCK_CREATE_RULESET_VERSION."""
_BENEATH, _PORT = 1, 2
"""LANDLOCK_RULE_PATH_BENEATH and LANDLOCK_RULE_NET_PORT."""
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_TRUNCATE, _IOCTL_DEVICE = 1 << 14, 1 << 15
_OLD_RIGHTS = (1 << 14) - 1
"""All rights that a kernel of ABI 2 or later knows: those above, removing, making of each kind, and moving."""
_MAKE_SPECIAL = (1 << 6) | (1 << 9) | (1 << 10) | (1 << 11)
"""Devices, sockets and named pipes, which no player needs to make."""
_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL_DEVICE
_BIND, _CONNECT = 1, 2
_ABSTRACT_SOCKETS, _SIGNALS = 1, 2
NETWORK_ABI = 4
"""The version of Landlock that regulates TCP, of Linux 6.7."""
SCOPE_ABI = 6
"""The version that keeps signals within what is sealed, of Linux 6.12."""
_DEVICE_ABI = 5


def abi() -> int:
    """The version of Landlock that this kernel has; 0 if it has none, or has it switched off."""
    try:
        return syscall(_CREATE, None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION))
    except OSError:
        return 0


def restrict(files: Iterable[tuple[Path, Access]], ports: Iterable[int]) -> None:
    """Give up everything but some files and TCP ports, in this thread and those that it starts.

    Args:
        files: files and folders with all that is in them, and what may be done there. Missing ones are left out.
        ports: the TCP ports that may be connected to.

    Raises:
        OSError: the kernel refuses.
    """
    version = abi()
    every = _OLD_RIGHTS | _TRUNCATE | (_IOCTL_DEVICE if version >= _DEVICE_ABI else 0)
    scoped = _ABSTRACT_SOCKETS | _SIGNALS if version >= SCOPE_ABI else 0
    attributes = struct.pack("=QQQ", every, _BIND | _CONNECT, scoped)
    # An older kernel does not know the last field.
    attributes = attributes if version >= SCOPE_ABI else attributes[:16]
    ruleset = syscall(_CREATE, attributes, ctypes.c_size_t(len(attributes)), ctypes.c_uint32(0))
    try:
        for path, access in files:
            _allow(ruleset, path, _rights(access) & every)
        for port in ports:
            rule = struct.pack("=QQ", _CONNECT, port)
            syscall(_ADD, ctypes.c_int(ruleset), ctypes.c_int(_PORT), rule, ctypes.c_uint32(0))
        syscall(_RESTRICT, ctypes.c_int(ruleset), ctypes.c_uint32(0))
    finally:
        os.close(ruleset)


def keep_signals_within() -> None:
    """Let this thread, and those that it starts, send signals to nobody but each other. It needs SCOPE_ABI.

    Raises:
        OSError: the kernel refuses.
    """
    attributes = struct.pack("=QQQ", 0, 0, _SIGNALS)
    ruleset = syscall(_CREATE, attributes, ctypes.c_size_t(len(attributes)), ctypes.c_uint32(0))
    syscall(_RESTRICT, ctypes.c_int(ruleset), ctypes.c_uint32(0))
    os.close(ruleset)


def _rights(access: Access) -> int:
    rights = 0
    if Access.LIST in access:
        rights |= _READ_DIR
    if Access.READ in access:
        rights |= _READ_FILE | _READ_DIR | _EXECUTE
    if Access.WRITE in access:
        rights |= _WRITE_FILE | _TRUNCATE
    if Access.MAKE in access:
        rights |= _OLD_RIGHTS & ~_MAKE_SPECIAL & ~_EXECUTE
    return rights


def _allow(ruleset: int, path: Path, rights: int) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return  # what is not there, or cannot be reached, needs no permission
    try:
        if not os.path.isdir(path):
            rights &= _OF_FILES
        if rights:
            rule = struct.pack("=Qi", rights, place)
            syscall(_ADD, ctypes.c_int(ruleset), ctypes.c_int(_BENEATH), rule, ctypes.c_uint32(0))
    finally:
        os.close(place)


def syscall(number: int, *arguments: object) -> int:
    """Call the kernel, and return what it answers.

    Raises:
        OSError: it refuses.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.syscall.restype = ctypes.c_long
    result: int = library.syscall(ctypes.c_long(number), *arguments)
    if result < 0:
        error = ctypes.get_errno()
        raise OSError(error, os.strerror(error))
    return result
