"""The simulations of sensors: exact without noise, and with noise that only the seed, the robot and the tick fix."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from vrg.errors import ConfigError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sensors.ins import Ins, InsSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.touch import TouchSpec
from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors.base import Instant, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.laser import LaserSimulation
from vrg.hal.sim.sensors.simple import InsSimulation
from vrg.hal.sim.sensors.suite import SensorSuite
from vrg.types import Twist

P2AT = robot_model("P2AT")
RADIUS = P2AT.drivetrain.wheel_radius
DT = 0.02
TICKS_PER_TURN = 34_000


def instant(tick: int, models: Sequence[RobotModel], wheels: tuple[float, float]) -> Instant:
    """All robots stand at the origin and turn their wheels at these rates, rad/s."""
    n = len(models)
    turned = np.tile(wheels, (n, 1)) * tick * DT
    return Instant(tick, DT, models, np.zeros((n, 3)), np.zeros((n, 3)), turned, [0b101] * n, np.full(n, 0.5))


def make(*names: str, seed: int = 1, noise: bool = True, model: RobotModel = P2AT, tick: int = 0) -> SensorSuite:
    now = instant(tick, [model] * len(names), (3.0, 4.0))
    return SensorSuite(Surroundings(load_map("open"), seed, noise), names, [False] * len(names), now)


def drive(suite: SensorSuite, names: Sequence[str], ticks: int, left: float, right: float, start: int = 0) -> dict:  # type: ignore[type-arg]
    """What each sensor has said last, by robot and the type of its message."""
    said = {}
    for tick in range(start + 1, start + ticks + 1):
        for robot, _, message in suite.sense(instant(tick, [P2AT] * len(names), (left, right))):
            said[robot, type(message)] = message
    return said


def test_without_noise_the_sensors_are_exact() -> None:
    said = drive(make("a", noise=False), "a", 500, 5.0, 5.0)
    assert (said["a", Ins].pose.x, said["a", Ins].pose.theta) == (0.0, 0.0)
    odometry = said["a", Odometry]
    assert odometry.pose.x == pytest.approx(5.0 * 10 * RADIUS, abs=1e-3)
    assert odometry.twist.v == pytest.approx(5.0 * RADIUS, abs=1e-3)
    assert len(set(said["a", Encoders].counts)) == 1
    said = drive(make("a", noise=False), "a", 100, math.pi, -math.pi)
    assert said["a", Encoders].counts == pytest.approx((TICKS_PER_TURN, -TICKS_PER_TURN), abs=1)


@pytest.mark.parametrize(("ticks", "heading"), [(50, 1.0), (250, 5.0 - math.tau)], ids=["once", "round and round"])
def test_odometry_turns_by_the_effective_track_within_half_a_turn(ticks: int, heading: float) -> None:
    said = drive(make("a", noise=False), "a", ticks, *P2AT.drivetrain.speeds(Twist(0.0, 1.0)))
    assert said["a", Odometry].pose.theta == pytest.approx(heading, abs=1e-3)
    assert said["a", Odometry].twist.w == pytest.approx(1.0, abs=1e-2)


def test_noise_makes_odometry_drift_by_about_a_per_cent() -> None:
    names = [f"r{n}" for n in range(20)]
    said = drive(make(*names), names, 1000, 5.0, 5.0)
    way = 5.0 * 20 * RADIUS
    poses = [said[name, Odometry].pose for name in names]
    error = [math.hypot(pose.x - way, pose.y) / way for pose in poses]
    assert 0.005 < np.median(error) < 0.5
    assert np.ptp([pose.theta for pose in poses]) > 0.1, "each robot's wheels are off in their own way"


def test_the_ins_is_noisy_without_bias() -> None:
    suite = make("a", model=replace(P2AT, sensors=(InsSpec(rate=50.0),)))
    poses = [m.pose for t in range(2000) for _, _, m in suite.sense(instant(t, [P2AT], (0, 0))) if isinstance(m, Ins)]
    seen = np.array([(pose.x, pose.y, pose.theta) for pose in poses])
    assert len(seen) == 2000
    assert np.abs(seen.mean(axis=0)).max() < 0.002
    assert seen.std(axis=0) == pytest.approx((0.02, 0.02, 0.005), rel=0.1)


def test_noise_is_fixed_by_the_seed_and_the_robots_name() -> None:
    def last(*names: str, seed: int = 1, look: bool = False) -> tuple[object, object]:
        suite = make(*names, seed=seed)
        drive(suite, names, 200, 3.0, 4.0)
        if look:
            suite.remember(names[-1])
        said = drive(suite, names, 100, 3.0, 4.0, start=200)
        return said[names[-1], Ins], said[names[-1], Odometry]

    assert last("a") == last("a")
    assert last("a") == last("b", "c", "a"), "not by who else takes part"
    assert last("a") == last("a", look=True), "nor by who looks"
    assert last("a") != last("b")
    assert last("a") != last("a", seed=2)


def test_noise_goes_on_after_a_restart_as_if_there_had_been_none() -> None:
    whole = drive(make("a"), "a", 400, 3.0, 4.0)
    first = make("a")
    drive(first, "a", 150, 3.0, 4.0)
    second = make("a", tick=150)
    second.recall("a", first.remember("a"))
    resumed = drive(second, "a", 250, 3.0, 4.0, start=150)
    assert resumed["a", Odometry] == whole["a", Odometry]
    assert resumed["a", Ins] == whole["a", Ins]


def test_each_sensor_speaks_at_its_own_rate() -> None:
    model = replace(P2AT, sensors=(EncodersSpec(ticks=100, rate=25.0), TouchSpec(count=8, rate=5.0)))
    suite = make("a", model=model)
    said = [m.kind for t in range(100) for _, _, m in suite.sense(instant(t, [model], (0, 0)))]
    assert (said.count("encoders"), said.count("touch")) == (50, 10)


def test_a_subclass_says_itself_that_its_readings_depend_on_the_instant_alone() -> None:
    class Drifting(InsSimulation):
        """What it adds may have a memory."""

    class Plain(InsSimulation):
        deferrable = True

    assert (InsSimulation.deferrable, Drifting.deferrable, Plain.deferrable) == (True, False, True)
    assert not SensorSimulation.deferrable


def test_a_share_of_the_readings_may_drop_out() -> None:
    model = replace(P2AT, sensors=(TouchSpec(count=8, rate=50.0, drop_out=0.3),))
    runs = [
        [len(suite.sense(instant(t, [model], (0, 0)))) for t in range(2000)] for suite in (make("a", model=model),) * 2
    ]
    assert sum(runs[0]) == pytest.approx(1400, rel=0.1)
    assert runs[0] == runs[1], "the seed decides which"


def test_two_sensors_of_a_kind_are_told_apart() -> None:
    model = replace(P2AT, sensors=(InsSpec(name="left"), InsSpec(name="right")))
    said = {name: m for _, name, m in make("a", model=model).sense(instant(0, [model], (0, 0)))}
    assert set(said) == {"left", "right"}
    assert said["left"] != said["right"], "each has its own noise"


def test_bumpers_and_battery_say_what_is_true() -> None:
    said = drive(make("a"), "a", 100, 0.0, 0.0)
    kinds = {message.kind: message for message in said.values()}
    assert kinds["touch"].pressed == (True, False, True, False, False, False, False, False)
    assert kinds["battery"].charge == 0.5


def test_of_a_physical_robot_only_what_it_may_lack_is_simulated() -> None:
    suite = SensorSuite(Surroundings(load_map("open"), 1, True), ["g"], [True], instant(0, [P2AT], (0, 0)))
    assert {m.kind for _, _, m in suite.sense(instant(0, [P2AT], (0, 0)))} == {"laser", "sonar", "gps"}


def test_a_simulation_that_cannot_be_imported_is_told() -> None:
    class Broken(TouchSpec):
        simulation = "no_such_package:Simulation"

    with pytest.raises(ConfigError, match="no_such_package"):
        make("a", model=replace(P2AT, sensors=(Broken(count=1),)))


MOUNT = P2AT.sensor(LaserSpec)
assert MOUNT is not None
FRONT: LaserSpec = MOUNT


def lasers(noise: bool, seed: int = 1, map_name: str = "marhes_lab") -> LaserSimulation:
    simulation = LaserSimulation(Surroundings(load_map(map_name), seed, noise), [], instant(0, [P2AT], (0, 0)))
    simulation.look([P2AT], np.array([(0.0, 0.0, 0.0)]))
    return simulation


def scan_of(
    simulation: LaserSimulation, robot: str, pose: tuple[float, float, float], number: int
) -> npt.NDArray[np.float32]:
    """One scan of one robot."""
    return simulation.scans([robot], [FRONT], np.array([pose]), [number])[0]


def test_scans_that_are_computed_together_are_those_that_are_computed_one_by_one() -> None:
    rng = np.random.default_rng(4)
    poses = rng.uniform((-2.5, -2.5, -3.0), (2.5, 2.5, 3.0), (6, 3))
    names = list("abcdef")
    for noise in (False, True):
        together = lasers(noise).scans(names, [FRONT] * 6, poses, [7] * 6)
        for name, pose, ranges in zip(names, poses, together, strict=True):
            assert np.array_equal(ranges, scan_of(lasers(noise), name, tuple(pose), 7))


def test_a_scan_without_noise_is_exact_and_starts_at_the_mount() -> None:
    ranges = scan_of(lasers(False), "a", (0.0, 0.0, math.pi / 2), 0)
    assert ranges.dtype == np.dtype("<f4")
    assert ranges.shape == (181,)
    assert ranges[90] == pytest.approx(2.9 - FRONT.x, abs=1e-5)


def test_a_noisy_scan_is_quantised_and_scatters_as_the_data_sheet_says() -> None:
    exact = scan_of(lasers(False), "a", (0.0, 0.0, 0.5), 0)
    simulation = lasers(True)
    scans = np.array([scan_of(simulation, "a", (0.0, 0.0, 0.5), n) for n in range(200)])
    steps = scans / FRONT.resolution
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    error = scans - exact
    expected = math.hypot(FRONT.noise, FRONT.resolution / math.sqrt(12))
    assert error.std() == pytest.approx(expected, rel=0.2)
    assert abs(error.mean()) < 0.002


def test_a_beam_that_meets_nothing_reads_the_maximum_with_noise_too() -> None:
    simulation = lasers(True, map_name="open")
    assert np.all(scan_of(simulation, "a", (0.0, 0.0, 0.0), 3) == FRONT.range_max)


def test_laser_noise_is_fixed_by_seed_name_and_number() -> None:
    pose = (0.0, 0.0, 0.5)
    scan = scan_of(lasers(True), "a", pose, 100)
    again = lasers(True)
    scan_of(again, "a", pose, 3)
    assert np.array_equal(scan, scan_of(again, "a", pose, 100))
    assert not np.array_equal(scan, scan_of(lasers(True), "b", pose, 100))
    assert not np.array_equal(scan, scan_of(lasers(True, seed=2), "a", pose, 100))
    assert not np.array_equal(scan, scan_of(lasers(True), "a", pose, 101))


def test_a_robot_is_seen_by_others_and_not_by_itself() -> None:
    simulation = lasers(False, map_name="open")
    simulation.look([P2AT, P2AT], np.array([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]))
    ahead = scan_of(simulation, "a", (0.0, 0.0, 0.0), 0)
    assert ahead[90] == pytest.approx(3.0 - P2AT.length / 2 - FRONT.x, abs=1e-5)
    assert np.all(scan_of(simulation, "b", (3.0, 0.0, 0.0), 0) == FRONT.range_max)
