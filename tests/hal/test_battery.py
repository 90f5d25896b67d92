"""The energy balance."""

import numpy as np
import pytest

from vrg.hal.models import robot_model
from vrg.hal.sim.robot import GRAVITY, Batteries
from vrg.testing.omni import OMNI
from vrg.types import Twist

P2AT = robot_model("P2AT")


def drawn(dt: float, way: float = 0.0, before: float = 0.0, after: float = 0.0) -> float:
    """Energy in J that a P2AT draws, driving `way` m while its speed goes from `before` to `after`."""
    batteries = Batteries([P2AT], np.zeros(1), np.zeros((1, 2)), np.array([(before, 0.0, 0.0)]))
    angle = way / P2AT.drivetrain.wheel_radius
    batteries.draw(dt, np.array([(angle, angle)]), np.array([(after, 0.0, 0.0)]))
    return float(batteries.used[0])


def test_a_robot_on_omni_wheels_pays_for_its_own_way_ahead() -> None:
    speeds = OMNI.drivetrain.speeds(Twist(0.7, 0.0))
    batteries = Batteries([OMNI], np.zeros(1), np.zeros((1, 3)), np.array([(0.7, 0.0, 0.0)]))
    batteries.draw(10.0, 10.0 * np.array([speeds]), np.array([(0.7, 0.0, 0.0)]))
    assert float(batteries.used[0]) == pytest.approx(drawn(10.0, 7.0, before=0.7, after=0.7))


def test_standing_draws_the_idle_power() -> None:
    assert drawn(10.0) == pytest.approx(10.0 * P2AT.idle_w)


@pytest.mark.parametrize("way", [7.0, -7.0])
def test_driving_adds_rolling_resistance_over_the_way(way: float) -> None:
    extra = drawn(10.0, way, before=0.7, after=0.7) - drawn(10.0)
    assert extra == pytest.approx(P2AT.mass * GRAVITY * P2AT.rolling * 7.0 / P2AT.drive_efficiency)


def test_speeding_up_costs_and_braking_gives_nothing_back() -> None:
    assert drawn(1.0, before=0.0, after=0.7) > drawn(1.0)
    assert drawn(1.0, before=0.7, after=0.0) == drawn(1.0)


def test_the_charge_goes_from_1_to_0_and_not_below() -> None:
    batteries = Batteries([P2AT], np.zeros(1), np.zeros((1, 2)), np.zeros((1, 3)))
    assert batteries.charge.tolist() == [1.0]
    for hours, left in ((P2AT.battery_wh / P2AT.idle_w / 2, 0.5), (100.0, 0.0)):
        batteries.draw(hours * 3600, np.zeros((1, 2)), np.zeros((1, 3)))
        assert batteries.charge.tolist() == pytest.approx([left])
