"""Prints the worst time to rest of a robot with CAN drives, protocol by cause, in simulated ms.

.venv/bin/python benchmarks/can_rest.py          # 40 instants each, two minutes
"""

import argparse
import logging
import sys
from pathlib import Path

# This folder, of which Python would take can.py for python-can, is not searched.
sys.path.pop(0)
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.hal.can.rest import CAUSES, time_to_rest
from vrg.hal.can.workshop.simulation import Simulation
from vrg.testing.can.bench import NODES, Lab


def worst(protocol: str, cause: str, lives: int) -> float:
    """The longest time of so many instants, s."""
    found = 0.0
    for seed in range(lives):
        Lab.simulation = Simulation(strict=True)
        found = max(found, time_to_rest(protocol, cause, seed))
        Lab.simulation.clock.close()
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lives", type=int, default=40)
    lives = parser.parse_args().lives
    logging.disable(logging.CRITICAL)
    print("| what happens | " + " | ".join(NODES) + " |")
    print("|---|" + "---|" * len(NODES))
    for cause in CAUSES:
        print(
            f"| {cause} | " + " | ".join(f"{1000 * worst(name, cause, lives):.0f}" for name in NODES) + " |", flush=True
        )


if __name__ == "__main__":
    main()
