"""The spec of the sonar rings of a Pioneer 2-AT."""

import math

from vrg.hal.sensors.sonar import SonarSpec
from vrg.types import Pose

P2_SONAR = (
    "Sonar: the places of the 16 transducers as in ARIA's parameter file p2at-sh.p; a cone of 15 degrees and a range "
    "of 5 m as in Stage's pioneer.inc; a shortest range of 0.1 m, and 25 transducers a second in each ring of eight, "
    "as in the Pioneer 2/3 Operations Manual (not checked against the document itself). Noise and resolution are "
    "estimates. "
)

_QUARTER = ((0.147, 0.136, 90), (0.193, 0.119, 50), (0.227, 0.079, 30), (0.245, 0.027, 10))
"""x and y in m and the heading in degrees of the four transducers at the front left, from the side to the middle."""
_REAR_SHIFT = 0.003
"""The distance in m by which the rear ring is nearer to the middle than the front ring, about."""


def p2_sonar() -> SonarSpec:
    """Return the spec of the front and the rear ring: numbers 0 to 7 from front left to front right, 8 to 15 from rear
    right to rear left.
    """
    left = [(x, y, math.radians(h)) for x, y, h in _QUARTER]
    right = [(x, -y, -h) for x, y, h in reversed(left)]
    front = [*left, *right]
    rear = [(_REAR_SHIFT - x, y, math.pi - h if h > 0 else -math.pi - h) for x, y, h in reversed(front)]
    return SonarSpec(
        name="rings",
        places=tuple(Pose(x, y, h) for x, y, h in [*front, *rear]),
        cone=math.radians(15),
        range_min=0.10,
        range_max=5.0,
        noise=0.01,
        resolution=0.01,
        rate=25 / 8,
    )
