"""Robot models: each described once, from its data sheet, and used by every backend."""

import difflib
import math
from dataclasses import dataclass

from vrg.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class LaserMount:
    """A planar range finder on a robot.

    Args:
        x: m ahead of the body's centre. height: m above ground.
        beams: number of beams. fov: rad covered by them, symmetric about straight ahead.
        range_max: m. noise: standard deviation of a range, m. resolution: step of a range, m.
        rate: scans per second.
    """

    x: float
    height: float
    beams: int
    fov: float
    range_max: float
    noise: float
    resolution: float
    rate: float


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """A skid-steer robot. Lengths in m, mass in kg, speeds in m/s, accelerations in m/s^2, angles in rad.

    Args:
        track: distance between the centre lines of the left and right wheels.
        effective_track: the track that a unicycle model needs to predict the turn rate of the skidding body:
            w = (v_right - v_left) / effective_track.
        v_max, w_max: top speed ahead and top turn rate.
        a_max: acceleration. brake: deceleration with locked wheels, used by watchdogs and stops.
        encoder_ticks: per turn of a wheel.
        battery_wh: energy of a full battery, Wh. idle_w: electronics' power, W. rolling: rolling resistance,
            fraction of weight. drive_efficiency: mechanical over electrical power.
        bumpers: number of touch sensors, evenly around the body, the first ahead, counter-clockwise.
        source: where the figures come from.
    """

    name: str
    length: float
    width: float
    height: float
    mass: float
    wheel_radius: float
    wheel_width: float
    wheelbase: float
    track: float
    effective_track: float
    v_max: float
    w_max: float
    a_max: float
    brake: float
    encoder_ticks: int
    battery_wh: float
    idle_w: float
    rolling: float
    drive_efficiency: float
    bumpers: int
    laser: LaserMount | None
    source: str

    @property
    def wheel_speed_max(self) -> float:
        """Top wheel speed, rad/s."""
        return self.v_max / self.wheel_radius

    def wheels(self, v: float, w: float) -> tuple[float, float]:
        """Wheel speeds (left, right) in rad/s for a body velocity of v m/s and w rad/s."""
        half = w * self.effective_track / 2
        return (v - half) / self.wheel_radius, (v + half) / self.wheel_radius

    def velocity(self, left: float, right: float) -> tuple[float, float]:
        """Body velocity (v, w) for wheel speeds in rad/s: the inverse of `wheels`."""
        v = (left + right) / 2 * self.wheel_radius
        return v, (right - left) * self.wheel_radius / self.effective_track


_LMS200 = (
    "Laser: SICK LMS200 in mm mode, 181 beams at 1 degree, 10 Hz over a 38400 baud line and a full scale of 8.19 m "
    "(Player manual, driver sicklms200), rounded down to the 8 m of SICK's technical description, whose 10 mm "
    "resolution and 5 mm statistical error (1 sigma) were not checked against the document itself."
)


def _lms200(x: float, height: float) -> LaserMount:
    return LaserMount(
        x=x, height=height, beams=181, fov=math.pi, range_max=8.0, noise=0.005, resolution=0.01, rate=10.0
    )


MODELS: dict[str, RobotModel] = {
    model.name: model
    for model in (
        RobotModel(
            name="P2AT",
            length=0.50,
            width=0.49,
            height=0.26,
            mass=20.0,
            wheel_radius=0.11,
            wheel_width=0.08,
            wheelbase=0.27,
            track=0.40,
            effective_track=0.582,
            v_max=0.7,
            w_max=2.4,
            a_max=1.0,
            brake=9.0,
            encoder_ticks=34_000,
            battery_wh=252.0,
            idle_w=40.0,
            rolling=0.05,
            drive_efficiency=0.6,
            bumpers=8,
            laser=_lms200(0.15, 0.35),
            source=(
                "Length, width, height, wheel diameter (0.22 m), top speed (0.7 m/s), turn rate (140 degrees/s) and "
                "battery (3 x 7 Ah x 12 V): Pioneer 2/3 Operations Manual, ActivMedia; not checked "
                "against the document itself. "
                "Estimated: mass (body, batteries, laser), wheelbase, track, acceleration, encoder ticks (a Pioneer "
                "3-AT's), idle power, rolling resistance, efficiency, laser mount. Brake: locked rubber on dry "
                "concrete, friction 0.92. Effective track: measured in the pybullet engine, see vrg.hal.sim.bullet; "
                "the robot's own parameter file p2at.p as shipped with p2os has 2 / DiffConvFactor = 0.588 m. "
            )
            + _LMS200,
        ),
        RobotModel(
            name="ATRV-Jr",
            length=0.78,
            width=0.64,
            height=0.55,
            mass=54.0,
            wheel_radius=0.165,
            wheel_width=0.10,
            wheelbase=0.42,
            track=0.53,
            effective_track=0.863,
            v_max=1.0,
            w_max=2.1,
            a_max=1.0,
            brake=9.0,
            encoder_ticks=20_000,
            battery_wh=672.0,
            idle_w=80.0,
            rolling=0.05,
            drive_efficiency=0.6,
            bumpers=8,
            laser=_lms200(0.27, 0.62),
            source=(
                "Length, width, height, mass (50 kg and the laser), top speed (1 m/s), turn rate (120 degrees/s) and "
                "battery (672 Wh): iRobot ATRV-Jr data sheet; not checked against the "
                "document itself. Estimated: wheel radius, "
                "wheelbase, track, acceleration, encoder ticks, idle power, rolling resistance, efficiency, laser "
                "mount. Brake: as for P2AT. Effective track: measured in the pybullet engine. "
            )
            + _LMS200,
        ),
    )
}
"""Every robot model by name."""


def robot_model(name: str) -> RobotModel:
    """The robot model of this name.

    Raises:
        ConfigError: there is none; lists the names that exist.
    """
    model = MODELS.get(name)
    if model is None:
        close = difflib.get_close_matches(name.upper(), [known.upper() for known in MODELS], n=1)
        guess = next((f", did you mean {known!r}?" for known in MODELS if [known.upper()] == close), "")
        raise ConfigError([f"robot model: expected one of {', '.join(sorted(MODELS))}, got {name!r}{guess}"])
    return model
