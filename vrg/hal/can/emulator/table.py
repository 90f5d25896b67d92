"""Emulated drives by the name of their protocol, imported when they are asked for."""

import importlib
import random

from vrg.hal.can.emulator.drive import DriveOptions, EmulatedDrive

DRIVES = {
    "odrive": "vrg.hal.can.emulator.odrive_drive:OdriveDrive",
    "cia402": "vrg.hal.can.emulator.cia402_drive:Cia402Drive",
}


def emulated_drive(protocol: str, node: int, options: DriveOptions, now: float, rng: random.Random) -> EmulatedDrive:
    """A drive that speaks a protocol in DRIVES; the rest as for `EmulatedDrive`."""
    module, _, name = DRIVES[protocol].partition(":")
    kind: type[EmulatedDrive] = getattr(importlib.import_module(module), name)
    return kind(node, options, now, rng)
