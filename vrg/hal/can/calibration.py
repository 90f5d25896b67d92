"""The differences between robots of one model, measured once and kept in a file that people can read.

robot = "sue"
track = 0.575
motion = { delay = 0.07, a_max = 0.8 }

[axes.0]
direction = 1
ratio = 50.2
serial = "3A65B1C0"
"""

import tomllib
from pathlib import Path

from pydantic import Field, ValidationError, field_validator

from vrg.errors import ConfigError, FileError
from vrg.files import read_text, toml_of
from vrg.hal.models import RobotModel
from vrg.hal.models.settings import motion_problems, with_motion
from vrg.tables import Table, problems_of

_AT_MOST = ("v_max", "w_max", "brake")
"""The numbers of a robot that may be smaller than those of its model, and not larger."""


class AxisCalibration(Table):
    """One motor.

    Args:
        direction: 1 where a positive speed drives ahead, -1 where it drives back.
        ratio: turns of the motor for one turn of the wheel.
        serial: the serial number of its drive; empty where that is not known.
    """

    direction: int
    ratio: float = Field(gt=0, le=10_000)
    serial: str = ""

    @field_validator("direction")
    @classmethod
    def _direction(cls, value: int) -> int:
        if value not in (1, -1):
            raise ValueError(f"expected 1 or -1, got {value}")
        return value


class Calibration(Table):
    """One robot.

    Args:
        robot: the robot's name, for people. track: its effective track, m. axes: its motors by node id.
        motion: the numbers of how it moves that are not those of its model; see `with_motion`.
    """

    robot: str
    track: float = Field(gt=0.01, le=10)
    axes: dict[int, AxisCalibration]
    motion: dict[str, float] = Field(default_factory=dict)

    @field_validator("motion")
    @classmethod
    def _motion(cls, value: dict[str, float]) -> dict[str, float]:
        if problems := motion_problems(value):
            raise ValueError("; ".join(map(str, problems)))
        return value

    def applied(self, model: RobotModel) -> RobotModel:
        """The model with what is known of this robot, which is no faster than the model, or the match file, allows, and
        brakes no harder."""
        limits: dict[str, float] = {
            name: min(self.motion[name], getattr(model, name)) for name in _AT_MOST if name in self.motion
        }
        return with_motion(model, {"track": self.track, **self.motion, **limits})


def load_calibration(path: Path, nodes: list[int]) -> Calibration:
    """Read the calibration file of a robot that has these nodes.

    Raises:
        ConfigError: it cannot be read, or does not fit; tells every problem.
    """
    try:
        data = toml_of(read_text(path))
    except (OSError, FileError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{path}: expected a calibration file, as `vrg can calibrate` writes it: {error}") from None
    try:
        found = Calibration.model_validate(data)
    except ValidationError as error:
        raise ConfigError([f"{path}: {problem}" for problem in problems_of(error)]) from None
    if sorted(found.axes) != sorted(nodes):
        raise ConfigError(f"{path}: axes: expected nodes {sorted(nodes)}, as wired, got {sorted(found.axes)}")
    return found


def calibration_text(calibration: Calibration) -> str:
    """A calibration as it is written to its file."""
    lines = [f'robot = "{calibration.robot}"', f"track = {calibration.track:.6g}"]
    if calibration.motion:
        numbers = ", ".join(f"{name} = {value:.3g}" for name, value in calibration.motion.items())
        lines.append(f"motion = {{ {numbers} }}")
    for node, axis in sorted(calibration.axes.items()):
        lines += ["", f"[axes.{node}]", f"direction = {axis.direction}", f"ratio = {axis.ratio:.8g}"]
        lines += [f'serial = "{axis.serial}"'] if axis.serial else []
    return "\n".join(lines) + "\n"
