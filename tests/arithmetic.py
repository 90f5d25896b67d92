"""The arithmetic of another processor, as far as this one can show it: one without fused multiply-add."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

_CPU = Path("/proc/cpuinfo")
_SINES = "; import math; print([math.sin(n / 1000).hex() for n in range(5000)])"
"""What a program says last. The C library has other last bits of some of them without fused multiply-add."""


def on_both_processors(program: str) -> tuple[str, str]:
    """What a program of one line prints as this processor computes, and as one without fused multiply-add does.

    The test is skipped where the C library cannot be told to leave that out.
    """
    glibc, words = platform.libc_ver()[0] == "glibc", _CPU.read_text().split() if _CPU.exists() else []
    if not (glibc and platform.machine() == "x86_64" and "fma" in words):
        pytest.skip("needs glibc on an x86-64 processor with fused multiply-add, which can be told to do without it")
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]  # what numpy has been compiled for, and is here
    other = {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX",
        "NPY_DISABLE_CPU_FEATURES": " ".join(found),
    }
    (here, sines), (there, other_sines) = (_printed(program, environment) for environment in ({}, other))
    assert sines != other_sines, "the C library computes as before"
    return here, there


def _printed(program: str, environment: dict[str, str]) -> tuple[str, str]:
    """What a program prints, and its sines."""
    done = subprocess.run(
        [sys.executable, "-c", program + _SINES],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *printed, sines = done.stdout.splitlines()
    return "\n".join(printed), sines
