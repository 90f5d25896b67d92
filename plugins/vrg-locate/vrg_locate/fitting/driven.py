"""How a robot was driven in a recorded match, and how it moved."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrg.recording.recorded import RecordedMatch
from vrg.types import Pose, Twist


@dataclass(frozen=True)
class Drive:
    """The motion of one robot, and its commands. Each entry begins with its match time, s, and they are in that order.

    Args:
        commands: the motions that it was commanded to make, after all limits.
        motions: its pose since its odometry began, and its velocity, as it measured them.
        poses: where it was on the map.
    """

    commands: Sequence[tuple[float, Twist]] = ()
    motions: Sequence[tuple[float, Pose, Twist]] = ()
    poses: Sequence[tuple[float, Pose]] = ()


def drives_of(recorded: RecordedMatch) -> dict[str, Drive]:
    """How the robots were driven that the fusion centre located, by name."""
    return {
        name: Drive(
            recorded.commands.get(name, ()),
            [(stamp, motion.odometry, motion.twist) for stamp, motion in motions],
            [(stamp, measured.pose) for stamp, measured in recorded.measured.get(name, ())],
        )
        for name, motions in recorded.motions.items()
    }
