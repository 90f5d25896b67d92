"""Robot models."""

import math

import pytest

from vrg.errors import ConfigError
from vrg.hal.models import MODELS, RobotModel, robot_model


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_a_model_is_physically_sound(model: RobotModel) -> None:
    assert model.wheelbase < model.length
    assert model.track + model.wheel_width <= model.width
    assert model.effective_track > model.track, "a skidding body turns less than its wheels say"
    assert model.brake >= 7.0
    assert model.laser is not None
    assert abs(model.laser.x) < model.length / 2, "the laser is on the body, which the scan looks out of"
    assert "stimated" in model.source


def test_a_p2at_can_stop_from_top_speed_in_a_tenth_of_a_second() -> None:
    model = robot_model("P2AT")
    assert model.v_max / model.brake <= 0.1


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_wheels_and_velocity_are_inverses(model: RobotModel) -> None:
    assert model.velocity(*model.wheels(0.4, -0.7)) == pytest.approx((0.4, -0.7))


def test_both_carry_an_lms200() -> None:
    for model in MODELS.values():
        laser = model.laser
        assert laser is not None
        assert (laser.beams, laser.fov, laser.range_max, laser.resolution) == (181, math.pi, 8.0, 0.01)


def test_an_unknown_model_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"ATRV-Jr, P2AT.*did you mean 'P2AT'"):
        robot_model("p2-at")
    with pytest.raises(ConfigError, match="got 'tricycle'"):
        robot_model("tricycle")
