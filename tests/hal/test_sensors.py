"""INS, encoders, odometry and laser noise."""

import math

import numpy as np
import pytest

from vrg.hal.models import MODELS
from vrg.hal.sim.lidar import Lidar
from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors import INS_SIGMA, Reading, Sensors

P2AT = MODELS["P2AT"]
MOUNT = P2AT.laser
DT = 0.02


def make(*names: str, seed: int = 1, noise: bool = True) -> Sensors:
    sensors = Sensors(seed, noise)
    sensors.resize(list(names), [P2AT] * len(names), np.zeros((len(names), 2)), np.zeros((len(names), 3)))
    return sensors


def drive(sensors: Sensors, robots: int, ticks: int, left: float, right: float, start: int = 0) -> Reading:
    """Turn all wheels at these rates (rad/s); the poses stay at the origin."""
    for tick in range(start + 1, start + ticks + 1):
        wheels = np.tile((left, right), (robots, 1)) * tick * DT
        reading = sensors.read(tick, DT, np.zeros((robots, 3)), wheels)
    return reading


def test_without_noise_the_sensors_are_exact() -> None:
    reading = drive(make("a", noise=False), 1, 500, 5.0, 5.0)
    assert np.all(reading.ins == 0)
    assert reading.odometry[0] == pytest.approx((5.0 * 10 * P2AT.wheel_radius, 0.0, 0.0), abs=1e-3)
    assert reading.velocity[0] == pytest.approx((5.0 * P2AT.wheel_radius, 0.0), abs=1e-3)


def test_encoders_count_ticks() -> None:
    reading = drive(make("a", noise=False), 1, 100, math.pi, -math.pi)
    assert reading.encoders[0].tolist() == pytest.approx([P2AT.encoder_ticks, -P2AT.encoder_ticks], abs=1)
    assert reading.encoders.dtype == np.int64


def test_odometry_turns_by_the_effective_track() -> None:
    left, right = P2AT.wheels(0.0, 1.0)
    reading = drive(make("a", noise=False), 1, 50, left, right)
    assert reading.odometry[0, 2] == pytest.approx(1.0, abs=1e-3)
    assert reading.velocity[0] == pytest.approx((0.0, 1.0), abs=1e-2)


def test_noise_makes_odometry_drift_by_about_a_per_cent() -> None:
    names = [f"r{n}" for n in range(20)]
    reading = drive(make(*names), 20, 1000, 5.0, 5.0)
    way = 5.0 * 20 * P2AT.wheel_radius
    error = np.hypot(reading.odometry[:, 0] - way, reading.odometry[:, 1]) / way
    assert 0.005 < np.median(error) < 0.5
    assert np.ptp(reading.odometry[:, 2]) > 0.1, "each robot's wheels are off in their own way"


def test_the_ins_is_noisy_without_bias() -> None:
    sensors = make("a")
    seen = np.array([sensors.read(t, DT, np.zeros((1, 3)), np.zeros((1, 2))).ins[0] for t in range(2000)])
    assert np.abs(seen.mean(axis=0)).max() < 0.002
    assert seen.std(axis=0) == pytest.approx(np.array(INS_SIGMA), rel=0.1)


def test_noise_is_fixed_by_the_seed_and_the_robots_name() -> None:
    def trace(*names: str, seed: int = 1) -> np.ndarray:  # type: ignore[type-arg]
        reading = drive(make(*names, seed=seed), len(names), 300, 3.0, 4.0)
        return np.hstack((reading.ins, reading.odometry))[-1]

    assert np.array_equal(trace("a"), trace("a"))
    assert np.array_equal(trace("a"), trace("b", "a")), "not by who else takes part"
    assert not np.array_equal(trace("a"), trace("b"))
    assert not np.array_equal(trace("a"), trace("a", seed=2))


def test_noise_goes_on_after_a_restart_as_if_there_had_been_none() -> None:
    whole = drive(make("a"), 1, 400, 3.0, 4.0)
    first = make("a")
    drive(first, 1, 150, 3.0, 4.0)
    second = Sensors(1, True)
    second.resize(["a"], [P2AT], np.array([(3.0, 4.0)]) * 150 * DT, first.odometry.copy())
    resumed = drive(second, 1, 250, 3.0, 4.0, start=150)
    assert np.array_equal(whole.odometry, resumed.odometry)
    assert np.array_equal(whole.ins, resumed.ins)


def lidar(noise: bool, seed: int = 1) -> Lidar:
    scanner = Lidar(load_map("marhes_lab"), seed, noise)
    scanner.look([P2AT], np.array([(0.0, 0.0, 0.0)]))
    return scanner


def test_a_scan_without_noise_is_exact_and_starts_at_the_mount() -> None:
    assert MOUNT is not None
    ranges = lidar(False).scan("a", MOUNT, (0.0, 0.0, math.pi / 2), 0)
    assert ranges.dtype == np.dtype("<f4")
    assert ranges.shape == (181,)
    assert ranges[90] == pytest.approx(2.9 - MOUNT.x, abs=1e-5)


def test_a_noisy_scan_is_quantised_and_scatters_as_the_data_sheet_says() -> None:
    assert MOUNT is not None
    exact = lidar(False).scan("a", MOUNT, (0.0, 0.0, 0.5), 0)
    scanner = lidar(True)
    scans = np.array([scanner.scan("a", MOUNT, (0.0, 0.0, 0.5), n) for n in range(200)])
    steps = scans / MOUNT.resolution
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    error = scans - exact
    expected = math.hypot(MOUNT.noise, MOUNT.resolution / math.sqrt(12))
    assert error.std() == pytest.approx(expected, rel=0.2)
    assert abs(error.mean()) < 0.002


def test_a_beam_that_meets_nothing_reads_the_maximum_with_noise_too() -> None:
    assert MOUNT is not None
    scanner = Lidar(load_map("open"), 1, True)
    assert np.all(scanner.scan("a", MOUNT, (0.0, 0.0, 0.0), 3) == MOUNT.range_max)


def test_laser_noise_is_fixed_by_seed_name_and_number() -> None:
    assert MOUNT is not None
    pose = (0.0, 0.0, 0.5)
    scan = lidar(True).scan("a", MOUNT, pose, 100)
    again = lidar(True)
    again.scan("a", MOUNT, pose, 3)
    assert np.array_equal(scan, again.scan("a", MOUNT, pose, 100))
    assert not np.array_equal(scan, lidar(True).scan("b", MOUNT, pose, 100))
    assert not np.array_equal(scan, lidar(True, seed=2).scan("a", MOUNT, pose, 100))
    assert not np.array_equal(scan, lidar(True).scan("a", MOUNT, pose, 101))


def test_a_robot_is_seen_by_others_and_not_by_itself() -> None:
    assert MOUNT is not None
    scanner = Lidar(load_map("open"), 1, False)
    scanner.look([P2AT, P2AT], np.array([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]))
    ahead = scanner.scan("a", MOUNT, (0.0, 0.0, 0.0), 0)
    assert ahead[90] == pytest.approx(3.0 - P2AT.length / 2 - MOUNT.x, abs=1e-5)
    assert np.all(scanner.scan("b", MOUNT, (3.0, 0.0, 0.0), 0) == MOUNT.range_max)
