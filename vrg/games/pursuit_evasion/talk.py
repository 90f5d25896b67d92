"""What pursuers say to one another over the radio, and how it is read.

Everything fits into one message of the radio (1024 bytes): the speaker's pose and motion, its new sightings, and from
time to time the free space that it has seen while the scene was empty.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vrg.agents.perception.background import Snapshot
from vrg.bus.messages import Sighting
from vrg.types import Pose, Twist

SIGHTINGS_AT_ONCE = 8
"""The number of sightings in one message; the others wait for nothing, because there will be newer ones."""
STEP = 0.05
"""The step in which ranges of a snapshot are said, m, so that 12.7 m fit into a byte."""


@dataclass(frozen=True)
class Words:
    """What a pursuer has said.

    Args:
        pose: where it is. twist: how it moves. sightings: what it has seen. snapshot: its free space, or None.
    """

    pose: Pose
    twist: Twist
    sightings: tuple[Sighting, ...]
    snapshot: Snapshot | None


def words(pose: Pose, twist: Twist, sightings: Sequence[Sighting], snapshot: Snapshot | None) -> dict[str, Any]:
    """What a pursuer says: a table that MessagePack can hold."""
    said: dict[str, Any] = {
        "pose": [pose.x, pose.y, pose.theta, twist.v, twist.w],
        "seen": [[s.x, s.y, s.time, s.xx, s.xy, s.yy] for s in sightings[:SIGHTINGS_AT_ONCE]],
    }
    if snapshot is not None:
        steps = np.clip(np.floor(snapshot.free / STEP), 0, 255).astype(np.uint8)
        where = [*snapshot.origin, snapshot.heading, snapshot.angle_min, snapshot.angle_step]
        said["free"] = [where, steps.tobytes()]
    return said


def understood(said: Any) -> Words | None:
    """What was said, or None where it is not what pursuers say: a team mate may play by another program."""
    try:
        x, y, theta, v, w = _numbers(said["pose"], 5)
        seen = tuple(_sighting(_numbers(each, 6)) for each in said["seen"][:SIGHTINGS_AT_ONCE])
        free = said.get("free")
        return Words(Pose(x, y, theta), Twist(v, w), seen, None if free is None else _snapshot(*free))
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _numbers(values: Any, count: int) -> list[float]:
    numbers = [float(value) for value in values]
    if len(numbers) != count or not all(math.isfinite(number) and abs(number) < 1e9 for number in numbers):
        raise ValueError(f"expected {count} finite numbers, got {values}")
    return numbers


def _sighting(numbers: list[float]) -> Sighting:
    x, y, time, xx, xy, yy = numbers
    if xx <= 0.0 or yy <= 0.0 or xx * yy <= xy * xy:
        raise ValueError(f"expected a covariance that is positive definite, got {numbers[3:]}")
    return Sighting(x=x, y=y, time=time, xx=xx, xy=xy, yy=yy)


def _snapshot(where: Any, steps: Any) -> Snapshot:
    x, y, heading, first, step = _numbers(where, 5)
    if step <= 0.0:
        raise ValueError(f"expected an angle between beams above 0, got {step}")
    return Snapshot((x, y), heading, first, step, np.frombuffer(steps, dtype=np.uint8).astype(np.float64) * STEP)
