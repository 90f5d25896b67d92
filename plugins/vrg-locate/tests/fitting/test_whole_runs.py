"""What whole matches have shown of their robots: reports, calibrations, and the match that was fitted."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.hal.can.calibration import load_calibration
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY, TINY_CAN, located
from vrg_locate.fitting.report import Findings
from vrg_locate.fitting.response import Fitted, Response
from vrg_locate.robots import fitted_match

STRATEGY = """
from vrg.agents import Strategy, Twist


class Mine(Strategy):
    def act(self, view):
        return Twist(v=0.0, w=0.0)
"""


@pytest.fixture
def match(tmp_path: Path) -> Path:
    """A match file that names a strategy and a map in another folder, and a strategy beside it."""
    mine, other = tmp_path / "mine", tmp_path / "other"
    for folder in (mine, other):
        folder.mkdir()
        (folder / "kept_strategy.py").write_text(STRATEGY)
    bounds = "{ x_min = -50.0, y_min = -50.0, x_max = 50.0, y_max = 50.0 }"
    (other / "yard.toml").write_text(f'name = "yard"\nbounds = {bounds}\n')
    text = TINY.replace('map = "open"', 'map = "../other/yard.toml"')
    for player, strategy in (("ann", "kept_strategy.py:Mine"), ("bob", f"{other}/kept_strategy.py:Mine")):
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nstrategy = "{strategy}"')
    (mine / "match.toml").write_text(text)
    return mine / "match.toml"


def test_a_report_tells_what_the_odometry_errs_by_and_writes_a_calibration(tmp_path: Path) -> None:
    more = "[localisation.overhead.errors.ann]\nway = 0.03\nbend = 3.0\n"
    (tmp_path / "tiny.toml").write_text(located(TINY_CAN, "ann", more=more))

    command = ("play", str(tmp_path / "tiny.toml"), "--in-process", "--headless", "--no-record")
    assert invoke(*command, "--runs", str(tmp_path / "runs")).exit_code == 0
    run = str(next((tmp_path / "runs").iterdir()))
    learned = json.loads(invoke("run", "report", run, "--json").output)["learned"]["ann"]
    for what, true in (("way", 0.03), ("turn", 0.0), ("bend", math.radians(3.0))):
        mean, deviation = learned[what]
        assert abs(mean - true) < 4 * deviation
    assert learned["way"][1] < 0.002, "it has driven far enough to know"
    done = invoke("run", "report", run, "--calibrate", "ann", "--output", str(tmp_path / "ann.cal.toml"))
    assert done.exit_code == 0, done.output
    assert "ann: " in done.output
    assert f"{100 * learned['way'][0]:.3f} +- " in done.output
    assert "How it follows commands is not known: how it drove was not recorded" in done.output
    found = load_calibration(tmp_path / "ann.cal.toml", [0, 1])
    assert found.axes[0].ratio > found.axes[1].ratio, "its right wheel is larger"
    assert (found.axes[0].ratio + found.axes[1].ratio) / 2 == pytest.approx(50.0 / 1.03, abs=0.2)
    for player, words in (("bob", "expected a robot that was located (ann)"), ("nemo", "got 'nemo'")):
        refused = invoke("run", "report", run, "--calibrate", player)
        assert isinstance(refused.exception, ConfigError)
        assert words in str(refused.exception)


@pytest.mark.thorough
def test_a_robot_finds_its_own_numbers_by_driving_a_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its motors are weaker, slower and later than the model's, and its wheels larger than VRG believes."""
    motor = "motor = { friction = 0.1, delay = 0.06, current_limit = 10.0, velocity_limit = 44.0 }"
    more = "[localisation.overhead.errors.ann]\nway = 0.03\n"
    text = located(TINY_CAN, "ann", more=more).replace("ratio = 50.0", f"ratio = 50.0\n{motor}")
    (tmp_path / "tiny.toml").write_text(text)
    monkeypatch.chdir(tmp_path)

    command = ("can", "calibrate", "ann", "tiny.toml", "--fixes", "--in-process", "--speed", "0.7", "--for", "30")
    done = invoke(*command)
    assert done.exit_code == 0, done.output
    found = load_calibration(tmp_path / "ann.cal.toml", [0, 1])
    assert found.axes[0].ratio == pytest.approx(50.0 / 1.03, rel=0.02)
    rim = math.tau * 0.11 / 50.0 * 1.03
    torque, inertia = 10.0 * 0.04, 9e-4 * math.tau
    assert found.motion["a_max"] == pytest.approx((torque - 0.1) / inertia * rim, rel=0.1)
    assert found.motion["v_max"] == pytest.approx(44.0 * rim, rel=0.02)
    assert found.motion["delay"] == pytest.approx(0.06 + 0.02, abs=0.015)
    # With its file it plays as it is, and what is left to be found is little.
    (tmp_path / "known.toml").write_text(text.replace(motor, f'{motor}\ncalibration = "ann.cal.toml"'))
    assert load_match(tmp_path / "known.toml").base == str(tmp_path)
    monkeypatch.setattr("vrg.playing.match.plot", lambda *_: None)  # nobody looks at it here
    again = ("play", "known.toml", "--in-process", "--headless", "--runs", str(tmp_path / "again"))
    assert invoke(*again).exit_code == 0
    run = str(next((tmp_path / "again").iterdir()))
    way, half = json.loads(invoke("run", "report", run, "--json").output)["robots"]["ann"]["numbers"]["way"]
    assert abs(way) < 0.01 + half
    fitted = invoke("run", "report", run, "--fitted", "fitted.toml")
    assert fitted.exit_code == 0, fitted.output
    assert load_match(tmp_path / "fitted.toml").player("ann").motion.keys() >= {"delay", "a_max"}
    refused = invoke("run", "report", run, "--fitted", "fitted.toml")
    assert "expected a file that is not there yet" in str(refused.exception)
    (tmp_path / "alone.toml").write_text(TINY_CAN)
    refused = invoke("can", "calibrate", "ann", "alone.toml", "--fixes")
    assert 'expected `localisation = "fusion"` at ann' in str(refused.exception)


def test_a_fitted_match_is_the_one_that_was_played_with_the_files_that_were_kept(match: Path, tmp_path: Path) -> None:
    setup, folder = load_match(match), RunFolder(tmp_path / "run")
    folder.prepare()
    keep(setup, folder)
    match.write_text("it is another one by now")
    shutil.rmtree(tmp_path / "other")
    response = Response(delay=0.125, acceleration=1.0, braking=1.0, top=1.0)
    known = Fitted(response, seen=["delay"], covariance=np.zeros((1, 1)), freedom=10)
    found = Findings({"way": (0.0, 0.0)}, known, likeness=None)
    (match.parent / "fitted.toml").write_text(fitted_match(setup, {"ann": found}, folder))
    fitted = load_match(match.parent / "fitted.toml")
    assert fitted.player("bob").strategy == f"{folder.path}/files/1/kept_strategy.py:Mine"
    assert fitted.player("ann").motion == {"delay": 0.125}
