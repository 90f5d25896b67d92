"""The environment variables of processes that run strangers' code. Others may hold what is not for everybody.

A sealed process must never have had them: what it has forgotten may still be in its memory.
"""

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

_SEALED: Final = ("PATH", "LANG", "LANGUAGE", "TZ", "PYTHONPATH", "PYTHONHASHSEED", "VIRTUAL_ENV", "GLIBC_TUNABLES")
_SEALED_PREFIXES: Final = ("LC_", "OMP_", "OPENBLAS_", "MKL_", "NPY_")
_STARTED: Final = ("HOME", "USER", "LOGNAME", "TMPDIR", "TERM", "COLUMNS", "NO_COLOR")
_STARTED_PREFIXES: Final = ("LD_", "PYTHON", "SDL_", "VRG_", "XDG_")
"""The names, or what they begin with, of what a sealed process keeps, and of what else it is started with."""


def kept_in_sandbox(variables: Mapping[str, str]) -> dict[str, str]:
    """Those of these variables that a sealed process keeps."""
    return {name: value for name, value in variables.items() if name in _SEALED or name.startswith(_SEALED_PREFIXES)}


def named_variables(variables: Mapping[str, str]) -> dict[str, str]:
    """Those of these variables with which a process is started that may run strangers' code."""
    started = {n: value for n, value in variables.items() if n in _STARTED or n.startswith(_STARTED_PREFIXES)}
    return started | kept_in_sandbox(variables)


def start_with_named_variables() -> None:
    """Start the program of this process once more if others started it with further variables. Linux only."""
    if sys.platform != "linux":
        return
    names = [part.partition(b"=")[0] for part in Path("/proc/self/environ").read_bytes().split(b"\0") if part]
    if len(named_variables(dict.fromkeys(map(os.fsdecode, names), ""))) < len(set(names)):
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], named_variables(os.environ))
