"""The errors of the odometry of a robot, for the estimator of its pose."""

import math
from dataclasses import dataclass

from vrg.geometry import compose, inverse
from vrg.hal.models import RobotModel
from vrg.hal.sensors.odometry import OdometrySpec
from vrg.portable.scalars import cos_sin, square, total
from vrg.types import Pose

SLIP_TIME = 0.02
"""The time in s within which slip stays the same: a tick of the world, for which `OdometrySpec.slip_noise` is given."""


@dataclass(frozen=True, kw_only=True)
class MotionNoise:
    """Standard deviations of what odometry errs by.

    Args:
        along, aside: of the way ahead and of that to the left, as a share of a way, by the slip within SLIP_TIME.
        turn: of the turn by the slip on such a way, rad/m. spin: of a turn by the slip within SLIP_TIME, as a share.
        longer, wider: of the shares by which all ways and all turns of this robot are longer than measured.
        bend: of the turn of this robot on a metre straight ahead, rad/m.
        fastest: no deviation, but the speed above which the robot cannot have driven, m/s: its odometry has begun anew.
        rest: of x and of y after a second, whatever the wheels do, because a robot may be pushed, m.
        rest_turn: the same of the heading, rad.
    """

    along: float
    aside: float
    turn: float
    spin: float
    longer: float
    wider: float
    bend: float
    fastest: float
    rest: float = 0.001
    rest_turn: float = 0.001


PHYSICAL_SCALE = 0.05
"""The standard deviation of the share by which the wheels of an axis of a physical robot are larger than believed: its
ratio is that of a data sheet, and its tyres are soft."""


def motion_noise(model: RobotModel, *, physical: bool = False) -> MotionNoise:
    """The noise of a robot's odometry, by the numbers of its spec and the geometry of its drivetrain.

    Each axis has an error of its own. What that does to the body is the root of the sum of the squares.

    Args:
        physical: True for a robot whose wheels are not as the simulation has them.
    """
    spec = model.sensor(OdometrySpec) or OdometrySpec()
    ahead, turning, aside = model.drivetrain.motions
    rates = model.drivetrain.rates

    def spread(shares: tuple[float, ...], unit: int) -> float:
        """The part that an error of 1 of each axis is of the body's motion, for a unit of the twist."""
        return math.sqrt(total(square(share * rate[unit]) for share, rate in zip(shares, rates, strict=True)))

    scale = PHYSICAL_SCALE if physical else spec.scale_noise
    return MotionNoise(
        along=spec.slip_noise * spread(ahead, 0),
        aside=spec.slip_noise * spread(aside, 0),
        turn=spec.slip_noise * spread(turning, 0),
        spin=spec.slip_noise * spread(turning, 1),
        longer=scale * spread(ahead, 0),
        wider=scale * spread(turning, 1),
        bend=scale * spread(turning, 0),
        fastest=2.0 * model.v_max,
    )


SLACK = 0.1
"""The way in m that odometry may be ahead of the robot's speed."""


def driven(before: Pose, after: Pose, seconds: float, fastest: float) -> Pose | None:
    """The way from one pose by odometry to a later one, in the robot's frame then; None if the odometry began again.

    Args:
        seconds: the time between them. fastest: see `MotionNoise`.
    """
    way = compose(inverse(before), after)
    return way if math.hypot(way.x, way.y) <= fastest * seconds + SLACK else None


def corrected(way: Pose, longer: float, wider: float, bend: float) -> Pose:
    """A short way as it truly is, if odometry measures `way` and errs by these; see `MotionNoise`."""
    turn = bend * way.x  # it curves the way, too: half of it counts for the direction
    cos, sin = cos_sin(turn / 2)
    x, y = (1.0 + longer) * way.x, (1.0 + longer) * way.y
    return Pose(cos * x - sin * y, sin * x + cos * y, (1.0 + wider) * way.theta + turn)
