"""Strangers' code does not find the environment variables of who has started it."""

import re
import sys
from pathlib import Path

import pytest

from vrg.launch.sandbox.variables import named_variables
from vrg.testing.processes.match import long_match
from vrg.testing.processes.sealed import check_unknown

VRG = (sys.executable, "-m", "vrg")


def match(place: Path) -> str:
    """A match file whose players are sealed."""
    file = place / "match.toml"
    text = re.sub(
        r'^name = "(shark|ann|bob|cid)"$', r'\g<0>\nstrategy = "stuck.py:Own"', long_match("stuck"), flags=re.MULTILINE
    )
    file.write_text(f"sandbox = true\n{text}")
    return str(file)


def test_what_a_process_needs_is_named_and_tokens_are_not() -> None:
    kept = {"PATH": "/bin", "LC_ALL": "C", "HOME": "/", "XDG_STATE_HOME": "/s", "LD_LIBRARY_PATH": "/lib"}
    assert named_variables(kept | {"CI_TOKEN": "x", "AWS_SECRET_ACCESS_KEY": "y", "PATHS": "z"}) == kept


@pytest.mark.system
@pytest.mark.parametrize("way", [[], ["--lockstep"]], ids=["processes", "lockstep"])
def test_a_player_of_a_match_does_not_find_them(tmp_path: Path, way: list[str]) -> None:
    check_unknown([*VRG, "play", match(tmp_path), "--headless", *way], tmp_path, "vrg strategy")


@pytest.mark.system
def test_a_player_that_is_started_by_hand_does_not_find_them(tmp_path: Path) -> None:
    command = ["node", "player", "ann", match(tmp_path), "--router", "tcp/127.0.0.1:1"]
    check_unknown([*VRG, *command], tmp_path, "vrg strategy")
