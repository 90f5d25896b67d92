"""`vrg can ...` as a user types it, on vcan0."""

import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from can_tools import ON, PATIENCE, monitored, told, turn, vrg

from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.hal.models import robot_model
from vrg.testing.can.vcan import VCAN
from vrg.testing.processes.match import match_text
from vrg.testing.waiting import wait_until

pytestmark = [pytest.mark.vcan, pytest.mark.thorough]

MATCH = match_text("cal", length=13.0, width=9.0, zone=2.5, wiring={"ann": (0, 1)}, link=VCAN, can="")
CALIBRATED = MATCH.replace("ratio = 50.0", 'calibration = "ann.cal.toml"')


def test_scan_tells_who_is_there(node: Callable[..., object]) -> None:
    node("--id", "0", "--id", "5", "--serial", "4660")
    node("--id", "3", "--serial", "170")
    node("--id", "3", "--serial", "187")
    vrg("can", "fault", "error", *ON, "--id", "5", "--value", "0x2200")
    done = vrg("can", "scan", *ON)
    assert done.returncode == 0, done.stderr
    rows = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert any(row.startswith("odrive 0 1234 0.6.11 IDLE") for row in rows), done.stdout
    text = " ".join(done.stdout.split())
    assert "1235" in text
    assert "odrive 5: DC_BUS_UNDER_VOLTAGE, MOTOR_OVER_TEMP" in text
    assert "odrive 3: 2 drives have this id: AA, BB" in text
    assert "24.0" in text


def test_monitor_shows_a_drive_that_falls_silent(node: Callable[..., object]) -> None:
    node("--id", "2")
    command = [sys.executable, "-m", "vrg", "can", "monitor", *ON, "--ask"]
    version, heartbeat = (codec.request(2, what).id for what in (messages.Command.VERSION, messages.Command.HEARTBEAT))
    heard, last = [], time.monotonic()

    def hear(frame: Frame) -> None:
        nonlocal last
        heard.append(frame)
        if frame.id == heartbeat and not frame.remote:
            last = time.monotonic()

    bus = CanBus(VCAN, hear)
    bus.start()
    monitor = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    wait_until(lambda: any(f.id == version and f.remote for f in heard), "the monitor to have found the drive")
    vrg("can", "fault", "silence", *ON, "--id", "2", "--for", "60")
    wait_until(lambda: time.monotonic() - last > 5.0, "the drive to be silent", patience=PATIENCE)
    bus.stop()
    monitor.send_signal(signal.SIGINT)
    out, _ = monitor.communicate(timeout=PATIENCE)
    assert "no heartbeat for" in out


def test_monitor_only_listens(node: Callable[..., object]) -> None:
    node("--id", "2")
    shown, heard = monitored()
    assert "IDLE" in shown
    assert [f for f in heard if f.remote] == []


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_node_stops_when_it_is_told(node: Callable[..., "subprocess.Popen[bytes]"], how: signal.Signals) -> None:
    process = node("--id", "1")
    process.send_signal(how)
    assert process.wait(PATIENCE) == (130 if how is signal.SIGINT else 0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("node", "drives", "--channel", "vcan77", "--id", "0"), "vcan77: no such CAN interface on this machine"),
        (("can", "scan", "--channel", "vcan77"), "vcan77: no such CAN interface on this machine"),
        (("can", "scan", *ON, "--for", "0.5"), "no drives"),
        (("node", "drives", *ON, "--id", "64"), "expected 0 to 62, got 64"),
        (("can", "jog", *ON, "--id", "9"), "expected a heartbeat of odrive node 9"),
        (("can", "jog", *ON, "--id", "9", "--speed", "90"), "expected from -20 to 20 turns per second, and not 0"),
        (("can", "clear", *ON, "--id", "9"), "expected drives with ids 9, heard none"),
        (("can", "address", "5", *ON, "--id", "9"), "expected one drive with id 9"),
        (("can", "scan", *ON, "--adapter", "fd"), "--adapter: expected NAME=VALUE"),
        (("can", "fault", "error", *ON, "--id", "0", "--value", "much"), "expected a whole number"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], words: str) -> None:
    done = vrg(*arguments)
    assert done.returncode in (1, 2)
    assert words in " ".join((done.stdout + done.stderr).replace("│", " ").split())
    assert "Traceback" not in done.stderr


def test_calibrate_writes_a_file_that_the_robot_then_uses(node: Callable[..., object], tmp_path: Path) -> None:
    node("--id", "0", "--id", "1")
    match = tmp_path / "match.toml"
    match.write_text(MATCH, encoding="utf-8")
    # Jacked up; the left wheel turns right, the other the wrong way round; 0.4 m by odometry were 0.5 m; the turn was
    # as expected.
    answers = "\ny\nn\n\n0.5\ny\n\n90\ny\n"
    quick = ("--way", "0.4", "--turns", "0.25", "--speed", "0.3")
    done = turn("can", "calibrate", "ann", str(match), *quick, said=answers)
    assert done.returncode == 0, done.stdout + done.stderr
    written = tomllib.loads((tmp_path / "ann.cal.toml").read_text())
    assert written["robot"] == "ann"
    assert written["axes"]["0"]["direction"] == 1
    assert written["axes"]["1"]["direction"] == -1
    # How far it went beyond what was asked for depends on how busy this computer is.
    assert written["axes"]["0"]["ratio"] == pytest.approx(50.0 * told(r"it went ([\d.]+) m", done) / 0.5, rel=0.01)
    assert written["axes"]["1"]["ratio"] == written["axes"]["0"]["ratio"]
    turned = told(r"it turned ([\d.]+) degrees", done)
    assert written["track"] == pytest.approx(robot_model("P2AT").drivetrain.effective_track * turned / 90.0, rel=0.01)
    assert 'calibration = "ann.cal.toml"' in done.stdout

    # The file is used: asked to go ahead, the motors now turn against one another.
    match.write_text(CALIBRATED, encoding="utf-8")
    assert vrg("check", str(match)).returncode == 0
    frames: list[Frame] = []
    bus = CanBus(VCAN, frames.append)
    bus.start()
    again = turn("can", "calibrate", "ann", str(match), *quick, said="\ny\ny\n\n0.4\ny\n\n90\ny\n")
    bus.stop()
    assert again.returncode == 0, again.stdout + again.stderr
    speeds = {0: [0.0], 1: [0.0]}
    for frame in frames:
        if codec.command_of(frame.id) == messages.Command.SET_INPUT_VEL and not frame.remote:
            message = codec.decode(frame)
            assert isinstance(message, messages.SetInputVel)
            speeds[codec.node_of(frame.id)].append(message.velocity)
    assert max(speeds[0]) > 10.0
    assert min(speeds[1]) < -10.0


def test_a_calibration_file_that_does_not_fit_is_said_before_a_match(tmp_path: Path) -> None:
    match = tmp_path / "match.toml"
    match.write_text(CALIBRATED, encoding="utf-8")
    (tmp_path / "ann.cal.toml").write_text('robot = "ann"\ntrack = 0.5\n[axes.7]\ndirection = 1\nratio = 50\n')
    done = vrg("check", str(match))
    assert done.returncode == 1
    assert "expected nodes [0, 1], as wired, got [7]" in done.stderr
