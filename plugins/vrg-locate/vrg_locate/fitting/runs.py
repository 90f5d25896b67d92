"""The commands and the motion of the axes of a robot, from what was recorded of the robot."""

from collections.abc import Sequence
from itertools import accumulate, pairwise

from vrg.geometry import arc_between
from vrg.hal.models import RobotModel
from vrg.localisation.motion import driven
from vrg.types import STILL, Pose, Twist
from vrg_locate.fitting.response import AxisRun

GAP = 0.5
"""The time in s between two readings after which a new run begins."""
HELD = 0.3
"""The time in s for which a command holds. After it the robot was stopped, as while play was halted."""
SHORTEST = 1.0
"""The time in s of the shortest run that is used."""

Commands = Sequence[tuple[float, Twist]]
Motions = Sequence[tuple[float, Pose, Twist]]
Speeds = Sequence[float]


def held(commands: Commands) -> list[tuple[float, Twist]]:
    """The commands, and a stop after each that was not repeated in time."""
    found: list[tuple[float, Twist]] = []
    for n, (time, twist) in enumerate(commands):
        found.append((time, twist))
        if n + 1 == len(commands) or commands[n + 1][0] > time + HELD:
            found.append((time + HELD, STILL))
    return found


def unbroken(motions: Motions, fastest: float) -> list[Motions]:
    """The parts of what odometry measured between which it has started again, or was not heard for long.

    Args:
        fastest: the speed above which the robot cannot have driven, m/s.
    """
    parts: list[list[tuple[float, Pose, Twist]]] = [[]]
    for motion in motions:
        if parts[-1]:
            time, pose, _ = parts[-1][-1]
            dt = motion[0] - time
            if dt <= 0.0:
                continue
            if dt > GAP or driven(pose, motion[1], dt, fastest) is None:
                parts.append([])
        parts[-1].append(motion)
    return [part for part in parts if part and part[-1][0] - part[0][0] >= SHORTEST]


def asked_speeds(model: RobotModel, commands: Commands) -> list[tuple[float, Speeds]]:
    """The speeds that the axes of a robot were commanded, rad/s, each from its time on, s; see `held`."""
    return [(time, model.drivetrain.speeds(twist)) for time, twist in held(commands)]


def runs_of(model: RobotModel, asked: Sequence[tuple[float, Speeds]], part: Motions) -> list[AxisRun]:
    """The run of each axis of a robot in a part of its motion without a break.

    Args:
        asked: as from `asked_speeds`.
    """
    train, radius = model.drivetrain, model.drivetrain.wheel_radius
    times = [time for time, _, _ in part]
    ways = [train.speeds(arc_between(a, b)) for (_, a, _), (_, b, _) in pairwise(part)]
    first = train.speeds(part[0][2])
    return [
        AxisRun(
            [(time, speeds[axis] * radius) for time, speeds in asked],
            times,
            list(accumulate((way[axis] * radius for way in ways), initial=0.0)),
            first[axis] * radius,
        )
        for axis in range(len(train.axes))
    ]


def axis_runs(model: RobotModel, commands: Commands, motions: Motions) -> list[AxisRun]:
    """The runs of each axis of a robot.

    Args:
        model: with the drivetrain by which its odometry was worked out.
        commands, motions: what it was commanded and what its odometry measured, with match times, s, rising.
    """
    asked = asked_speeds(model, commands)
    return [run for part in unbroken(motions, 2.0 * model.v_max) for run in runs_of(model, asked, part)]
