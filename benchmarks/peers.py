"""Whole matches of VRG beside other simulators of several robots, in turns: times real time, by processor time.

The others only simulate: they have no referee, no journal, no evidence, and robots that follow one rule. Install them
in a Python of their own, and name it:

    python -m venv ../peers && ../peers/bin/pip install ir-sim mpe2
    python benchmarks/peers.py --python ../peers/bin/python
"""

import logging
import subprocess
from pathlib import Path
from typing import Any

from common import arguments, median, show
from peer_steps import PEERS
from speed import Case, play

HERE = Path(__file__).parent
CASES = {
    "VRG, planar": Case("planar", 8, lasers=False),
    "VRG, planar, lasers": Case("planar", 8, lasers=True),
    "VRG, mujoco, lasers": Case("mujoco", 8, lasers=True),
}


def main() -> None:
    """Run all in turns, and print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--python", required=True, help="the interpreter in which the others are installed")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    logging.disable(logging.WARNING)
    found: dict[str, list[float]] = {name: [] for name in (*CASES, *PEERS)}
    missing = set()
    for seed in range(1 if options.quick else options.rounds):
        for name, case in CASES.items():
            seconds, cost = play(case, 2.0 if options.quick else 30.0, seed)
            found[name].append(seconds / cost.cpu)
        for name in PEERS:
            command = [options.python, str(HERE / "peer_steps.py"), name]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode == 0:
                found[name].append(float(done.stdout.split()[-1]))
            else:
                missing.add(f"{name}: {done.stderr.strip().splitlines()[-1]}")
    own = median(found["VRG, planar"])
    rows: list[dict[str, Any]] = [
        {"eight robots": name, "x real time": median(speeds), "of VRG, planar": median(speeds) / own}
        for name, speeds in found.items()
        if speeds
    ]
    show("Beside other simulators", rows, sorted(missing), as_json=options.json)


if __name__ == "__main__":
    main()
