"""Reads back how robots were driven: what they were commanded, what they measured of it, and where they then were."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vrg.recording.foxglove import PoseInFrame, heading_of
from vrg.recording.mcap_reading import decode, records_in
from vrg.recording.records import MotionRecord, TwistRecord
from vrg.types import Pose, Twist


@dataclass(frozen=True)
class Drive:
    """The motion of one robot, and its commands. Each entry begins with its match time, s, and they are in that order.

    Args:
        commands: the motions that it was commanded to make, after all limits.
        motions: its pose since its odometry began, and its velocity, as it measured them.
        poses: where it was on the map.
    """

    commands: list[tuple[float, Twist]] = field(default_factory=list)
    motions: list[tuple[float, Pose, Twist]] = field(default_factory=list)
    poses: list[tuple[float, Pose]] = field(default_factory=list)


def read_drives(path: Path | Sequence[Path]) -> dict[str, Drive]:
    """The robots that the fusion centre located, by name.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.

    Raises:
        OSError: a file cannot be read. MessageError: it is not a recording of this program.
    """
    drives: dict[str, Drive] = {}
    for topic, _, stamp, data in records_in(path):
        match topic.split("/"):
            case ["", "robot", name, "motion"]:
                motion = decode(data, MotionRecord, topic)
                drives.setdefault(name, Drive()).motions.append((stamp, motion.odometry, motion.twist))
            case ["", "robot", name, "command"]:
                drives.setdefault(name, Drive()).commands.append((stamp, decode(data, TwistRecord, topic).twist))
            case ["", "robot", name, "measured"]:
                pose = decode(data, PoseInFrame, topic).pose
                at = Pose(pose.position.x, pose.position.y, heading_of(pose.orientation))
                drives.setdefault(name, Drive()).poses.append((stamp, at))
    for drive in drives.values():
        for entries in (drive.commands, drive.motions, drive.poses):
            entries.sort(key=lambda entry: entry[0])
    return {name: drive for name, drive in drives.items() if drive.motions}
