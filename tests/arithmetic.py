"""The arithmetic of other computers, as far as this one can show it: another processor, and another C library."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vrg.testing.requirements import missing

Environment = dict[str, str]
"""Variables with which a process computes as on another computer."""
_CPU = Path("/proc/cpuinfo")
_MUSL = Path("/usr/lib/x86_64-linux-musl/libc.a")
_AARCH64 = Path(__file__).parents[1] / "build" / "aarch64" / "python"
_FUNCTIONS = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "hypot", "pow", "cbrt"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p"),
)
_SINES = "; import math; print([math.sin(n / 1000).hex() for n in range(5000)])"
"""What a program says last. Other C libraries have other last bits of some of them."""


def without_fma() -> Environment:
    """That of an old processor: the C library and numpy use neither fused multiply-add nor wide registers.

    The test is skipped where the C library cannot be told so.
    """
    glibc, words = platform.libc_ver()[0] == "glibc", _CPU.read_text().split() if _CPU.exists() else []
    if not (glibc and platform.machine() == "x86_64" and "fma" in words):
        pytest.skip("needs glibc on an x86-64 processor with fused multiply-add, which can be told to do without it")
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]  # what numpy has been compiled for, and is here
    return {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX",
        "NPY_DISABLE_CPU_FEATURES": " ".join(found),
        "OPENBLAS_CORETYPE": "Prescott",
    }


def with_musl(folder: Path) -> Environment:
    """That of musl's C library: its mathematical functions in place of those of this computer's.

    The test is skipped where musl is not installed.

    Args:
        folder: for the library that is made of them.
    """
    compiler = shutil.which("gcc")
    if platform.machine() != "x86_64":
        pytest.skip("needs an x86-64 processor")
    if compiler is None or not _MUSL.exists():
        missing("gcc, and the library of Debian's package musl-dev")
    library = folder / "libm-of-musl.so"
    wanted = [f"-Wl,--undefined={name}" for name in _FUNCTIONS]
    subprocess.run([compiler, "-shared", "-nostdlib", "-o", library, *wanted, _MUSL], check=True)
    return {"LD_PRELOAD": str(library)}


def printed(program: str, other: Environment) -> tuple[str, str]:
    """What a program prints on this computer, and in another environment.

    Args:
        program: lines of Python.
    """
    (here, sines), (there, other_sines) = (_run(program + _SINES, environment) for environment in ({}, other))
    assert sines != other_sines, "the C library computes as before"
    return here, there


def on_aarch64(program: str) -> str:
    """What a program prints on another kind of processor, which qemu emulates.

    The test is skipped where scripts/aarch64 has not put a Python for it.
    """
    if not _AARCH64.exists():
        pytest.skip("needs a Python for aarch64: scripts/aarch64 gets one")
    said, machine = _run(f"{program}; import platform; print(platform.machine())", python=str(_AARCH64))
    assert machine == "aarch64"
    return said


def _run(program: str, environment: Environment | None = None, python: str = sys.executable) -> tuple[str, str]:
    """What a program prints, and its last line apart."""
    done = subprocess.run(
        [python, "-c", program], env=os.environ | (environment or {}), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    *said, last = done.stdout.splitlines()
    return "\n".join(said), last
