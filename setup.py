"""Adds the compiled kernel to what pyproject.toml says. Where nothing can compile it, VRG is installed without it.

VRG_PURE=1 leaves it out, for a wheel that fits every computer.
"""

import os
import sys
from glob import glob

from setuptools import Extension, setup

EXACT = ["-O2", "-std=c11", "-fvisibility=hidden", "-ffp-contract=off", "-fno-tree-slp-vectorize"]
"""How it is compiled: no function may be replaced by one of the same name in another library, and no product and sum
may be rounded as one, which GCC's vectoriser does all the same. Microsoft's compiler was not tried."""
FOLDER = "vrg/hal/sim/kernel"

kernel = Extension(
    "vrg.hal.sim._kernel",
    sources=sorted(glob(f"{FOLDER}/*.c")),
    depends=["setup.py", f"{FOLDER}/kernel.h"],
    extra_compile_args=EXACT,
    libraries=["m"],
    py_limited_api=True,
    optional=True,
)
if __name__ == "__main__":
    setup(
        ext_modules=[] if sys.platform == "win32" or os.environ.get("VRG_PURE") else [kernel],
        options={"bdist_wheel": {"py_limited_api": "cp311"}},  # one wheel for all Pythons from 3.11 on
    )
