"""What is kept of a world so that a restarted one goes on. Noise needs nothing: see vrg.hal.sim.sensors.noise."""

from typing import Any

import msgspec
from msgspec import Struct

from vrg.errors import WorldError
from vrg.types import Count, Name, Pose

_VERSION = 3


class GhostSnapshot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One physical robot.

    Args:
        pose: where the world showed it.
    """

    name: Name
    model: Name
    pose: Pose


class RobotSnapshot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One virtual robot.

    Args:
        start: where a reset puts it. pose: where it is. wheels: angles turned, rad.
        sensors: what its sensors must remember, by their simulation.
        energy_used: J since its battery was full. v_max: its top speed in this match, m/s.
        locked: it was stopped by the emergency stop and has not been disarmed since.
    """

    name: Name
    model: Name
    start: Pose
    pose: Pose
    wheels: tuple[float, float]
    sensors: dict[str, Any]
    energy_used: float
    v_max: float
    locked: bool


class WorldSnapshot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A world at a tick.

    Args:
        setup: fingerprint of the set-up that the world was made from.
        refereed: a referee had been heard: nothing moves until it is heard again.
        robots: the virtual ones. physical: the others.
    """

    setup: str
    tick: Count
    epoch: Count
    estop: bool
    refereed: bool
    robots: list[RobotSnapshot]
    physical: list[GhostSnapshot]
    version: int = _VERSION


def encode_snapshot(snapshot: WorldSnapshot) -> bytes:
    """A snapshot as MessagePack."""
    return msgspec.msgpack.encode(snapshot)


def decode_snapshot(data: bytes) -> WorldSnapshot:
    """A snapshot from MessagePack.

    Raises:
        WorldError: it is damaged, or of another release of vrg.
    """
    try:
        snapshot = msgspec.msgpack.decode(data, type=WorldSnapshot)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise WorldError(f"snapshot: expected a world's snapshot, got damaged bytes: {error}") from None
    if snapshot.version != _VERSION:
        raise WorldError(f"snapshot: expected version {_VERSION}, got {snapshot.version}: start the match anew")
    return snapshot
