"""Adds the compiled kernel to what pyproject.toml says. Where nothing can compile it, VRG is installed without it.

VRG_PURE=1 leaves it out, for a wheel that fits every computer.
"""

import os
import sys
from glob import glob

from setuptools import Extension, setup

EXACT = [] if sys.platform == "win32" else ["-O2", "-std=c11", "-fvisibility=hidden", "-ffp-contract=off"]
"""How it is compiled: no product and sum may be rounded as one. Microsoft's compiler does not do that unasked."""
FOLDER = "vrg/hal/sim/kernel"

kernel = Extension(
    "vrg.hal.sim._kernel",
    sources=sorted(glob(f"{FOLDER}/*.c")),
    depends=["setup.py", f"{FOLDER}/kernel.h"],
    extra_compile_args=EXACT,
    libraries=[] if sys.platform == "win32" else ["m"],
    py_limited_api=True,
    optional=True,
)
setup(
    ext_modules=[] if os.environ.get("VRG_PURE") else [kernel],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # one wheel for all Pythons from 3.11 on
)
