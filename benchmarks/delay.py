"""From sensing to the applied command, in a match of 8 players as processes on this machine at rate 1.

Everything is started by `vrg` as for `vrg play`, except the world: its process is this file's own. It runs the same
node and executor, and also notes at each of its ticks the Drive messages that its mailbox hands over in that tick.

A player reads the robot's state of a world tick, decides in that tick, and stamps its Drive with its match time; the
world applies a Drive at the first tick that begins after its arrival. Two numbers, both in match time, of every player
from one second after play has begun:

    delay   tick at which the world applies a Drive - stamp of the state that it was decided on. One world tick is
            the least: a state is published at the end of a tick, and the next one is the first that can listen.
    age     at each world tick, tick - stamp of the Drive in force. With nothing late it runs from one tick to the
            player's period.

Aim: at most one world tick more than the player's own period at p99, so age <= period + tick; and, stricter,
delay <= one tick. CPU is each process' share of one core in that time, from /proc; ticks and missed ticks are from the
statistics that each process leaves in the run folder, start included. Engines take turns.
"""

import json
import logging
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import psutil
from common import arguments, machine, median, show, write_match

from vrg.agents.player import PERIOD
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Stage
from vrg.bus.node import Tick
from vrg.bus.process import run_world
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.bus.topics import Keys, name_in
from vrg.config.setup import MatchSetup, read_setup
from vrg.files import write_json
from vrg.hal.sim.config import WorldConfig
from vrg.hal.sim.node import WorldNode
from vrg.launch.endpoints import free_endpoint
from vrg.launch.host import GROUPS
from vrg.launch.plan import processes_at
from vrg.launch.supervisor import Supervisor
from vrg.runs.run_folder import RunFolder

PLAYERS = 8
STRANGER = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Stranger(SharksAndMinnowsPlayer):
    pass
"""
PATIENCE = 30.0
"""s of real time for processes to be ready, and for the match to begin."""
STOP_PATIENCE = 10.0
"""s of real time from SIGTERM to SIGKILL."""


class ObservedWorld(WorldNode):
    """The world, noting when Drives are applied. Its second inlet is filled and handed over together with its own."""

    def __init__(self, config: WorldConfig, mailbox: Mailbox, keys: Keys) -> None:
        super().__init__(config, mailbox, keys)
        self._seen = mailbox.subscribe(keys.drive())
        self._in_force: dict[str, float] = {}
        self.noting = False
        self.delays: Counter[int] = Counter()
        self.ages: Counter[int] = Counter()

    def tick(self, tick: Tick) -> None:
        """Note, then do as every world."""
        for drive in self._seen.take():
            self._in_force[name_in(drive.key)] = drive.stamp
            if self.noting:
                self.delays[self._ticks(tick.time - drive.stamp)] += 1
        if self.noting:
            self.ages.update(self._ticks(tick.time - stamp) for stamp in self._in_force.values())
        super().tick(tick)

    def _ticks(self, seconds: float) -> int:
        return round(seconds / self.period)


def run_observed_world(folder: RunFolder, endpoint: str) -> None:
    """The world's process."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    sys.setswitchinterval(1e-3)
    setup = read_setup(folder.setup)
    with stop_on_signals() as stop, open_session(endpoint) as session:
        node = ObservedWorld(setup.world, Mailbox(), setup.keys)
        threading.Thread(target=_hear_parent, args=(node, stop), daemon=True).start()
        statistics = run_world(
            node, session, setup.keys, stop, first_tick=0, rate=setup.rate, after_tick=lambda _tick: None
        )
        noted = {"delays": node.delays, "ages": node.ages, "tick": node.period}
        write_json(folder.logs / "world.json", asdict(statistics) | noted)


def _hear_parent(node: ObservedWorld, stop: Stop) -> None:
    """Standard input: `+` begins to note, `-` ends it, its end ends the world."""
    while order := os.read(0, 1):
        node.noting = order == b"+"
    stop.set()


@contextmanager
def _world(folder: RunFolder, endpoint: str) -> Iterator["subprocess.Popen[bytes]"]:
    command = [sys.executable, __file__, "--world", str(folder.path), endpoint]
    with (folder.logs / "world.log").open("ab") as log:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(STOP_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@dataclass
class Run:
    """What one match gave.

    Args:
        delays, ages: how often each number of world ticks was seen. cpu: share of a core by process.
        missed: ticks by process. tick: of the world, s.
    """

    delays: Counter[int] = field(default_factory=Counter)
    ages: Counter[int] = field(default_factory=Counter)
    cpu: dict[str, float] = field(default_factory=dict)
    missed: dict[str, int] = field(default_factory=dict)
    ticks: dict[str, int] = field(default_factory=dict)
    tick: float = 0.02


def play(engine: str, lasers: bool, seconds: float, *, strangers: bool) -> Run:
    """Play for `seconds` of real time after the match has begun.

    Args:
        strangers: True lets all play by a file, whose strategies decide in processes of their own.
    """
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        setup = write_match(base, PLAYERS, engine=engine, lasers=lasers, name="benchmark-delay")
        if strangers:
            (base / "stranger.py").write_text(STRANGER)
            for player in setup.players:
                setup = setup.substituted(player.name, "stranger.py:Stranger")
        folder = RunFolder.create(base / "runs", setup.name, datetime.now())
        cpu = _play(setup, folder, seconds)
        return _collect(folder, cpu)


def _play(setup: MatchSetup, folder: RunFolder, seconds: float) -> dict[str, float]:
    endpoint = free_endpoint()
    wanted = [s for s in processes_at(setup, folder.path, endpoint, window=False, record=True) if s.name != "world"]
    supervisor = Supervisor(wanted, endpoint, setup.keys, folder.logs, lambda text: print(text, file=sys.stderr))
    try:
        folder.hand_out(setup)
        supervisor.start_router(threading.Event())
        with _world(folder, endpoint) as world, open_session(endpoint) as session:
            _wait_for(lambda: bool(session.alive(setup.keys.alive("world", "world"))), "the world")
            supervisor.attach(session)
            for group in GROUPS:
                supervisor.begin(group)
                _wait_for(partial(_all_started, supervisor), "the processes")
            _wait_for_play(setup, session)
            pids = {p.spec.name: p.pid for p in supervisor.processes if p.pid} | {"world": world.pid}
            children = [(name, psutil.Process(pid).children()) for name, pid in pids.items()]
            pids |= {f"{name} strategy": child.pid for name, [*found] in children for child in found}
            assert world.stdin is not None
            time.sleep(1.0)
            os.write(world.stdin.fileno(), b"+")
            cpu = _shares(pids, seconds)
            os.write(world.stdin.fileno(), b"-")
            dead = [p.spec.name for p in supervisor.processes if p.exit_status is not None]
            if dead or world.poll() is not None:
                raise RuntimeError(f"ended before its time: {', '.join(dead) or 'world'}")
            # Players, referee and recorder first: they leave their statistics while the clock still runs.
            for process in supervisor.processes:
                if process.spec.pulse:
                    process.terminate()
            deadline = time.monotonic() + STOP_PATIENCE
            for process in supervisor.processes:
                if process.spec.pulse:
                    process.wait_stopped(deadline)
        return cpu
    finally:
        supervisor.close()


def _all_started(supervisor: Supervisor) -> bool:
    supervisor.started()
    return not supervisor.starting


def _wait_for(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what} was not ready within {PATIENCE:g} s")
        time.sleep(0.05)


def _wait_for_play(setup: MatchSetup, session: Session) -> None:
    mailbox = Mailbox()
    referee = mailbox.subscribe(setup.keys.referee_state)
    session.attach(mailbox)

    def playing() -> bool:
        session.receive()
        mailbox.handover(0.0)
        return referee.latest is not None and referee.latest.body.stage is Stage.PLAY_ROUND

    _wait_for(playing, "the match")


def _shares(pids: dict[str, int], seconds: float) -> dict[str, float]:
    """Each process' share of one core over the next `seconds`."""
    before, began = {name: _cpu(pid) for name, pid in pids.items()}, time.monotonic()
    time.sleep(seconds)
    took = time.monotonic() - began
    return {name: (_cpu(pid) - before[name]) / took for name, pid in pids.items()}


def _cpu(pid: int) -> float:
    """s of processor time so far (proc(5): utime and stime)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _collect(folder: RunFolder, cpu: dict[str, float]) -> Run:
    run = Run(cpu=cpu)
    for path in sorted(folder.logs.glob("*.json")):
        content = json.loads(path.read_text())
        run.missed[path.stem], run.ticks[path.stem] = content["missed"], content["ticks"]
        if path.stem == "world":
            run.tick = content["tick"]
            run.delays.update({int(ticks): count for ticks, count in content["delays"].items()})
            run.ages.update({int(ticks): count for ticks, count in content["ages"].items()})
    return run


def _at(counts: Counter[int], share: float) -> int:
    """The number of ticks that `share` of the counted do not exceed."""
    wanted, seen = share * counts.total(), 0
    for ticks in sorted(counts):
        seen += counts[ticks]
        if seen >= wanted:
            return ticks
    raise ValueError("nothing was counted: no player drove")


def _delay_row(case: str, runs: list[Run]) -> dict[str, Any]:
    delays: Counter[int] = sum((run.delays for run in runs), Counter())
    ages: Counter[int] = sum((run.ages for run in runs), Counter())
    tick = runs[0].tick
    ms = tick * 1e3
    met = {True: "met", False: "missed"}
    limit = round((PERIOD + tick) / tick)
    return {
        "case": case,
        "Drives": delays.total(),
        "delay p50, ms": _at(delays, 0.5) * ms,
        "delay p99": _at(delays, 0.99) * ms,
        "delay max": max(delays) * ms,
        "over a tick": f"{sum(n for t, n in delays.items() if t > 1) / delays.total():.2%}",
        "aim <= 20": met[_at(delays, 0.99) <= 1],
        "age p50, ms": _at(ages, 0.5) * ms,
        "age p99": _at(ages, 0.99) * ms,
        "age max": max(ages) * ms,
        "aim <= 120": met[_at(ages, 0.99) <= limit],
    }


def _process_rows(case: str, runs: list[Run]) -> list[dict[str, Any]]:
    def kind(name: str) -> str:
        return name if name in ("world", "router", "referee", "recorder") else "each player"

    rows = []
    for process in ("world", "router", "referee", "recorder", "each player"):
        shares = [share for run in runs for name, share in run.cpu.items() if kind(name) == process]
        missed = sum(n for run in runs for name, n in run.missed.items() if kind(name) == process)
        ticks = sum(n for run in runs for name, n in run.ticks.items() if kind(name) == process)
        rows.append(
            {
                "case": case,
                "process": process,
                "CPU, % of a core": 100 * median(shares),
                "max": 100 * max(shares),
                "ticks": ticks or None,
                "missed": missed if ticks else None,
            }
        )
    total = 100 * median([sum(run.cpu.values()) for run in runs])
    return [
        *rows,
        {"case": case, "process": "all", "CPU, % of a core": total, "max": None, "ticks": None, "missed": None},
    ]


def main() -> None:
    """Run the benchmark, and print its table."""
    if sys.argv[1:2] == ["--world"]:
        run_observed_world(RunFolder(Path(sys.argv[2])), sys.argv[3])
        return
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=None)
    parser.add_argument("--strangers", action="store_true", help="all play by a file")
    options = parser.parse_args()
    seconds = 4.0 if options.quick else 25.0
    cases: dict[str, list[Run]] = {"pybullet": [], "planar": []}
    for _ in range(options.rounds or (1 if options.quick else 2)):
        for engine, runs in cases.items():
            runs.append(play(engine, lasers=True, seconds=seconds, strangers=options.strangers))
            print(_delay_row(engine, runs), file=sys.stderr)
    delays = [_delay_row(engine, runs) for engine, runs in cases.items()]
    processes = [row for engine, runs in cases.items() for row in _process_rows(engine, runs)]
    notes = [f"{PLAYERS} players every {PERIOD * 1e3:.0f} ms, lasers at 10 Hz, world tick 20 ms, {seconds:g} s a run"]
    if options.json:
        everything = {"delay": delays, "processes": processes, "notes": notes, "machine": machine()}
        print(json.dumps(everything, indent=2))
        return
    show("From sensing to the applied command, match time", delays, notes, as_json=False)
    show("Processes", processes, [], as_json=False)


if __name__ == "__main__":
    main()
