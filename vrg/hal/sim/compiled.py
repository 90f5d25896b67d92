"""The compiled kernel of the simulation; `kernel` is None where it was not compiled when VRG was installed.

It computes the inner loops of engines and sensors with the same bits as the Python code beside each call, which is what
runs without it (setup.py builds it from vrg/hal/sim/kernel/).
"""

try:
    from vrg.hal.sim import _kernel as kernel
except ImportError:
    kernel = None  # type: ignore[assignment]

__all__ = ["kernel"]
