"""A program that has nothing of VRG listens to a match and drives a robot: examples/outside.py."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from vrg.bus.messages import Clock, Poses, RefereeState
from vrg.testing.processes.match import LiveMatch

pytestmark = pytest.mark.system

PROGRAM = Path(__file__).parents[2] / "examples" / "outside.py"


def test_it_needs_only_zenoh_and_messagepack() -> None:
    tree = ast.parse(PROGRAM.read_text(encoding="utf-8"))
    named = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    named |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name for name in named if name.split(".")[0] not in sys.stdlib_module_names} == {"zenoh", "msgpack"}


def test_it_reads_the_messages_of_today() -> None:
    cases = re.findall(r'case "([a-z/]+)", (\d+):', PROGRAM.read_text(encoding="utf-8"))
    versions = {key: int(version) for key, version in cases}
    assert versions == {"clock": Clock.version, "referee/state": RefereeState.version, "poses": Poses.version}


def test_it_hears_the_match_and_drives_a_robot(match: LiveMatch) -> None:
    observer = match.observer
    command = [sys.executable, "-I", str(PROGRAM), match.keys.match, "bob", "--router", match.endpoint]
    with subprocess.Popen([*command, "--seconds", "600"], stdout=subprocess.PIPE, text=True) as program:
        try:
            observer.wait_until(lambda: observer.heard.reports["bob"][-1].body.manual, "the program to hold the lease")
            observer.wait_until(lambda: observer.body("bob").twist.w > 0.2, "its robot to turn")
            assert program.stdout is not None
            # It prints a line each second, also while it has not heard of the players yet.
            while "play_round" not in (line := program.stdout.readline()):
                assert line, "it prints how the match stands until it is ended"
            assert "bob at (" in line
        finally:
            program.terminate()
    observer.wait_until(lambda: not observer.heard.reports["bob"][-1].body.manual, "the lease to end")
    observer.wait_moving("bob")
