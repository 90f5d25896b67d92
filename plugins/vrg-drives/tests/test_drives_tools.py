"""`vrg can ...` with drives of these protocols as a user types it, on vcan0."""

import re
import subprocess
import sys
from collections.abc import Callable

import pytest
from can_tools import LATE, ON, PATIENCE, monitored, told, turn, vrg

from vrg.hal.can.bus import CanBus
from vrg.hal.clock import REAL_CLOCK
from vrg.testing.can.vcan import VCAN
from vrg.testing.waiting import wait_until
from vrg_drives.cia402.codec import NODE_MASK, Function
from vrg_drives.moteus.drive import MoteusListener

pytestmark = [pytest.mark.system, pytest.mark.vcan, pytest.mark.thorough]


def test_monitor_only_listens_to_canopen(node: Callable[..., object]) -> None:
    node("--protocol", "cia402", "--id", "9")
    shown, heard = monitored()
    assert "pre-operational" in shown
    assert [f for f in heard if f.remote or f.id == Function.NMT or f.id & ~NODE_MASK == Function.SDO_REQUEST] == []


def test_a_drive_is_turned_stopped_and_given_another_id(node: Callable[..., object]) -> None:
    node("--protocol", "moteus", "--id", "5", "--id", "6", "--serial", "4660")
    turned = turn("can", "jog", *ON, "--protocol", "moteus", "--id", "5", "--speed", "-4", "--for", "1")
    assert turned.returncode == 0, turned.stdout + turned.stderr
    # Backwards, and no farther than asked: where commands come late, the drive's watchdog stops it in between.
    assert -6.0 < told(r"turned by ([-+\d.]+) turns", turned) < -0.5
    jog = [sys.executable, "-m", "vrg", "can", "jog", *ON, "--protocol", "moteus", "--id", "5", "--for", "60"]
    listener = MoteusListener(lambda _: None, REAL_CLOCK)
    bus = CanBus(VCAN, listener.hear)
    bus.start()
    going = subprocess.Popen(jog, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    wait_until(lambda: 5 in listener.found and listener.found[5].velocity > 0.5, "the motor to turn")
    bus.stop()
    stopped = vrg("can", "stop", *ON)
    assert stopped.returncode == 0, stopped.stdout + stopped.stderr
    assert "moteus 5, moteus 6" in " ".join(stopped.stdout.split())
    said, _ = going.communicate(timeout=PATIENCE)
    assert going.returncode == 1
    # On a slow machine what it hears of the stop, or what it sends, may come too late, which ends it, too; and an
    # emulated drive that was held up goes on from where it would be by then.
    assert re.search(f"another program commands it too|{LATE}|its position jumped by", " ".join(said.split())), said
    vrg("can", "fault", "error", *ON, "--id", "6")
    assert "motor driver fault" in vrg("can", "scan", *ON).stdout
    assert vrg("can", "clear", *ON, "--id", "6").returncode == 0
    assert vrg("can", "address", "5", *ON, "--protocol", "moteus", "--id", "6").returncode == 1, "it is taken"
    assert vrg("can", "address", "9", *ON, "--protocol", "moteus", "--serial", "1235").returncode == 0
    assert re.search(r"moteus +9 +1235", vrg("can", "scan", *ON).stdout)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("node", "drives", *ON, "--protocol", "cia402", "--id", "0"), "--id: "),
        (("can", "jog", *ON, "--id", "9", "--protocol", "vesc", "--option", "poles=7"), "--option: poles"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], words: str) -> None:
    done = vrg(*arguments)
    assert done.returncode in (1, 2)
    assert words in " ".join((done.stdout + done.stderr).replace("│", " ").split())
    assert "Traceback" not in done.stderr
