"""How fast the others move."""

import random

import pytest

from vrg.navigation.motion import TopSpeed, VelocityEstimator


def test_a_steady_velocity_is_found() -> None:
    estimator = VelocityEstimator()
    for i in range(20):
        estimator.update(i * 0.1, {"a": (i * 0.05, -i * 0.02)})
    assert estimator.velocities["a"] == pytest.approx((0.5, -0.2), abs=1e-3)


def test_the_first_sighting_tells_no_velocity() -> None:
    estimator = VelocityEstimator()
    estimator.update(5.0, {"a": (3.0, 4.0)})
    assert estimator.velocities["a"] == (0.0, 0.0)


def test_the_same_sighting_twice_changes_nothing() -> None:
    estimator = VelocityEstimator()
    estimator.update(0.0, {"a": (0.0, 0.0)})
    estimator.update(0.1, {"a": (0.1, 0.0)})
    before = estimator.velocities["a"]
    estimator.update(0.1, {"a": (0.1, 0.0)})
    assert estimator.velocities["a"] == before


def test_when_time_steps_back_far_it_begins_anew() -> None:
    estimator = VelocityEstimator()
    estimator.update(10.0, {"a": (0.0, 0.0)})
    estimator.update(1.0, {"a": (0.0, 0.0)})
    estimator.update(1.1, {"a": (9.0, 0.0)})
    assert estimator.velocities["a"] == (0.0, 0.0)
    estimator.update(1.2, {"a": (9.1, 0.0)})
    assert estimator.velocities["a"][0] > 0


def test_a_top_speed_is_believed_only_after_some_driving() -> None:
    top = TopSpeed(0.7)
    for i in range(20):
        top.update(i * 0.1, 0.5)
    assert top.value == 0.7
    for i in range(20, 40):
        top.update(i * 0.1, 0.5)
    assert top.value == 0.5


def test_standing_still_teaches_nothing() -> None:
    top = TopSpeed(0.7)
    for i in range(100):
        top.update(i * 0.1, 0.0)
    assert top.value == 0.7


def test_noise_does_not_make_a_robot_believe_that_it_is_faster_than_it_is() -> None:
    rng = random.Random(3)
    top = TopSpeed(0.7)
    for step in range(2000):
        true = 0.5 if step // 50 % 3 else 0.3
        top.update(step * 0.1, true * (1 + rng.gauss(0.0, 0.05)))
    assert top.value == pytest.approx(0.5, rel=0.01)
