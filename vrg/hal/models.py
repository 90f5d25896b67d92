"""Robot models: each described once, from its data sheet, and used by every backend."""

from dataclasses import dataclass, field

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
        battery_wh: energy of a full battery, Wh. idle_w: electronics' power, W. rolling: rolling resistance, fraction of
            weight. drive_efficiency: mechanical over electrical power.
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
