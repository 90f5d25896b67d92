"""How fast the others move."""

import random

import pytest

from vrg.navigation.motion import TopSpeed, VelocityEstimator


def test_a_steady_velocity_is_found() -> None:
    estimator = VelocityEstimator()
    for i in range(20):
        estimator.update(i * 0.1, {"a": (i * 0.05, -i * 0.02)})
    assert estimator.velocities["a"] == pytest.approx((0.5, -0.2), abs=1e-3)


def test_the_first_sighting_tells_no_velocity_and_the_same_one_twice_changes_nothing() -> None:
    estimator = VelocityEstimator()
    estimator.update(0.0, {"a": (3.0, 4.0)})
    assert estimator.velocities["a"] == (0.0, 0.0)
    estimator.update(0.1, {"a": (3.1, 4.0)})
    before = estimator.velocities["a"]
    estimator.update(0.1, {"a": (3.1, 4.0)})
    assert estimator.velocities["a"] == before


def test_when_time_steps_back_far_it_begins_anew() -> None:
    estimator = VelocityEstimator()
    estimator.update(10.0, {"a": (0.0, 0.0)})
    estimator.update(1.0, {"a": (0.0, 0.0)})
    estimator.update(1.1, {"a": (9.0, 0.0)})
    assert estimator.velocities["a"] == (0.0, 0.0)
    estimator.update(1.2, {"a": (9.1, 0.0)})
    assert estimator.velocities["a"][0] > 0


def test_a_top_speed_is_believed_only_after_some_driving_and_standing_still_teaches_nothing() -> None:
    top = TopSpeed(0.7)
    for begin, end, speed, believed in ((0, 100, 0.0, 0.7), (100, 120, 0.5, 0.7), (120, 140, 0.5, 0.5)):
        for i in range(begin, end):
            top.update(i * 0.1, speed)
        assert top.value == believed


def test_noise_does_not_make_a_robot_believe_that_it_is_faster_than_it_is() -> None:
    rng = random.Random(3)
    top = TopSpeed(0.7)
    for step in range(2000):
        true = 0.5 if step // 50 % 3 else 0.3
        top.update(step * 0.1, true * (1 + rng.gauss(0.0, 0.05)))
    assert top.value == pytest.approx(0.5, rel=0.01)
