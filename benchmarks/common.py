"""What the benchmarks share: match set-ups in memory, a reference workload, medians, tables."""

import argparse
import contextlib
import json
import math
import os
import platform
import re
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.bus.topics import Keys
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.launch.running import running

LENGTH = 19.0
"""m of field along which minnows cross, as in the courtyard."""
WIDTH_PER_ROBOT = 1.25
"""m; as many robots on a square metre as in the courtyard, however many there are."""


def arguments(description: str | None) -> argparse.ArgumentParser:
    """A parser with the options that every benchmark has."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a short run, to see that it works")
    parser.add_argument("--json", action="store_true", help="print JSON in place of tables")
    return parser


def machine() -> str:
    """What this ran on, in a line; the load says how much others disturbed it."""
    system = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    return f"{os.cpu_count()} cores, {system}, load {os.getloadavg()[0]:.1f}"


def show(title: str, rows: Sequence[dict[str, Any]], notes: Sequence[str], *, as_json: bool) -> None:
    """Print rows of one shape as a table or as JSON; None is printed as a dash."""
    if as_json:
        print(json.dumps({"title": title, "machine": machine(), "rows": list(rows), "notes": list(notes)}, indent=2))
        return
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)
    table = Table(title=title, title_justify="left")
    for number, name in enumerate(rows[0] if rows else []):
        table.add_column(name, justify="left" if number == 0 else "right")
    for row in rows:
        table.add_row(*(_cell(value) for value in row.values()))
    console.print(table)
    for note in [*notes, machine()]:
        console.print(note, markup=False, soft_wrap=True)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return str(value)


def median(values: Sequence[float]) -> float:
    """The middle one."""
    return statistics.median(values)


def quantile(values: Sequence[float], share: float) -> float:
    """The value that `share` (0 to 1) of them do not exceed; NaN where there is none."""
    if not values:
        return math.nan
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


@dataclass(frozen=True)
class Cost:
    """s of real time and of this process' processor time. The second is less disturbed by others on the machine."""

    wall: float
    cpu: float


class Stopwatch:
    """Begins when it is made."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def read(self) -> Cost:
        """Since it began."""
        return Cost(time.perf_counter() - self._wall, time.process_time() - self._cpu)


def reference() -> Cost:
    """One unit of a fixed piece of work like ours, half plain Python and half small numpy arrays.

    Ratios to it may be compared between machines and between hours of a busy machine.
    """
    watch = Stopwatch()
    store: dict[str, float] = {}
    for i in range(120_000):
        key = f"{i & 63}"
        store[key] = store.get(key, 0.0) * 0.5 + i
    grid = np.linspace(0.0, 1.0, 200)
    for i in range(6_000):
        turned = grid * np.cos(i) + np.sqrt(grid)
        np.maximum(turned, grid, out=turned)
        turned.argmin()
    return watch.read()


def write_match(
    folder: Path, robots: int, *, engine: str, lasers: bool, name: str = "benchmark", seed: int = 0, rate: float = 1.0
) -> MatchSetup:
    """A match of Sharks and Minnows, one shark to seven minnows, in a walled yard wide enough for all of them.

    Args:
        folder: for the match file and its map. robots: 8 or more.
    """
    width = WIDTH_PER_ROBOT * robots
    (folder / "yard.toml").write_text(_map_text(width))
    (folder / "match.toml").write_text(
        f'name = "{name}"\ngame = "sharks-and-minnows"\nmap = "yard.toml"\nengine = "{engine}"\n'
        f"seed = {seed}\nrate = {rate}\nlasers = {str(lasers).lower()}\n\n"
        f"[rules]\nx = [0.0, {width}]\ny = [0.0, {LENGTH}]\nzone_depth = 4.0\n\n" + _players_text(robots, width)
    )
    return load_match(folder / "match.toml")


@contextlib.contextmanager
def playing(
    folder: Path, *options: str, until: str = "", patience: float = 60.0
) -> Iterator["subprocess.Popen[bytes]"]:
    """The match of `folder` over processes, with its run folders below: its launcher, once play may begin.

    Args:
        options: of `vrg play`. until: a regular expression that the output must match; else the match must be listed.
        patience: the real time in s for it to start.

    Raises:
        SystemExit: it does not start.
    """
    output = folder / "output.txt"
    command = [sys.executable, "-P", "-m", "vrg", "play", str(folder / "match.toml"), "--runs", str(folder / "runs")]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with output.open("wb") as out:
        launcher = subprocess.Popen([*command, *options], stdout=out, stderr=out, env=environment)
    try:
        deadline = time.monotonic() + patience
        while not (re.search(until, output.read_text()) if until else _listed(launcher.pid)):
            if launcher.poll() is not None or time.monotonic() > deadline:
                raise SystemExit(f"the match does not start:\n{output.read_text()}")
            time.sleep(0.1)
        yield launcher
    finally:
        launcher.send_signal(signal.SIGINT)
        launcher.wait(patience)


def _listed(pid: int) -> str | None:
    return next((match.router for match in running() if match.pid == pid), None)


def endpoint_of(pid: int) -> str:
    """The router of the match that a launcher plays."""
    endpoint = _listed(pid)
    if endpoint is None:
        raise SystemExit(f"no match of the launcher {pid} is running")
    return endpoint


class Costs:
    """The processor time of the processes of a running match, and the ticks that its nodes do and miss.

    Args:
        launcher: its process id. session: with its router. keys: of the match. process: the name of the process, and of
            its node, that counts apart from the rest.
    """

    def __init__(self, launcher: int, session: Session, keys: Keys, process: str) -> None:
        self._session, self._mailbox, self._process = session, Mailbox(), process
        self._pulses = self._mailbox.subscribe(keys.pulse())
        session.attach(self._mailbox)
        children = [p for p in psutil.Process(launcher).children(recursive=True) if p.is_running()]
        self._one = [p for p in children if " ".join(p.cmdline()).startswith(f"vrg {process}")]
        self._rest = [p for p in children if p not in self._one]

    def over(self, seconds: float) -> tuple[float, float, int, int]:
        """Wait so long. Return the cores that the process and the rest use, and the ticks and misses of the rest."""
        before, began = self._used(), time.monotonic()
        earlier = self._heard()
        time.sleep(seconds)
        after, later, lasted = self._used(), self._heard(), time.monotonic() - began
        both = [key for key in later if key in earlier and not key.endswith(f"/{self._process}")]
        done, missed = (sum(later[key][n] - earlier[key][n] for key in both) for n in (0, 1))
        return (after[0] - before[0]) / lasted, (after[1] - before[1]) / lasted, done, missed

    def _used(self) -> tuple[float, float]:
        return cpu_times(self._one), cpu_times(self._rest)

    def _heard(self) -> dict[str, tuple[int, int]]:
        self._session.receive()
        self._mailbox.handover(0.0)
        return {key: (p.body.ticks, p.body.missed) for key, p in self._pulses.by_key.items()}


def cpu_times(processes: Iterable[psutil.Process]) -> float:
    """The processor time of all these processes, s."""
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def _players_text(robots: int, width: float) -> str:
    sharks = robots // 8
    tables = []
    for role, count, rows, heading in (("shark", sharks, (2.0,), 90), ("minnow", robots - sharks, (16.0, 17.3), -90)):
        for i in range(count):
            x, y = width * (i + 0.5) / count, rows[i % len(rows)]
            tables.append(
                f'[[players]]\nname = "{role}{i + 1}"\nrole = "{role}"\nx = {x:.3f}\ny = {y}\nheading = {heading}\n'
            )
    return "\n".join(tables)


def _map_text(width: float) -> str:
    """A wall 4 m around the field; per 10 m of it two planters and two columns at either end."""
    low_x, low_y, high_x, high_y = -4.0, -4.0, width + 4.0, LENGTH + 4.0
    corners = [[low_x, low_y], [high_x, low_y], [high_x, high_y], [low_x, high_y], [low_x, low_y]]
    text = (
        f'name = "yard"\nbounds = {{ x_min = {low_x}, y_min = {low_y}, x_max = {high_x}, y_max = {high_y} }}\n'
        f"[[wall]]\npoints = {corners}\nthickness = 0.3\n"
    )
    for part in range(round(width / 10)):
        for y in (-2.0, LENGTH + 2.0):
            x = 10.0 * part
            text += f"[[box]]\nx = {x + 2}\ny = {y}\nlength = 3.0\nwidth = 1.2\nheading = 20.0\n"
            text += f"[[box]]\nx = {x + 7}\ny = {y}\nlength = 1.8\nwidth = 0.5\n"
            text += f"[[circle]]\nx = {x + 4.5}\ny = {y}\nradius = 0.25\n"
            text += f"[[circle]]\nx = {x + 9.5}\ny = {y}\nradius = 0.6\n"
    return text
