"""The messages of pursuers to one another over the radio, and their decoding.

Everything fits into one message of the radio (1024 bytes): the speaker's pose and motion, its new sightings, and from
time to time the free space that it has seen while the scene was empty. It has no more sightings than the referee may
be sent; the others are left out, because there will be newer ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from vrg.agents.perception.background import Snapshot
from vrg.bus.codec import plain
from vrg.bus.messages import Covariance, Sighting, Variance
from vrg.games.pursuit_evasion import SIGHTINGS_AT_ONCE
from vrg.types import AngularSpeed, Metres, Pose, Radians, Seconds, Speed, Twist

BEAMS = 361
"""The number of beams of a snapshot in a message."""
RANGE_STEP = 0.05
"""The step of the ranges of a snapshot in a message, m, so that 12.7 m fit into a byte."""


_Step = Annotated[float, Meta(ge=1e-3, le=7.0)]
"""An angle between beams, rad."""


class _Said(Struct, frozen=True, omit_defaults=True):
    """A message without names inside, which would make it longer, and with the bounds of its numbers."""

    pose: tuple[Metres, Metres, Radians, Speed, AngularSpeed, Speed]
    seen: list[tuple[Metres, Metres, Seconds, Variance, Covariance, Variance]]
    free: tuple[tuple[Metres, Metres, Radians, Radians, _Step], bytes] | None = None


@dataclass(frozen=True)
class Words:
    """The content of a pursuer's message.

    Args:
        pose: where it is. twist: how it moves. sightings: what it has seen. snapshot: its free space, or None.
    """

    pose: Pose
    twist: Twist
    sightings: tuple[Sighting, ...]
    snapshot: Snapshot | None


def words(pose: Pose, twist: Twist, sightings: Sequence[Sighting], snapshot: Snapshot | None) -> Any:
    """The message of a pursuer to its team: something that MessagePack can hold."""
    free = None
    if snapshot is not None:
        coarse = snapshot.coarser(BEAMS)
        steps = np.clip(np.floor(coarse.free / RANGE_STEP), 0, 255).astype(np.uint8)
        free = ((*coarse.origin, coarse.heading, coarse.angle_min, coarse.angle_step), steps.tobytes())
    seen = [(s.x, s.y, s.time, s.xx, s.xy, s.yy) for s in sightings[:SIGHTINGS_AT_ONCE]]
    payload = _Said((pose.x, pose.y, pose.theta, twist.v, twist.w, twist.side), seen, free)
    return msgspec.to_builtins(payload, builtin_types=(bytes,), enc_hook=plain)


def understood(payload: Any) -> Words | None:
    """The content of a message, or None if it is no pursuer's: a team mate may play by another program."""
    try:
        found = msgspec.convert(payload, _Said, builtin_types=(bytes,))
        seen = tuple(
            Sighting(x=x, y=y, time=time, xx=xx, xy=xy, yy=yy)
            for x, y, time, xx, xy, yy in found.seen[:SIGHTINGS_AT_ONCE]
        )
    except ValueError:  # msgspec's ValidationError is one, too
        return None
    x, y, theta, v, w, side = found.pose
    snapshot = None
    if found.free is not None:
        (a, b, heading, first, step), steps = found.free
        ranges = np.frombuffer(steps, dtype=np.uint8).astype(np.float64) * RANGE_STEP
        snapshot = Snapshot((a, b), heading, first, step, ranges)
    return Words(Pose(x, y, theta), Twist(v, w, side), seen, snapshot)
