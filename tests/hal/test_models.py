"""Robot models."""

import math
from dataclasses import replace

import pytest

from vrg.errors import ConfigError
from vrg.hal.models import MODELS, RobotModel, robot_model
from vrg.hal.sensors.laser import LaserSpec
from vrg.types import Twist


@pytest.mark.parametrize("model", [MODELS.get(name) for name in MODELS.names()], ids=MODELS.names())
def test_a_model_is_physically_sound(model: RobotModel) -> None:
    drivetrain = model.drivetrain
    assert all(2 * abs(wheel.x) < model.length for wheel in drivetrain.wheels)
    assert all(2 * abs(wheel.y) + drivetrain.wheel_width <= model.width for wheel in drivetrain.wheels)
    if model.flies is not None:
        minutes = 60.0 * model.battery_wh / (model.flies.hover + model.idle_w)
        assert 3.0 < minutes < 60.0
        assert model.flies.cruise <= model.flies.ceiling
        assert "stimate" in model.source
        return
    skids = len({wheel.x for wheel in drivetrain.wheels if wheel.axis is not None}) > 1
    track = 2 * drivetrain.wheels[0].y
    assert drivetrain.effective_track > track if skids else drivetrain.effective_track == pytest.approx(track)
    assert model.brake >= 4.0
    for laser in (spec for spec in model.sensors if isinstance(spec, LaserSpec)):
        assert abs(laser.x) <= model.length / 2, "the laser is on the body, which the scan looks out of"
    assert "stimate" in model.source


def test_those_of_the_thesis_carry_an_lms200_and_a_p2at_can_stop_in_a_tenth_of_a_second() -> None:
    p2at = robot_model("P2AT")
    assert p2at.v_max / p2at.brake <= 0.1
    for model in (p2at, robot_model("ATRV-Jr")):
        laser = model.sensor(LaserSpec)
        assert laser is not None
        assert (laser.beams, laser.fov, laser.range_max, laser.resolution) == (181, math.pi, 8.0, 0.01)
    assert replace(p2at, sensors=()).sensor(LaserSpec) is None


def test_an_unknown_model_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"ATRV-Jr, .*P2AT.*did you mean 'P2AT'"):
        robot_model("p2-at")
    with pytest.raises(ConfigError, match="got 'tricycle'"):
        robot_model("tricycle")


def test_a_limit_keeps_the_curve() -> None:
    model = robot_model("P2AT")
    slow = model.limited(Twist(2.0, 1.0), v_max=0.3)
    assert max(model.drivetrain.speeds(slow)) == pytest.approx(0.3 / model.drivetrain.wheel_radius)
    assert model.limited(Twist(0.1, 0.1), v_max=0.3) == Twist(0.1, 0.1)
    assert model.limited(Twist(5.0, 0.0), v_max=50.0).v == model.v_max, "no limit is above the model's own"
