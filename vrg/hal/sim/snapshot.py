"""The snapshot from which a restarted world goes on. Noise has no state to keep: see vrg.hal.sim.sensors.base."""

from typing import Any

import msgspec
from msgspec import Struct

from vrg.errors import FileError, WorldError
from vrg.files import decoded
from vrg.hal.sim.front import Grip
from vrg.types import Count, Name, Pose

_VERSION = 7


class RobotSnapshot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The snapshot of one virtual robot.

    Args:
        pose: the pose where it is. angles: those that its axes have turned, rad.
        sensors: what its sensors must remember, by their simulation.
        energy_used: the energy drawn since its battery was full, J. v_max: its top speed in this match, m/s.
        locked: True if the emergency stop has stopped it and no command that disarms was heard since.
    """

    pose: Pose
    angles: tuple[float, ...]
    sensors: dict[str, Any]
    energy_used: float
    v_max: float
    locked: bool


class WorldSnapshot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The snapshot of a world at a tick.

    Args:
        setup: the fingerprint of the set-up that the world was made from.
        refereed: True if a referee had been heard. Nothing then moves until it is heard again.
        robots: the virtual robots by name. physical: the poses where the world showed the physical ones, by name.
        bodies: the poses of the passive bodies, by name. They are at rest then.
        held: those that robots hold, by the names of the bodies.
    """

    setup: str
    tick: Count
    epoch: Count
    estop: bool
    refereed: bool
    robots: dict[Name, RobotSnapshot]
    physical: dict[Name, Pose]
    bodies: dict[Name, Pose]
    held: dict[Name, Grip]
    version: int = _VERSION


def encode_snapshot(snapshot: WorldSnapshot) -> bytes:
    """Encode a snapshot as MessagePack."""
    return msgspec.msgpack.encode(snapshot)


def decode_snapshot(data: bytes) -> WorldSnapshot:
    """Decode a snapshot from MessagePack.

    Raises:
        WorldError: the data is damaged, or of another release of vrg.
    """
    try:
        snapshot = decoded(msgspec.msgpack.Decoder(WorldSnapshot), data)
    except FileError as error:
        raise WorldError(f"snapshot: expected a world's snapshot, got damaged bytes: {error}") from None
    if snapshot.version != _VERSION:
        raise WorldError(f"snapshot: expected version {_VERSION}, got {snapshot.version}: restart the match")
    return snapshot
