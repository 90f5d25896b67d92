"""The protocols that drives may speak, by the name that people write, imported when they are asked for."""

import importlib

from vrg.hal.can.axis import Axis

PROTOCOLS = {
    "odrive": "vrg.hal.can.odrive_axis:OdriveAxis",
    "cia402": "vrg.hal.can.cia402_axis:Cia402Axis",
}


def axis_type(protocol: str) -> type[Axis]:
    """The class of an axis by a protocol in PROTOCOLS."""
    module, _, name = PROTOCOLS[protocol].partition(":")
    found: type[Axis] = getattr(importlib.import_module(module), name)
    return found
