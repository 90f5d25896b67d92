"""The table [backends.can] and calibration files: good ones are read, each mistake is said in words."""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from vrg.errors import ConfigError
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import (
    AxisCalibration,
    Calibration,
    calibration_text,
    load_calibration,
)
from vrg.hal.can.link import Link
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.workshop.emulation import Emulation
from vrg.hal.models.pioneer import P2AT

SUE = {"left": [0], "right": [1], "ratio": 50.0}
BOB = {"left": [2, 3], "right": [4, 5]}


def table(**changes: Any) -> dict[str, Any]:
    return {"channel": "can0", "robots": {"sue": SUE, "bob": BOB}, **changes}


def test_a_good_table() -> None:
    settings = CanSettings.model_validate(table(emulate=True, bitrate=250_000))
    assert settings.link("sue") == Link(interface="socketcan", channel="can0", bitrate=250_000)
    assert settings.problems({"sue": P2AT, "bob": P2AT}, Path()) == []
    assert settings.robots["bob"].wheel_axes(("left", "right"), None) == [
        WheelAxis(2, 0), WheelAxis(3, 0), WheelAxis(4, 1), WheelAxis(5, 1),
    ]  # fmt: skip
    (companion,) = Emulation(settings).companions(["sue", "bob"])
    (again,) = Emulation(settings).companions(["sue", "bob"])
    assert again == companion, "drives that are started again are the same ones"
    assert companion.arguments == (
        "node", "drives", "--interface", "socketcan", "--channel", "can0", "--bitrate", "250000",
        "--protocol", "odrive", "--serial", companion.arguments[11],
        "--id", "0", "--id", "1", "--id", "2", "--id", "3", "--id", "4", "--id", "5",
    )  # fmt: skip


def test_only_the_robots_that_play_are_emulated() -> None:
    settings = CanSettings.model_validate(table(emulate=True))
    (companion,) = Emulation(settings).companions(["bob"])
    assert "0" not in companion.arguments
    assert CanSettings.model_validate(table()).emulation is None


def test_a_robot_may_be_on_a_bus_of_its_own() -> None:
    robots = {"sue": SUE, "bob": {"left": [0], "right": [1], "channel": "can1"}}
    settings = CanSettings.model_validate(table(robots=robots, emulate=True))
    assert settings.link("bob").channel == "can1"
    assert [c.name for c in Emulation(settings).companions(["sue", "bob"])] == ["drives", "drives-2"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"protocol": "morse"}, "expected one of .*odrive.*, got 'morse'"),
        ({"bitrate": 3}, "greater than or equal to 10000"),
        ({"robots": {"sue": {**SUE, "axes": {"back": [2]}}}}, "either `left` and `right` or `axes`"),
        ({"robots": {"sue": {"axes": {"back": [], "left": [1]}}}}, "a motor for each axis, got none for back"),
        ({"robots": {"sue": {"axes": {"back": [1], "left": [1]}}}}, "an id of its own for every motor"),
        ({"robots": {"sue": {**SUE, "right": [0]}}}, "an id of its own for every motor"),
        ({"robots": {"sue": {**SUE, "right": [1, 2]}}}, "as many motors left as right, got 1 and 2"),
        ({"robots": {"sue": {**SUE, "left": []}}}, "as many motors left as right, got 0 and 1"),
        ({"robots": {"sue": {**SUE, "left": [0, 2, 3], "right": [1, 4, 5]}}}, "at most 2 items"),
        ({"robots": {"sue": {**SUE, "left": [63]}}}, "expected 0 to 62, got 63"),
        ({"robots": {"sue": SUE, "bob": SUE}}, "bob: node 0 on can0 already belongs to sue"),
        ({"robots": {"sue": {**SUE, "bitrate": 125_000}, "bob": SUE}}, "bob: node 0 on can0 already belongs to sue"),
        ({"robots": {"sue": {**SUE, "ratio": 0}}}, "greater than 0"),
        ({"robots": {"sue": {**SUE, "supply": [25.0, 20.0]}}}, r"supply\n.*, expected the voltage of an empty"),
        ({"interface": "sockecan"}, "expected one of .*, got 'sockecan', did you mean 'socketcan'"),
        ({"robots": {"sue": {**SUE, "interface": "slcam"}}}, "got 'slcam', did you mean 'slcan'"),
        ({"robots": {"sue": {**SUE, "speed": 3}}}, "Extra inputs are not permitted"),
        ({"emulated": True}, "Extra inputs are not permitted"),
    ],
)
def test_mistakes_are_said(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        CanSettings.model_validate(table(**changes))


def test_all_mistakes_of_a_robot_are_said_at_once() -> None:
    sue = {"left": [0], "right": [1], "ratio": -1.0, "reversed": [7], "supply": [25.0, 20.0], "interface": "slcam"}
    with pytest.raises(ConfigError) as caught:
        CanSettings.read("can", table(robots={"sue": sue}))
    assert [problem.path[-1] for problem in caught.value.problems] == ["ratio", "reversed", "supply", "interface"]
    assert "expected ids of [0, 1], got [7]" in str(caught.value)


def test_a_robot_without_wiring_and_a_missing_calibration_are_problems(tmp_path: Path) -> None:
    robots = {"sue": {**SUE, "calibration": "sue.toml"}}
    problems = CanSettings.model_validate(table(robots=robots)).problems({"sue": P2AT, "ann": P2AT}, tmp_path)
    assert len(problems) == 2
    assert "expected a calibration file" in problems[0]
    assert "[backends.can.robots.ann]" in problems[1]


def test_motors_and_outputs_of_what_the_model_lacks_are_problems_all_at_once() -> None:
    outputs = {"kicker": {"drive": 2, "bit": 16, "pulse": 0.01}, "gripper": {"drive": 3, "bit": 17}}
    axes = {"front_left": [6], "front_right": [7], "rear_left": [8], "rear_right": [9]}
    wired = {"sue": {**BOB, "outputs": outputs}, "ann": {"axes": axes}}
    settings = CanSettings.model_validate(table(robots=wired, protocol="cia402"))
    found = settings.problems({"sue": P2AT, "ann": P2AT}, Path())
    assert [text.partition(":")[0] for text in found] == ["robots.sue", "robots.sue", "robots.ann"]
    assert "kicker: the model of sue has no actuators" in found[0]
    assert "expected the motors of the axes left, right of this model" in found[2]


@given(
    st.floats(0.02, 9.0),
    st.dictionaries(st.integers(0, 62), st.tuples(st.sampled_from([1, -1]), st.floats(0.01, 1e4)), min_size=1),
)
def test_a_calibration_survives_its_file(track: float, axes: dict[int, tuple[int, float]]) -> None:
    written = Calibration(
        robot="sue",
        track=track,
        axes={n: AxisCalibration(direction=d, ratio=r, serial=f"{n:X}" * (n % 2)) for n, (d, r) in axes.items()},
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sue.toml"
        path.write_text(calibration_text(written))
        read = load_calibration(path, list(axes))
    assert read.robot == "sue"
    assert read.track == pytest.approx(track, rel=1e-5)
    for node, (direction, ratio) in axes.items():
        assert read.axes[node].direction == direction
        assert read.axes[node].ratio == pytest.approx(ratio, rel=1e-7)
        assert read.axes[node].serial == f"{node:X}" * (node % 2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("not toml at all", "expected a calibration file"),
        ('robot = "sue"\ntrack = 0.5\n[axes.0]\ndirection = 1\nratio = 50\n', r"expected nodes \[0, 1\].*got \[0\]"),
        ('robot = "sue"\ntrack = 0.5\n[axes.0]\ndirection = 2\nratio = 50\n', "expected 1 or -1, got 2"),
        ('robot = "sue"\ntrack = -1\n[axes]\n', "expected more than 0.01, got -1"),
    ],
)
def test_a_bad_calibration_file(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "sue.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=words):
        load_calibration(path, [0, 1])


def test_a_calibration_stands_above_the_ratio(tmp_path: Path) -> None:
    settings = CanSettings.model_validate(table())
    found = Calibration(
        robot="sue",
        track=0.6,
        axes={0: AxisCalibration(direction=-1, ratio=49.0), 1: AxisCalibration(direction=1, ratio=51.0)},
    )
    assert settings.robots["sue"].wheel_axes(("left", "right"), found) == [
        WheelAxis(0, 0, -1, 49.0),
        WheelAxis(1, 1, 1, 51.0),
    ]
