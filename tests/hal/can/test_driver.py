"""The driver of CAN robots keeps the contract of drivers, and what it tells beyond, on a bus within this process."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec.structs import astuple

from vrg.bus.messages import SensorMessage
from vrg.errors import ConfigError, StaleDataError
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.link import Link
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.testing.can.bench import HERE, NODES, PATIENCE, CanBench, Drives, Lab, settings
from vrg.testing.driver import DriverContract
from vrg.testing.omni import OMNI
from vrg.types import Twist

LINK = Link(interface="virtual", channel="driver")
P2AT = robot_model("P2AT")
BARE = replace(P2AT, sensors=tuple(spec for spec in P2AT.sensors if not isinstance(spec, EncodersSpec)))
NOW = 1000.0


@pytest.fixture(autouse=True)
def drives() -> Iterator[Drives]:
    with Drives("odrive", [0, 1], link=LINK) as drives:
        yield drives


def driver(model: RobotModel = P2AT, **wiring: object) -> CanDriver:
    options = settings("odrive", [0], [1], LINK, **wiring)
    return CanDriver(DriverContext(name="r", model=model, options=options, now=lambda: NOW), Lab.simulation)


def go(robot: CanDriver, twist: Twist, ticks: int) -> None:
    """Arm it, and drive."""
    while not robot.read().armed:
        robot.arm()
        Lab.simulation.clock.sleep(0.05)
    for _ in range(ticks):
        robot.drive(twist)
        Lab.simulation.clock.sleep(0.05)


def until(condition: Callable[[], object]) -> None:
    assert Lab.simulation.clock.wait(condition, PATIENCE), "it has not come about"


def test_the_battery_is_unknown_until_a_drive_has_told_its_voltage() -> None:
    Lab.simulation.clock.sleep(0.1)  # the drives tell it once a second, and have just told it
    with driver(supply=(20.0, 25.0)) as robot:
        assert robot.read().latest(Battery) is None
        until(lambda: robot.read().latest(Battery))
        sample = robot.read().latest(Battery)
        assert sample is not None
        assert sample.value.charge == pytest.approx(0.8)
        assert sample.stamp == pytest.approx(NOW - sample.age)
        assert 0.0 <= sample.age < 2.0


def test_every_sample_has_its_own_age() -> None:
    with driver() as robot:
        until(lambda: robot.read().latest(Battery))
        Lab.simulation.clock.sleep(0.3)
        readings = robot.read()
        battery, odometry = readings.latest(Battery), readings.latest(Odometry)
        assert battery is not None
        assert odometry is not None
        assert battery.age > 0.2 > odometry.age
        assert readings.stamp == pytest.approx(NOW - readings.age)


@pytest.mark.parametrize(("model", "kind"), [(P2AT, Touch), (BARE, Encoders)], ids=["bumpers", "no encoders"])
def test_what_nobody_reads_is_unknown(model: RobotModel, kind: type[SensorMessage]) -> None:
    with driver(model) as robot:
        assert robot.features.sensor(TouchSpec)
        assert robot.read().latest(kind) is None
        assert robot.read().latest(Odometry) is not None


def test_one_that_was_closed_has_no_readings() -> None:
    robot = driver()
    robot.connect()
    assert robot.read().latest(Odometry)
    robot.close()
    with pytest.raises(StaleDataError, match="r: expected a connected robot"):
        robot.read()


def test_a_calibration_gives_the_track(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(
        'robot = "r"\ntrack = 0.75\n[axes.0]\ndirection = 1\nratio = 50\n[axes.1]\ndirection = -1\nratio = 50\n'
    )
    options = settings("odrive", [0], [1], LINK, calibration="r.toml")
    robot = CanDriver(DriverContext(name="r", model=P2AT, options=options, base=tmp_path))
    assert robot.features.drivetrain.effective_track == pytest.approx(0.75)


def omni(wired: dict[str, list[int]]) -> CanDriver:
    options = settings("odrive", [0], [1], LINK)
    wiring = options["robots"]["r"]
    del wiring["left"], wiring["right"]
    wiring["axes"] = wired
    return CanDriver(DriverContext(name="r", model=OMNI, options=options, now=lambda: NOW), Lab.simulation)


def test_a_robot_on_omni_wheels_drives_sideways_by_the_motors_of_its_axes() -> None:
    twist = Twist(0.1, 0.0, 0.2)
    with Drives("odrive", [2], link=LINK), omni({"left": [0], "back": [2], "right": [1]}) as robot:
        go(robot, twist, 40)
        odometry = robot.read().latest(Odometry)
        assert odometry is not None
        assert astuple(odometry.value.twist) == pytest.approx(astuple(twist), abs=0.02)
        assert odometry.value.pose.y == pytest.approx(2 * odometry.value.pose.x, rel=0.1)
        assert odometry.value.pose.y > 0.2


def test_motors_of_other_axes_than_the_models_are_refused_by_name() -> None:
    with pytest.raises(ConfigError, match=r"motors of the axes left, back, right of this model, got left, rear"):
        omni({"left": [0], "rear": [2]})


def test_an_axis_with_a_bug_keeps_no_other_motor_on(monkeypatch: pytest.MonkeyPatch, drives: Drives) -> None:
    with driver() as robot:
        go(robot, Twist(0.3, 0.0), 20)
        assert abs(drives.drives[1].motor.velocity) > 5.0

        def broken(self: OdriveAxis) -> None:
            if self.node == 0:
                raise ValueError("a bug")
            real(self)

        real = OdriveAxis.stop_now
        monkeypatch.setattr(OdriveAxis, "stop_now", broken)
        robot.emergency_stop()
        Lab.simulation.clock.sleep(0.15)
        assert abs(drives.drives[1].motor.velocity) < 1.0, "sooner than by its watchdog"
        assert "a bug" in (robot.read().fault or "")


def test_a_robot_without_wiring_cannot_be_made() -> None:
    options = settings("odrive", [0], [1])
    with pytest.raises(ConfigError, match=r"ann: expected its wiring in \[backends.can.robots.ann\]"):
        CanDriver(DriverContext(name="ann", model=P2AT, options=options))


def test_a_bad_table_is_said_field_by_field() -> None:
    with pytest.raises(ConfigError) as error:
        driver(ratio=0, speed=3)
    assert [problem.path for problem in error.value.problems] == [
        ("backends", "can", "robots", "r", "ratio"),
        ("backends", "can", "robots", "r", "speed"),
    ]


class TestTwoAxes(DriverContract):
    """One motor on each side, once with the drives of each protocol."""

    @pytest.fixture(params=NODES)
    def bench(self, request: pytest.FixtureRequest) -> Iterator[CanBench]:
        with Drives(request.param, link=HERE), CanBench(request.param, link=HERE) as bench:
            yield bench


class TestOdriveFourAxes(DriverContract):
    """Four motors on one bus, two on each side."""

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        with Drives("odrive", [0, 1, 2, 3]), CanBench("odrive", [0, 1], [2, 3]) as bench:
            yield bench
