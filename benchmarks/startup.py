"""What it costs to start a match of twelve processes, from `vrg play` to the moment when all of them work.

The match has a router, a world, a referee, a recorder and eight players. Every figure is taken when the pulse of the
last of them has been felt: real time since the command was started; processor time and memory (proportional set size,
in which shared pages count in parts) of each process. Two checkouts are compared by running this once for each with
`--command`; in one run they are started in turns, so that both meet the same disturbances.

    python benchmarks/startup.py --command .venv/bin/vrg --command ../before/.venv/bin/vrg --busy 5
"""

import contextlib
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
import zenoh
from common import arguments, median, show

from vrg.bus.configuration import client_settings
from vrg.bus.session import configuration

PLAYERS = 8
PATIENCE = 300.0
"""s of real time; a start that takes longer counts as failed."""
MATCH = """
name = "startup"
game = "sharks-and-minnows"
map = "open"
engine = "{engine}"
seed = 1

[rules]
x = [-10.0, 10.0]
y = [-15.0, 15.0]
zone_depth = 4.0
"""


STRANGER = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Stranger(SharksAndMinnowsPlayer):
    pass
"""


@dataclass(frozen=True)
class Start:
    """One start of a match. Times in s, memory in MB; of a player the median of all of them."""

    wall: float
    cpu: float
    player_cpu: float
    memory: float
    player_memory: float


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--command", action="append", help="the vrg to start; may be given several times")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--busy", type=int, default=0, help="endless loops that run beside it")
    parser.add_argument("--engine", default="pybullet")
    parser.add_argument("--strangers", action="store_true", help="players of strangers, sealed by default and not")
    options = parser.parse_args()
    paths = [str(Path(c).absolute()) for c in options.command or []] or [str(Path(sys.executable).with_name("vrg"))]
    commands = [f"{path}{more}" for path in paths for more in (("", " --no-sandbox") if options.strangers else ("",))]
    runs = 1 if options.quick else options.runs
    found: dict[str, list[Start]] = {command: [] for command in commands}
    failures = dict.fromkeys(commands, 0)
    with _busy(options.busy):
        for _ in range(runs):
            for command in commands:
                try:
                    found[command].append(_start(command, options.engine, strangers=options.strangers))
                except RuntimeError as error:
                    failures[command] += 1
                    print(f"{command}: {error}", file=sys.stderr)
    rows = [
        {
            "command": command,
            "all ready, s": median([s.wall for s in starts]) if starts else None,
            "longest, s": max((s.wall for s in starts), default=None),
            "processor, all, s": median([s.cpu for s in starts]) if starts else None,
            "processor, player, s": median([s.player_cpu for s in starts]) if starts else None,
            "memory, all, MB": median([s.memory for s in starts]) if starts else None,
            "memory, player, MB": median([s.player_memory for s in starts]) if starts else None,
            "failed": failures[command],
        }
        for command, starts in found.items()
    ]
    title = f"Starting a match of {PLAYERS + 4} processes, {runs} times, {options.busy} busy loops beside it"
    show(title, rows, [], as_json=options.json)


def _start(command: str, engine: str, *, strangers: bool) -> Start:
    """Start a match, take the figures when everybody works, and end it.

    Args:
        command: the path of `vrg`, with more options of `vrg play` after a space.
        strangers: True lets all play by a file outside the folder of the match.
    """
    wanted = {"world/world", "coordinator/referee", "recorder/recorder", *(f"player/p{n}" for n in range(PLAYERS))}
    path, _, more = command.partition(" ")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as elsewhere:
        strategy = Path(elsewhere) / "stranger.py"
        strategy.write_text(STRANGER, encoding="utf-8")
        file = Path(folder) / "match.toml"
        players = _players(f"{strategy}:Stranger" if strangers else "sharks-and-minnows")
        file.write_text(MATCH.format(engine=engine) + players, encoding="utf-8")
        # Not in the working folder: an older release takes the folder `vrg` there for the package.
        environment = {**os.environ, "XDG_STATE_HOME": f"{folder}/state"}
        began = time.monotonic()
        launcher = subprocess.Popen(
            [path, "play", str(file), "--headless", "--runs", folder, *more.split()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
            cwd=folder,
            start_new_session=True,
        )
        try:
            felt: set[str] = set()
            with _pulses(launcher, felt):
                while not wanted <= felt:
                    if launcher.poll() is not None:
                        raise RuntimeError(f"it ended with status {launcher.returncode}")
                    if time.monotonic() - began > PATIENCE:
                        raise RuntimeError(f"not ready after {PATIENCE:g} s: {sorted(wanted - felt)}")
                    time.sleep(0.002)
                return _measure(launcher.pid, time.monotonic() - began)
        finally:
            launcher.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                launcher.wait(60)
            launcher.kill()


def _players(strategy: str) -> str:
    text = ""
    for n in range(PLAYERS):
        role, y, heading = ("shark", -13.0, 90) if n == 0 else ("minnow", 13.0, -90)
        text += f'[[players]]\nname = "p{n}"\nrole = "{role}"\nx = {2.0 * n - 8}\ny = {y}\nheading = {heading}\n'
        text += f'strategy = "{strategy}"\n'
    return text


@contextlib.contextmanager
def _pulses(launcher: "subprocess.Popen[bytes]", felt: set[str]) -> Iterator[None]:
    """Add `kind/name` of everybody whose pulse is felt."""
    endpoint = "tcp/127.0.0.1:7447"
    while True:
        try:
            session = zenoh.open(configuration(client_settings(endpoint)))
            break
        except zenoh.ZError:
            if launcher.poll() is not None:
                raise RuntimeError(f"it ended with status {launcher.returncode}") from None
            time.sleep(0.02)
    subscriber = session.declare_subscriber(
        "vrg/startup/pulse/**", lambda sample: felt.add("/".join(str(sample.key_expr).split("/")[3:]))
    )
    try:
        yield
    finally:
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        session.close()  # type: ignore[no-untyped-call]


def _measure(launcher: int, wall: float) -> Start:
    everybody = [psutil.Process(launcher), *psutil.Process(launcher).children(recursive=True)]
    cpu: dict[int, float] = {}
    memory: dict[int, float] = {}
    players = []
    for process in everybody:
        with contextlib.suppress(psutil.NoSuchProcess):
            if process.status() == psutil.STATUS_ZOMBIE:
                continue
            times = process.cpu_times()
            cpu[process.pid] = times.user + times.system
            memory[process.pid] = process.memory_full_info().pss / 1e6
            if " player " in " ".join(process.cmdline()):
                players.append(process.pid)
    return Start(
        wall,
        sum(cpu.values()),
        median([cpu[pid] for pid in players]),
        sum(memory.values()),
        median([memory[pid] for pid in players]),
    )


@contextlib.contextmanager
def _busy(count: int) -> Iterator[None]:
    loops = [multiprocessing.Process(target=_spin, daemon=True) for _ in range(count)]
    for loop in loops:
        loop.start()
    try:
        yield
    finally:
        for loop in loops:
            loop.terminate()


def _spin() -> None:
    while True:
        pass


if __name__ == "__main__":
    main()
