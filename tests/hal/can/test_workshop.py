"""The workshop is for people who look at a bus: a match with real drives never loads it."""

import subprocess
import sys

import pytest

from vrg.hal.can.protocols import PROTOCOLS
from vrg.testing.can.bench import NODES

DRIVE = """
import sys
import vrg.hal.can.bus
from vrg.hal.can.driver import CanDriver
from vrg.hal.clock import RealClock
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.hal.can.meeting import Meeting, MeetingStep
from vrg.hal.can.protocols import PROTOCOLS

class Medium:
    clock = RealClock()

    def bus(self, link, on_frame, on_trouble, on_quiet):
        return Bus()

class Bus:
    link = "a bus whose drives answer nothing"
    def start(self): pass
    def stop(self): pass
    def restart(self): pass
    def listen_to(self, wanted): pass
    def send(self, frame, *, urgent=False): pass

wiring = {{"left": {left}, "right": {right}, "options": {options}}}
table = {{"interface": "virtual", "channel": "x", "protocol": "{protocol}", "robots": {{"r": wiring}}}}
context = DriverContext(name="r", model=robot_model("P2AT"), options=table, now=lambda: 0.0)
Meeting.step = lambda self, now: MeetingStep.SET_UP
PROTOCOLS.get("{protocol}").axis_type.prepare = lambda self: None
driver = CanDriver(context, Medium())
driver.connect()
driver.disarm()
driver.close()
own = [name for name in sys.modules if name.startswith("vrg")]
print(*(name for name in own if "workshop" in name or name.endswith((".drive", ".listener"))))
"""


def test_neither_the_launcher_nor_the_fork_server_of_a_match_has_any() -> None:
    code = "import sys, vrg.commands.playing, vrg.launch.fork_server, vrg.launch.nodes, vrg.launch.process_main\n"
    code += "print(*(name for name in sys.modules if 'workshop' in name))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("protocol", NODES)
def test_a_process_that_opens_a_driver_has_none_of_it(protocol: str) -> None:
    left, right = NODES[protocol]
    code = DRIVE.format(
        protocol=protocol, left=left, right=right, options=dict(PROTOCOLS.get(protocol).drive_type.wiring)
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []
