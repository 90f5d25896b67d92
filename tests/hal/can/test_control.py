"""`vrg can stop` and `vrg can address` on a bus within this process, where something is not as it should be."""

import pytest
from click.testing import Result
from typer.testing import CliRunner

from tests.hal.can.bench import PATIENCE, CanBench, Drives
from vrg.commands import can_control
from vrg.commands.can import app
from vrg.errors import RobotError
from vrg.hal.can.link import Link
from vrg.hal.can.train import DriveTrain
from vrg.hal.can.workshop.simulation import Simulation
from vrg.testing.driver import arm

LINK = Link(interface="virtual", channel="control")


pytestmark = pytest.mark.usefixtures("simulated")


def run(command: str, *arguments: str) -> Result:
    """Run a command of `vrg can`."""
    return CliRunner().invoke(app, [command, *arguments, "--interface", LINK.interface, "--channel", LINK.channel])


def test_nobody_who_says_that_his_motor_is_off_is_no_success() -> None:
    done = run("stop")
    assert done.exit_code == 1
    assert "no drive reports that its motor is off: is it the right bus" in " ".join(done.output.split())


def test_all_who_say_it_are_named() -> None:
    with Drives("odrive", [3], link=LINK), Drives("vesc", [4], link=LINK):
        done = run("stop")
    assert done.exit_code == 0, done.output
    assert "Off by their own reports: odrive 3, vesc 4." in " ".join(done.output.split())


def test_a_drive_whose_motor_is_on_keeps_its_id(lab: Simulation) -> None:
    with Drives("odrive", [0, 1], watchdog=PATIENCE, link=LINK) as drives:
        bench = CanBench("odrive", [0], [1], link=LINK, watchdog="unsafe")
        try:
            bench.driver.connect()
            arm(bench)
            done = run("address", "--id", "1", "44")
        finally:
            bench.close()
        assert isinstance(done.exception, RobotError)
        assert "odrive 1: expected a motor that is off: `vrg can stop`" in str(done.exception)
        assert [drive.node for drive in drives.drives] == [0, 1]
        off = lab.clock.wait(lambda: not any(drive._energised for drive in drives.drives), PATIENCE)
        assert off, "closing the robot switches it off"


def test_a_motor_that_hardly_turns_is_told() -> None:
    with Drives("vesc", [4], watchdog=PATIENCE, link=LINK):
        done = run("jog", "--protocol", "vesc", "--option", "pole_pairs=7", "--unsafe", "--id", "4", "--for", "0.6")
    assert isinstance(done.exception, RobotError), done.output
    assert "asked for 1 turn/s for 0.6 s and has hardly turned" in str(done.exception)


def test_a_jog_on_a_busy_computer_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    spin, late = DriveTrain.spin, [0.5]

    def spin_late(train: DriveTrain, node: int, velocity: float) -> None:
        if train.state().speeds[0] and late:
            train.clock.sleep(late.pop())
        spin(train, node, velocity)

    monkeypatch.setattr(DriveTrain, "spin", spin_late)
    with Drives("odrive", [3], link=LINK):
        done = run("jog", "--id", "3", "--for", "3")
    assert done.exit_code == 0, done.exception
    assert not late
    assert "It has turned by +" in done.output


@pytest.mark.parametrize(("protocol", "args"), [("odrive", ()), ("moteus", ("--protocol", "moteus"))])
def test_after_another_id_was_given_the_old_one_is_not_listed(protocol: str, args: tuple[str, ...]) -> None:
    with Drives(protocol, [3, 7], link=LINK):
        done = run("address", "--id", "3", "9", *args)
    assert done.exit_code == 0, done.exception
    rows = [line.split()[1] for line in done.output.splitlines() if line.startswith(protocol)]
    assert rows == ["7", "9"]
    assert "silent" not in done.output


def test_the_name_of_a_bus_is_no_picture() -> None:
    done = CliRunner().invoke(app, ["scan", "--interface", "virtual", "--channel", "x:", "--for", "0.3"])
    assert "virtual:x:: no drives" in done.output


def test_a_missing_watchdog_is_told_as_soon_as_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(can_control, "_JOG_START", 3600.0)
    with Drives("odrive", [3], watchdog=0.0, link=LINK):
        done = run("jog", "--id", "3")
    assert isinstance(done.exception, RobotError), done.output
    assert "its own watchdog has not stopped it" in str(done.exception)


def test_a_fault_is_asked_for_and_answered() -> None:
    with Drives("moteus", [5], link=LINK):
        assert run("fault", "block", "--id", "5").output == "node 5: block (its wheel is blocked)\n"
        refused = run("fault", "estop", "--id", "5")
        silent = run("fault", "silence", "--id", "6")
    assert refused.exit_code == silent.exit_code == 1
    assert "node 5: a drive of its protocol cannot have this fault" in refused.output
    assert "node 6: not emulated on virtual:control" in silent.output
