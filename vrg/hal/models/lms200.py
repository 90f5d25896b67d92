"""The spec of the laser range finder SICK LMS200."""

import math

from vrg.hal.sensors.laser import LaserSpec

LMS200 = (
    "Laser: SICK LMS200 in mm mode, 181 beams at 1 degree, 10 Hz over a 38400 baud line and a full scale of 8.19 m "
    "(Player manual, driver sicklms200), rounded down to the 8 m of SICK's technical description, whose 10 mm "
    "resolution and 5 mm statistical error (1 sigma) were not checked against the document itself."
)


def lms200(x: float, height: float) -> LaserSpec:
    """Return the spec of an LMS200 that is mounted `x` m ahead of the body's centre, `height` m above ground."""
    return LaserSpec(
        name="front", x=x, height=height, beams=181, fov=math.pi, range_max=8.0, noise=0.005, resolution=0.01, rate=10.0
    )
