"""The settings of the simulated source."""

from pydantic import Field

from vrg.tables import Table


class Errors(Table):
    """The errors of the odometry of an emulated robot, as of a real one that was not calibrated.

    Args:
        way, turn: the shares by which its ways and its turns are longer than it measures.
        bend: its turn on a metre straight ahead, degrees.
    """

    way: float = Field(0.0, ge=-0.5, le=0.5)
    turn: float = Field(0.0, ge=-0.5, le=0.5)
    bend: float = Field(0.0, ge=-45.0, le=45.0)


class SimSettings(Table):
    """The table of a source of the kind `sim`. The defaults are those of a webcam above a small field.

    Args:
        rate: the pictures in a second.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
        delay: the time from a picture to its fixes, s. jitter: the longest additional time, s.
        dark: the match times from and to which nothing is seen, as when the light is off, s.
        loss: the share of fixes that are lost. swaps: the share of pictures in which two robots have each other's name.
        errors: what the odometry of emulated robots is off by, by the robot's name.
    """

    rate: float = Field(15.0, gt=0.0, le=100.0)
    position: float = Field(0.01, gt=0.0, le=10.0)
    heading: float = Field(1.0, gt=0.0, le=90.0)
    delay: float = Field(0.1, ge=0.0, le=10.0)
    jitter: float = Field(0.02, ge=0.0, le=10.0)
    dark: tuple[tuple[float, float], ...] = ()
    loss: float = Field(0.0, ge=0.0, le=1.0)
    swaps: float = Field(0.0, ge=0.0, le=1.0)
    errors: dict[str, Errors] = Field(default_factory=dict)
