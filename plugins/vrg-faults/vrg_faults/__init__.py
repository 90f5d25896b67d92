"""Faults by seeds in simulated time: of whole matches, with their processes, links and disks, and of single robots."""

from typing import Final

from vrg.plugins import Command

FUZZ: Final = Command(
    ("fuzz",),
    "Lab",
    "Play matches in which processes, links and disks fail, by seeds",
    "vrg_faults.command:fuzz",
)
