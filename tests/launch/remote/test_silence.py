import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from vrg.launch.folder_lock import folder_lock
from vrg.launch.remote.remote_host import AGENT_TIMEOUT
from vrg.launch.remote.silence import MAX_PAUSE, Silence


def test_silence_counts_as_long_as_one_looks_and_hears_nothing() -> None:
    silence = Silence(100.0)
    assert silence.look(100.2, heard=False) == pytest.approx(0.2)
    assert silence.look(100.6, heard=False) == pytest.approx(0.6)
    assert silence.look(90.0, heard=False) == pytest.approx(0.6), "a clock that steps back takes none away"
    assert silence.look(90.3, heard=True) == 0.0
    assert silence.look(90.4, heard=False) == pytest.approx(0.1)


@pytest.mark.parametrize("stall", [MAX_PAUSE, 3.0, 3600.0])
def test_time_in_which_one_did_not_look_is_no_silence_of_the_other(stall: float) -> None:
    """This machine was busy or stood still; what the other one sent meanwhile may arrive a little later."""
    silence = Silence(100.0)
    assert silence.look(100.0 + stall, heard=False) <= MAX_PAUSE
    assert silence.look(100.1 + stall, heard=True) == 0.0


def test_a_busy_machine_still_notices_that_another_one_is_gone() -> None:
    """Every look comes 2 s late."""
    silence, looks = Silence(0.0), 0
    while silence.seconds <= AGENT_TIMEOUT:
        looks += 1
        silence.look(2.0 * looks, heard=False)
    assert looks == 7


HOLDER = """
import sys, time
from pathlib import Path
from vrg.launch.folder_lock import folder_lock
with folder_lock(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("frozen", [False, True])
def test_a_new_agent_takes_the_folder_from_the_one_that_was_lost(tmp_path: Path, frozen: bool) -> None:
    command = [sys.executable, "-c", textwrap.dedent(HOLDER), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as lost:
        assert lost.stdout is not None
        assert lost.stdout.readline() == b"held\n"
        if frozen:
            lost.send_signal(19)
        with folder_lock(tmp_path):
            assert lost.wait(10.0) == -9
    with folder_lock(tmp_path):
        pass
