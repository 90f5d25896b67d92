import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from vrg.launch.folder_lock import folder_lock
from vrg.launch.remote.lease import LEASE, Lease


def test_it_lapses_when_nothing_is_heard_for_too_long_and_not_before() -> None:
    lease = Lease(100.0)
    assert not lease.lapsed(100.0 + LEASE)
    assert lease.lapsed(100.1 + LEASE)
    lease.renew(105.0)
    assert not lease.lapsed(105.0 + LEASE)
    assert lease.lapsed(105.1 + LEASE)


def test_an_older_sign_of_life_does_not_shorten_it() -> None:
    lease = Lease(100.0)
    lease.renew(90.0)
    assert not lease.lapsed(99.0 + LEASE)


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
