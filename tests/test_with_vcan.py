"""scripts/with-vcan runs a command as if nothing stood between, and gives it a CAN interface."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from vrg.testing.requirements import missing
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

WITH_VCAN = str(Path(__file__).parents[1] / "scripts" / "with-vcan")
UNAVAILABLE = 125
PATIENCE = 120.0

ODD = ["", " ", "two words", "it's", '"', "$HOME", "`id`", "\\", "a\nb\n", "*", "-n", "--", "é", "end "]


class Running:
    """A command that with-vcan runs; what it prints goes to files."""

    def __init__(self, folder: Path, *command: str, **options: object) -> None:
        folder.mkdir()
        self._out, self._err = folder / "out", folder / "err"
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process: subprocess.Popen[bytes] = subprocess.Popen(
                [WITH_VCAN, *command],
                stdout=out,
                stderr=err,
                **options,  # type: ignore[call-overload]
            )

    @property
    def out(self) -> str:
        return self._out.read_bytes().decode()

    @property
    def err(self) -> str:
        return self._err.read_bytes().decode()

    def status(self) -> int:
        """Wait for the end."""
        status = self.process.wait(PATIENCE)
        if status == UNAVAILABLE:
            missing(f"with-vcan gave no CAN interface: {self.err}")
        # Without a kernel in between it is the command itself that the signal ended.
        return 128 - status if status < 0 else status

    def wait_for(self, text: str) -> None:
        """Wait until the command, which goes on, has printed this."""

        def check() -> None:
            if self.process.poll() is not None and text not in self.out:
                pytest.fail(f"ended with status {self.status()}: {self.err}")

        wait_until(lambda: text in self.out, f"{text!r} to be printed", check, PATIENCE)


Start = Callable[..., Running]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts with-vcan with a command; none of them is left at the end."""
    all_running: list[Running] = []

    def begin(*command: str, **options: object) -> Running:
        all_running.append(Running(tmp_path / str(len(all_running)), *command, **options))
        return all_running[-1]

    yield begin
    for running in all_running:
        running.process.kill()
        running.process.wait(PATIENCE)


def processes_that_name(folder: Path) -> list[int]:
    """Those with the folder among their arguments."""
    found = psutil.process_iter(["cmdline"])
    return [process.pid for process in found if any(str(folder) in word for word in process.info["cmdline"] or [])]


@pytest.mark.parametrize(
    ("script", "status"),
    [
        ("exit 3", 3),
        pytest.param("exit 130", 130, marks=pytest.mark.thorough),
        pytest.param("kill -SEGV $$", 139, marks=pytest.mark.thorough),
    ],
)
def test_the_commands_status_is_passed_on(start: Start, script: str, status: int) -> None:
    assert start("bash", "-c", script).status() == status


@pytest.mark.thorough
def test_a_command_that_does_not_exist_has_the_shells_status(start: Start) -> None:
    running = start("no-such-command")
    assert running.status() == 127
    assert "no-such-command" in running.err


@pytest.mark.thorough
def test_arguments_folder_environment_and_umask_arrive_as_they_are(start: Start, tmp_path: Path) -> None:
    folder = tmp_path / "a 'folder' $HOME"
    folder.mkdir()
    wanted = {f"ODD_{number}": value for number, value in enumerate(ODD)} | {"not a name": "x", "CI": "perhaps"}
    code = (
        "import json, os, sys; mask = os.umask(0);"
        "print(json.dumps([sys.argv[1:], os.getcwd(), mask, dict(os.environ)])); open('made here', 'w').close()"
    )
    environment = os.environ | wanted
    running = start(sys.executable, "-c", code, *ODD, cwd=folder, umask=0o027, env=environment)
    assert running.status() == 0, running.err
    arguments, directory, mask, got = json.loads(running.out)
    assert arguments == ODD
    assert directory == str(folder)
    assert mask == 0o027
    assert (folder / "made here").exists()
    assert got["VRG_VCAN"] in {"native", "uml"}
    for name in ("VRG_VCAN", "TMPDIR", "PWD", "OLDPWD", "SHLVL", "_"):  # given by with-vcan or by any shell
        got.pop(name, None)
        environment.pop(name, None)
    assert got == environment


@pytest.mark.thorough
def test_output_arrives_while_the_command_runs_each_on_its_own_stream(start: Start) -> None:
    running = start(
        "bash", "-c", "printf 'one\\ntwo\\r\\n\\001'; echo problem >/dev/stderr; echo ready; read -rt 600 <> <(:)"
    )
    running.wait_for("ready")
    running.process.terminate()
    assert running.status() == 128 + signal.SIGTERM
    assert running.out == "one\ntwo\r\n\x01ready\n"
    own = [line for line in running.err.splitlines() if not line.startswith("with-vcan: ")]
    assert own == ["problem"]


SAYS_HOW_IT_ENDS = """
import signal, sys
def end(number, frame):
    print("got", signal.Signals(number).name)
    sys.exit(40 + number)
signal.signal(signal.SIGTERM, end)
print("ready", flush=True)
try:
    while True:
        signal.pause()
except KeyboardInterrupt:
    print("got SIGINT")
    sys.exit(42)
"""


def test_a_signal_reaches_the_command_which_ends_as_it_likes(start: Start) -> None:
    running = start(sys.executable, "-c", SAYS_HOW_IT_ENDS)
    running.wait_for("ready")
    running.process.send_signal(signal.SIGINT)
    assert running.status() == 42
    assert running.out == "ready\ngot SIGINT\n"


@pytest.mark.thorough
def test_several_run_at_once_and_however_they_end_nothing_is_left(start: Start, tmp_path: Path) -> None:
    folder = tmp_path / "temporary"
    folder.mkdir()
    environment = os.environ | {"TMPDIR": str(folder)}
    interrupted, terminated, killed = (start(sys.executable, "-c", SAYS_HOW_IT_ENDS, env=environment) for _ in range(3))
    for running in (interrupted, terminated, killed):
        running.wait_for("ready")
    interrupted.process.send_signal(signal.SIGINT)
    assert interrupted.status() == 42
    assert terminated.process.poll() is None
    terminated.process.send_signal(signal.SIGTERM)
    assert terminated.status() == 55
    assert terminated.out == "ready\ngot SIGTERM\n"
    killed.process.kill()
    killed.process.wait(PATIENCE)
    wait_until(lambda: not list(folder.iterdir()), "what with-vcan made to be removed", patience=PATIENCE)
    wait_until(lambda: not processes_that_name(folder), "what with-vcan started to end", patience=PATIENCE)


SENDS_AND_RECEIVES = """
import socket, struct
one, other = (socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) for _ in range(2))
for end in (one, other):
    end.bind(("vcan0",))
    end.settimeout(60)
one.send(struct.pack("=IB3x8s", 0x123, 3, b"abc"))
number, length, data = struct.unpack("=IB3x8s", other.recv(16))
print(hex(number), data[:length].decode())
"""


@pytest.mark.thorough
def test_frames_can_be_lost_on_purpose(start: Start) -> None:
    """By netem, which the user-mode kernel has; this machine's kernel may not."""
    lossy = 'test "$VRG_VCAN" = native || { tc qdisc add dev vcan0 root netem loss 100% && ! "$@"; }'
    code = SENDS_AND_RECEIVES.replace("settimeout(60)", "settimeout(1)")
    running = start("bash", "-c", lossy, "bash", sys.executable, "-c", code)
    assert running.status() == 0, running.err


@pytest.mark.thorough
def test_there_is_a_can_interface_which_the_tests_find(start: Start) -> None:
    code = f"{SENDS_AND_RECEIVES}\nfrom vrg.testing.can.vcan import is_up; print(is_up(), is_up('lo'), is_up('vcan7'))"
    running = start(sys.executable, "-c", code, cwd=Path(__file__).parents[1])
    assert running.status() == 0, running.err
    assert running.out == "0x123 abc\nTrue True False\n"
