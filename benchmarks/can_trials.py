"""What the CAN benchmark measures of a robot: delays, stops, and eight axes at 100 Hz."""

import itertools
import json
import math
import os
import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from can_load import BIT_RATE, worst_bits
from can_peers import CHANNEL, Idler, Listener, counts_ticks, of_command, sent_packets
from can_robots import AHEAD, PLAYER_RATE, Drives, arm, commander, connected, connected_robot, play, robot, train
from common import quantile

from vrg.errors import RobotError
from vrg.hal.can.bus import can_message
from vrg.hal.can.link import Link
from vrg.hal.can.machine import TIMES
from vrg.hal.can.odrive.codec import node_of
from vrg.hal.can.odrive.messages import Command
from vrg.hal.can.opening import open_bus
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault

AGE_AIM = 20.0
"""ms: no setpoint of eight axes is older."""
AXES_RATE = 100.0
"""Hz of setpoints of eight axes."""
DELAY_CALLS = 200
"""Of each kind in a row."""
DELAY_PATIENCE = 10
IDLING = 3.0
"""s for which processor time is looked at."""
SETTLE = 0.8
"""s of driving before something goes wrong; longer than the guard forgives after a recovery."""

Tell = Callable[[str], None]
Row = dict[str, object]


def spread(values: Sequence[float]) -> Row:
    """Columns of a sample of ms."""
    return {
        "n": len(values),
        "p50, ms": quantile(values, 0.5),
        "p99, ms": quantile(values, 0.99),
        "max, ms": max(values),
    }


def delays(count: int, tell: Tell) -> list[Row]:
    """From the call to the kernel's stamp of the first and the last motor's setpoint; both by CLOCK_REALTIME.

    The calls come 5 to 15 ms after each other, so that they meet the drives' cyclic frames at every phase. A row of
    calls in which the robot refuses one, as its drives' watchdog has met a commander that was late, is done again.
    """
    driver, own = train("r", (0, 1)), robot(0, 1)
    cases: dict[str, tuple[Callable[[], AbstractContextManager[None]], Callable[[], object]]]
    took: dict[str, list[tuple[float, ...]]] = {}
    repeated: Counter[str] = Counter()
    with Drives((0, 1)) as drives, Listener(of_command(Command.SET_INPUT_VEL)) as listener:
        for done in range(0, count, DELAY_CALLS):
            tell(f"delay of DriveTrain.drive() and Device.drive(), {done} of {count} calls")
            cases = {
                "DriveTrain.drive()": (lambda: connected(driver), lambda: driver.drive(AHEAD)),
                "Device.drive()": (lambda: connected_robot(own), lambda: play(own)),
            }
            for name, (ready, call) in cases.items():
                every = None
                while every is None:
                    with ready():
                        every = _delays(call, min(DELAY_CALLS, count), drives.nodes, listener)
                    repeated[name] += every is None
                    if repeated[name] > DELAY_PATIENCE:
                        raise RuntimeError(f"{name} refuses more often than not")
                took.setdefault(name, []).extend(every)
    table: list[Row] = []
    for name, every in took.items():
        for which, pick in (("first", min), ("last", max)):
            times = [pick(each) * 1e3 for each in every]
            table.append(
                {"from": name, "to": f"the {which} motor's setpoint", **spread(times), "repeated": repeated[name]}
            )
    return table


def _delays(
    call: Callable[[], object], count: int, nodes: Sequence[int], listener: Listener
) -> list[tuple[float, ...]] | None:
    """s to the setpoint of each node, by call; None if the robot refused, as the watchdog had met a late commander."""
    time.sleep(0.05)
    listener.take()
    called: list[float] = []
    for _ in range(count):
        time.sleep(random.uniform(0.005, 0.015))
        called.append(time.time())
        try:
            call()
        except RobotError:
            return None
    time.sleep(0.05)
    heard = listener.take()
    sent = [[frame.at for frame in heard if node_of(frame.id) == node] for node in nodes]
    if listener.lost or any(len(times) != count * TIMES for times in sent):
        raise RuntimeError(f"expected {count * TIMES} setpoints of each node, got {[len(times) for times in sent]}")
    first = [times[::TIMES] for times in sent]
    return [tuple(each - at for each in times) for at, *times in zip(called, *first, strict=True)]


def stops(times: int, tell: Tell) -> list[Row]:
    """To zero speed of both motors, by the emulated motors themselves, which are looked at every 10 ms.

    A trial in which the motors stood to begin with, as the drives' watchdog had met a commander that came late, is
    done again, and counted.
    """
    with Drives((0, 1)) as drives:
        return [_silences(drives, times, tell), _kills(drives, times, tell)]


class _Took:
    """The times of so many trials, ms."""

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted
        self.times: list[float] = []
        self.repeated = 0

    @property
    def complete(self) -> bool:
        return len(self.times) >= self._wanted

    def note(self, seconds: float | None) -> None:
        """What a trial has given; None does not count."""
        if seconds is not None:
            self.times.append(seconds * 1e3)
            return
        self.repeated += 1
        if self.repeated > self._wanted:
            raise RuntimeError("the motors stand more often than not")

    def columns(self) -> Row:
        return {**spread(self.times), "repeated": self.repeated}


def _silences(drives: Drives, times: int, tell: Tell) -> Row:
    driver, took = train("r", drives.nodes), _Took(times)
    injector = open_bus(Link(channel=CHANNEL))
    ended = threading.Event()

    def drive() -> None:
        """As a player: every 0.1 s, and undaunted."""
        while not ended.wait(1 / PLAYER_RATE):
            try:
                driver.drive(AHEAD)
            except RobotError:
                driver.stop()

    thread = threading.Thread(target=drive)
    try:
        with connected(driver):
            thread.start()
            while not took.complete:
                tell(f"silence of a drive, {len(took.times) + 1} of {times}")
                time.sleep(SETTLE + random.uniform(0.0, 0.1))
                drives.take()
                time.sleep(0.03)
                began = time.time()
                injector.send(can_message(encode_fault(drives.nodes[0], FaultRequest(FaultKind.SILENCE))))
                time.sleep(1.2)
                took.note(drives.stopped(drives.take(), began))
                injector.send(can_message(encode_fault(drives.nodes[0], FaultRequest(FaultKind.END))))
                time.sleep(0.3)
                driver.recover()
                arm([driver])
            ended.set()
            thread.join()
    finally:
        ended.set()
        injector.shutdown()
    return {"from": "a drive falls silent", "to": "zero speed of all motors", **took.columns()}


def _kills(drives: Drives, times: int, tell: Tell) -> Row:
    took = _Took(times)
    while not took.complete:
        tell(f"killing the commander, {len(took.times) + 1} of {times}")
        with commander(1, len(drives.nodes), PLAYER_RATE) as peer:
            peer.line()
            time.sleep(SETTLE + random.uniform(0.0, 0.1))
            drives.take()
            time.sleep(0.03)
            began = time.time()
            os.kill(peer.pid, signal.SIGKILL)
            time.sleep(0.8)
            took.note(drives.stopped(drives.take(), began))
    return {"from": "the commander is killed", "to": "zero speed of all motors", **took.columns()}


def eight_axes(seconds: float, tell: Tell, trains: int = 4, options: Sequence[str] = ()) -> tuple[list[Row], list[str]]:
    """One process drives eight axes at 100 Hz; gaps between the setpoints of each as a listener's kernel stamps them.

    The age of the newest setpoint grows to the gap before the next one, so the longest gap is the oldest age.
    """
    motors = 8 // trains
    nodes = range(trains * motors)
    idling = min(IDLING, seconds)
    with Idler(idling) as idler, Drives(nodes) as drives, Listener(of_command(Command.SET_INPUT_VEL)) as listener:
        time.sleep(0.5)
        alone = idler.used()
        with commander(trains, motors, AXES_RATE, seconds + idling + 1.0, *options) as peer:
            since = float(peer.line().split()[1]) * 1e-9
            used, sent, began = cpu_of(drives.pid), sent_packets(), time.monotonic()
            while (left := began + seconds - time.monotonic()) > 0:
                tell(f"{len(nodes)} axes at {AXES_RATE:g} Hz, {left:.0f} s to go")
                time.sleep(min(5.0, left))
            heard, lost = listener.take(), listener.lost
            took = time.monotonic() - began
            emulator, frames = (cpu_of(drives.pid) - used) / took, (sent_packets() - sent) / took
            together = idler.used()
            said = json.loads(peer.line())
        frames_of = {n: [h.at for h in heard if node_of(h.id) == n and h.at >= since] for n in nodes}
    table: list[Row] = []
    everything: list[float] = []
    for node, times in frames_of.items():
        gaps = [(b - a) * 1e3 for a, b in itertools.pairwise(times)]
        everything += gaps
        table.append(_gap_row(f"node {node}", gaps))
    table.append(_gap_row("all", everything))
    lates, tooks = ([t * 1e3 for t in said[name][: int(seconds * AXES_RATE)]] for name in ("lates", "tooks"))
    each = f"commander {100 * said['cpu']:.0f}, emulated drives {100 * emulator:.0f}; "
    notes = [
        f"{trains} drive trains of {motors} axes, {seconds:g} s at {AXES_RATE:g} Hz; frames on the bus {frames:.0f}/s, "
        f"on a real one at most {100 * frames * worst_bits(8) / BIT_RATE:.0f} % of 250 kbit/s",
        f"CPU, % of a core: {'' if counts_ticks() else each}what an idle process misses: drives alone and listener "
        f"{100 * alone:.0f}, with the commander {100 * together:.0f}",
        f"commander's loop, ms: woken late p50 {quantile(lates, 0.5):.2f}, p99 {quantile(lates, 0.99):.2f}, "
        f"max {max(lates):.2f}; the drive() calls of one turn p50 {quantile(tooks, 0.5):.2f}, "
        f"p99 {quantile(tooks, 0.99):.2f}, max {max(tooks):.2f}; refused {said['refused']}; "
        f"garbage collections {len(said['collected'])}, the longest {1e3 * max(said['collected'], default=0.0):.2f}; "
        f"listener lost {lost}",
    ]
    return table, notes


def _gap_row(name: str, gaps: Sequence[float]) -> Row:
    late = sum(gap > AGE_AIM for gap in gaps)
    return {
        "setpoints of": name,
        "gaps": len(gaps),
        "p50, ms": quantile(gaps, 0.5),
        "p99, ms": quantile(gaps, 0.99),
        "longest, ms": max(gaps, default=math.nan),
        f"over {AGE_AIM:g} ms": late,
        "aim none": "missed" if late or not gaps else "met",
    }


def cpu_of(pid: int) -> float:
    """s of processor time of a process so far, by its clock (clock_getcpuclockid(3))."""
    return time.clock_gettime(~pid << 3 | 2)
