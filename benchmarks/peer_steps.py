"""Steps a simulator that is not VRG, and prints how many times faster than real time it is by processor time.

`peers.py` runs it with a Python in which the simulator is installed; it needs nothing of VRG. The worlds have eight
robots of the size and the speed of a Pioneer, without referee, journal or strategies.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

STEP = 0.1
"""The simulated time of a step of all of them, s."""
STEPS = 300
LIDAR = """
    sensors:
      - {name: lidar2d, range_min: 0, range_max: 8, angle_range: 3.1416, number: 181, noise: false}
"""
FIELD = """
world: {height: 40, width: 40, step_time: 0.1, sample_time: 0.1, collision_mode: stop}
robot:
  - number: 8
    distribution: {name: circle, radius: 15.0, center: [20, 20]}
    kinematics: {name: diff}
    shape: {name: circle, radius: 0.35}
    behavior: {name: dash}
    vel_max: [0.7, 2.0]
    vel_min: [-0.7, -2.0]
"""


def ir_sim(*, lidar: bool) -> Callable[[], object]:
    """IR-SIM: robots that drive across a circle, with 181 beams each or without."""
    os.environ["MPLBACKEND"] = "Agg"
    import irsim  # noqa: PLC0415 - another Python has it

    with tempfile.TemporaryDirectory() as name:
        place = Path(name) / "field.yaml"
        place.write_text(FIELD + (LIDAR if lidar else ""), encoding="utf-8")
        step: Callable[[], object] = irsim.make(str(place), display=False, log_level="ERROR").step
    return step


def mpe2() -> Callable[[], object]:
    """MPE2's simple_tag: four chase four, as discs that are pushed."""
    from mpe2 import simple_tag_v3  # noqa: PLC0415 - another Python has it

    world = simple_tag_v3.parallel_env(num_good=4, num_adversaries=4, num_obstacles=2, max_cycles=1_000_000)
    world.reset(seed=0)
    actions = {agent: world.action_space(agent).sample() for agent in world.agents}
    return lambda: world.step(actions)


PEERS: dict[str, Callable[[], Callable[[], object]]] = {
    "IR-SIM": lambda: ir_sim(lidar=False),
    "IR-SIM, lidar": lambda: ir_sim(lidar=True),
    "MPE2, simple_tag": mpe2,
}


def main() -> None:
    """Step one of them."""
    step = PEERS[sys.argv[1]]()
    for _ in range(STEPS // 10):
        step()
    began = time.process_time()
    for _ in range(STEPS):
        step()
    print(f"{STEPS * STEP / (time.process_time() - began):.3f}")


if __name__ == "__main__":
    main()
