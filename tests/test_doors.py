"""What only Linux has: VRG does without it on other systems, of which there are none to test on.

Nothing here proves that VRG runs there. It proves that VRG uses nothing that these systems are known to lack.
"""

from pathlib import Path

import pytest

from tests.doors import SYSTEMS, play_and_judge, python_on

IMPORT_ALL = """
import importlib, pkgutil, sys
from importlib.util import find_spec
import vrg

for found in pkgutil.walk_packages(vrg.__path__, "vrg.", onerror=lambda name: None):
    lacks = found.name.endswith("engines.pybullet") and find_spec("pybullet") is None
    if not found.name.endswith(".__main__") and not lacks:
        try:
            importlib.import_module(found.name)
        except ImportError as error:
            # Not every Python has wheels of all packages.
            if isinstance(error, ModuleNotFoundError) and error.name in sys.argv[1:]:
                continue
            print(f"{found.name}: {error}")
"""
NOT_EVERYWHERE = ("pybullet", "pybullet_data", "pygame", "ray", "motioncapture")

LOCKED = """
from pathlib import Path
from vrg.coordinator.journal import Journal, JournalHeader
from vrg.errors import JournalError

header = JournalHeader(match="m", game="g", seed=1)
with Journal(Path("journal.jsonl"), header):
    try:
        Journal(Path("journal.jsonl"), header)
    except JournalError as error:
        print(error)
with Journal(Path("journal.jsonl"), header):
    print("free")
"""

LISTED = """
import os
from vrg.launch import running

match = running.RunningMatch("m", "tcp/127.0.0.1:1", "run", os.getpid())
abandoned = running._folder() / "gone-1.json"
with running.registered(match):
    abandoned.write_text("{}")
    print([found.match for found in running.running()])
print(running.running(), abandoned.exists())
"""


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_module_can_be_imported(system: str, tmp_path: Path) -> None:
    done = python_on(system, tmp_path, "-c", IMPORT_ALL, *NOT_EVERYWHERE)
    assert (done.returncode, done.stdout) == (0, ""), done.stdout + done.stderr


def test_a_match_in_one_process_is_played_and_judged_and_nothing_in_it_is_said_to_be_sealed(tmp_path: Path) -> None:
    played = play_and_judge("win32", tmp_path, "--in-process", "--rate", "max")
    assert "a sandbox needs Linux, and this is win32" in played.stdout.splitlines()[0]


def test_a_journal_is_locked_without_the_locks_of_posix(tmp_path: Path) -> None:
    done = python_on("win32", tmp_path, "-c", LOCKED)
    assert "another coordinator is writing it" in done.stdout, done.stderr
    assert done.stdout.endswith("free\n")


def test_a_running_match_is_found_where_what_is_open_can_be_neither_renamed_nor_deleted(tmp_path: Path) -> None:
    done = python_on("win32", tmp_path, "-c", LISTED)
    assert done.stdout == "['m']\n[] False\n", done.stderr


def test_what_has_no_fall_back_is_named_in_one_sentence(tmp_path: Path) -> None:
    done = python_on("win32", tmp_path, "-m", "vrg", "play", "sharks-and-minnows", "--headless", "--lockstep")
    assert done.returncode == 1
    assert "need Linux or macOS" in done.stderr
    assert "Traceback" not in done.stderr
