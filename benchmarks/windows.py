"""What windows cost a match: frames a second, processor time, and missed ticks, beside the same match without any.

One match over processes at rate 1, beside which the spectator, the head-up display of a player, and no window at all
take turns, several rounds, so that all see the same match on the same machine. Windows are 1920 x 1080 pixels on a
virtual screen of Xvfb. Numbers of ticks and of missed ticks are from the pulses of the match's nodes, frames are
counted where they are shown. CPU is the share of one core, from /proc.
"""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import psutil
from common import arguments, cpu_times, endpoint_of, median, playing, show, write_match

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import open_session
from vrg.bus.topics import Keys

SIZE = (1920, 1080)
NONE = "none"
WINDOWS = {NONE: "", "spectator": "bench-spectator", "hud": "shark1"}
"""The kinds of windows, and the name of the node of each."""
PATIENCE = 60.0
"""The real time in s for the match to start, and for a window to open."""
WARM_UP = 2.0
"""The real time in s that a window is open before it is measured."""


def _window(kind: str, endpoint: str, run: str) -> None:
    """Be a window, and answer each line on standard input by the number of frames shown so far."""
    import pygame  # noqa: PLC0415 - only a window's process needs these

    from vrg.config.setup import read_setup  # noqa: PLC0415
    from vrg.kinds import KINDS  # noqa: PLC0415
    from vrg.launch.process import by_hand  # noqa: PLC0415
    from vrg.launch.process_main import serve  # noqa: PLC0415
    from vrg.runs.run_folder import RunFolder  # noqa: PLC0415
    from vrg.ui.window import window  # noqa: PLC0415

    frames, flip = [0], pygame.display.flip

    def counted() -> None:
        frames[0] += 1
        flip()

    def answer() -> None:
        for _ in sys.stdin:
            print(f"frames {frames[0]}", flush=True)

    pygame.display.flip = counted
    window.fitting = lambda _screen: SIZE
    threading.Thread(target=answer, daemon=True).start()
    process = by_hand(KINDS.get(kind), WINDOWS[kind], endpoint, run=None, keys=None)
    serve(process, read_setup(RunFolder(Path(run)).setup))


@contextlib.contextmanager
def _screen() -> Iterator[str]:
    """A virtual screen: its display."""
    out, into = os.pipe()
    command = ["Xvfb", "-displayfd", str(into), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[into], stderr=subprocess.DEVNULL)
    os.close(into)
    try:
        with os.fdopen(out) as answer:
            yield f":{answer.readline().strip()}"
    finally:
        server.terminate()
        server.wait(PATIENCE)


class _Shown:
    """A window that is open; without a kind it is none."""

    def __init__(self, kind: str, endpoint: str, run: Path, display: str) -> None:
        self._process: subprocess.Popen[str] | None = None
        if kind != NONE:
            self._process = subprocess.Popen(
                [sys.executable, __file__, "--window", kind, endpoint, str(run)], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env={**os.environ, "DISPLAY": display},
            )  # fmt: skip
            deadline = time.monotonic() + PATIENCE
            while self.frames() == 0 and time.monotonic() < deadline:
                time.sleep(0.1)

    def frames(self) -> int:
        """How many frames it has shown."""
        process = self._process
        if process is None or process.stdin is None or process.stdout is None:
            return 0
        print("count", file=process.stdin, flush=True)
        while not (line := process.stdout.readline()).startswith("frames"):
            if not line:
                raise SystemExit("a window has ended")
        return int(line.split()[1])

    def cpu(self) -> float:
        """The processor time that it has used, s."""
        return 0.0 if self._process is None else sum(psutil.Process(self._process.pid).cpu_times()[:2])

    def close(self) -> None:
        """Close it."""
        if self._process is not None:
            if self._process.stdin is not None:
                # Its thread that reads would keep the interpreter from ending.
                self._process.stdin.close()
            self._process.send_signal(signal.SIGINT)
            self._process.wait(PATIENCE)


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, default=16, help="robots in the match")
    options = parser.parse_args()
    rounds, seconds = (1, 3.0) if options.quick else (3, 6.0)
    shown: dict[str, list[float]] = defaultdict(list)
    window: dict[str, list[float]] = defaultdict(list)
    rest: dict[str, list[float]] = defaultdict(list)
    missed: dict[str, int] = defaultdict(int)
    ticks: dict[str, int] = defaultdict(int)
    name = "windows-benchmark"
    with tempfile.TemporaryDirectory() as made, _screen() as display:
        folder = Path(made)
        write_match(folder, options.robots, engine="pybullet", lasers=True, name=name)
        with playing(folder, "--headless", "--no-record", patience=PATIENCE) as launcher:
            endpoint = endpoint_of(launcher.pid)
            mailbox = Mailbox()
            pulses = mailbox.subscribe(Keys(name).pulse())
            run = next((folder / "runs").glob("*/"))
            with open_session(endpoint) as session:
                session.attach(mailbox)

                def heard() -> dict[str, tuple[int, int]]:
                    session.receive()
                    mailbox.handover(0.0)
                    return {key: (p.body.ticks, p.body.missed) for key, p in pulses.by_key.items()}

                time.sleep(10.0)
                processes = psutil.Process(launcher.pid).children(recursive=True)
                for turn in range(rounds * len(WINDOWS)):
                    kind = list(WINDOWS)[turn % len(WINDOWS)]
                    opened = _Shown(kind, endpoint, run, display)
                    time.sleep(WARM_UP)
                    before, told, began = cpu_times(processes), heard(), time.monotonic()
                    frames, used = opened.frames(), opened.cpu()
                    time.sleep(seconds)
                    lasted = time.monotonic() - began
                    try:
                        used_up = cpu_times(processes) - before
                    except psutil.NoSuchProcess:
                        opened.close()
                        print("the game is over: what follows was measured until then", file=sys.stderr)
                        break
                    shown[kind].append((opened.frames() - frames) / lasted)
                    window[kind].append((opened.cpu() - used) / lasted)
                    rest[kind].append(used_up / lasted)
                    for key, (done, lost) in heard().items():
                        if key in told and key.split("/")[-1] not in WINDOWS.values():
                            ticks[kind] += done - told[key][0]
                            missed[kind] += lost - told[key][1]
                    opened.close()
    rows = [
        {
            "window": kind,
            "frames/s": median(shown[kind]) if kind != NONE else None,
            "window, % of a core": 100 * median(window[kind]) if kind != NONE else None,
            "rest of the match, %": 100 * median(rest[kind]),
            "that to none": median(rest[kind]) / median(rest[NONE]),
            "ticks of its nodes": ticks[kind],
            "missed": missed[kind],
        }
        for kind in WINDOWS
    ]
    note = f"{options.robots} robots, PyBullet with lasers, {SIZE[0]}x{SIZE[1]}, {rounds} times {seconds:g} s each"
    show("A match with windows", rows, [note], as_json=options.json)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--window"]:
        _window(*sys.argv[2:])
    else:
        main()
