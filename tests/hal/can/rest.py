"""The time that a robot with CAN drives takes to come to rest, by what happens to it, on simulated time."""

import math
import random
from collections.abc import Callable

from tests.hal.can.handling import armed, drive_on
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.faults import FaultKind
from vrg.testing.can.bench import NODES, DeviceBench, Drives
from vrg.types import Twist

FASTEST = Twist(0.7, 0.0)
"""The top speed of a Pioneer, at which its motors turn at 50 turn/s."""
CAUSES = (
    "emergency stop", "emergency stop, 30 % of frames lost", "strategy hangs", "strategy hangs, 30 % of frames lost",
    "a drive says nothing", "a drive hears nothing", "a drive hears and says nothing", "bus cut", "player killed",
    "player frozen",
)  # fmt: skip
_TICK, _LOOK, _STANDS, _LONGEST = 0.1, 0.005, 0.5, 1.5
"""s of a player's period; s from one look at the motors to the next; turn/s below which one stands; s of looking."""


def time_to_rest(protocol: str, cause: str, seed: int) -> float:
    """s from the cause until both motors stand, and stay so; the seed draws the instant, and frames that get lost."""
    rng = random.Random(f"{protocol} {cause} {seed}")
    with Drives(protocol) as drives, DeviceBench(protocol) as bench:
        armed(bench)
        for _ in range(20):
            drive_on(bench, FASTEST)
        assert not bench.trouble
        bench.device.drive(FASTEST)
        since = rng.uniform(0.0, _TICK)
        bench.clock.sleep(since)
        began = bench.now
        player_runs = _happen(cause, bench, drives, rng)
        moved, tick = began, began - since + _TICK
        while bench.now < began + _LONGEST:
            if player_runs and bench.now >= tick:
                drive_on(bench, FASTEST, 0.0)
                tick += _TICK
            bench.clock.sleep(_LOOK)
            if player_runs:
                bench.advance(0.0)
            if any(abs(drive.motor.velocity) > _STANDS for drive in drives.drives):
                moved = bench.now
        return moved - began


def _happen(cause: str, bench: DeviceBench, drives: Drives, rng: random.Random) -> bool:
    """Let it happen; whether the player goes on."""

    def lose(share: float) -> None:
        bench.wire.tamper = lambda frame, _: [] if rng.random() < share else [(0.0, frame)]

    def deaf(frame: Frame, now: float) -> list[Frame]:
        drives.drives[1]._advance(now)
        return []

    if "30 %" in cause:
        lose(0.3)
    acts: dict[str, Callable[[], object]] = {
        "emergency stop": lambda: (bench.estop(True), bench.advance(0.0)),
        "a drive says nothing": lambda: bench.fault(NODES[bench.driver._protocol][1][0], FaultKind.SILENCE),
        "a drive hears nothing": lambda: setattr(drives.drives[1], "receive", deaf),
        "a drive hears and says nothing": lambda: (
            drives.drives[1]._until.update({FaultKind.SILENCE: math.inf}),
            setattr(drives.drives[1], "receive", deaf),
        ),
        "bus cut": lambda: lose(1.0),
        "player killed": bench.port.stop,
        "player frozen": bench.port.freeze,
        "strategy hangs": lambda: None,
    }
    acts[cause.partition(",")[0]]()
    return not cause.startswith(("player", "strategy"))
