"""Faults by seeds in simulated time: of whole matches, with their processes, links and disks, and of single robots."""

from typing import Final

from vrg.plugins import Command

FUZZ: Final = Command(
    ("fuzz",),
    "Lab",
    "Play matches with seeded failures of processes, links and disks",
    "vrg_faults.command:fuzz",
)
