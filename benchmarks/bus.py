"""Round trips and throughput of the bus between two processes, beside bare zenoh, pyzmq and cyclonedds.

    vrg.bus      Session, Mailbox and codec with real messages: an arrival wakes a waiting thread, which receives, hands
                 over, takes and publishes, as a node's executor does
    zenoh        bare zenoh-python on the same path, client to router to client, with the same settings and as many
                 bytes: a callback enqueues, a thread takes and publishes
    pyzmq        a PAIR of sockets over tcp, with no router between
    cyclonedds   a writer and a reader each way over udp, with no router between

All on loopback. Each round takes every system in turn, so that they share what else the machine does; `x zenoh` is the
median over the rounds of the ratio to bare zenoh in the same round.

Round trip: 1 KB there and back, `busy` = the next at once, `idle` = 2 ms after the last, when both cores have gone to
sleep. Throughput: bursts of 64 messages one way, each on a key of its own, at most two bursts on the way;
the receiver confirms each burst, so nothing is counted that did not arrive. `lost` counts bursts never confirmed.
Messages of vrg.bus are of quality LATEST: a Laser for 1 KB, a Report for 64 B.
"""

import importlib.util
import multiprocessing
import queue
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from bus_links import AIM, BEAT, BURST, GAP, KINDS, LARGE, LOST_AFTER, PATIENCE, PAYLOADS, SMALL, Link
from common import arguments, median, quantile, show

from vrg.bus.session import open_session


def pong(kind: str, address: str, pipe: Connection) -> None:
    """The other process: does as ordered, `echo` or `sink`, until the next order; ends with its parent."""
    sys.setswitchinterval(1e-3)
    orders: queue.SimpleQueue[str] = queue.SimpleQueue()
    link = KINDS[kind]("pong", address)
    try:
        link.open()
        pipe.send("open")
        link.find()
        pipe.send("ready")
        threading.Thread(target=_hear, args=(pipe, orders), daemon=True).start()
        while (order := orders.get()) != "end":
            pipe.send(order)
            (_echo if order == "echo" else _sink)(link, orders)
    finally:
        link.close()


def _hear(pipe: Connection, orders: "queue.SimpleQueue[str]") -> None:
    try:
        while True:
            orders.put(pipe.recv())
    except (EOFError, OSError):
        orders.put("end")


def _echo(link: Link, orders: "queue.SimpleQueue[str]") -> None:
    while orders.empty():
        for _ in range(link.receive(BEAT)):
            link.send(LARGE, 0)


def _sink(link: Link, orders: "queue.SimpleQueue[str]") -> None:
    held = confirmed = 0
    while orders.empty():
        held += link.receive(BEAT)
        while held >= BURST:
            held -= BURST
            link.send(SMALL, confirmed % (2 * BURST))
            confirmed += 1


@dataclass
class System:
    """One system under test, with what was measured: a value a round, in us and messages/s."""

    name: str
    link: Link
    pipe: Connection
    busy: list[list[float]] = field(default_factory=list)
    idle: list[list[float]] = field(default_factory=list)
    small: list[float] = field(default_factory=list)
    large: list[float] = field(default_factory=list)
    lost: int = 0

    def order(self, what: str) -> None:
        """Tell the other process what to do; waits until it does."""
        self.pipe.send(what)
        if not self.pipe.poll(PATIENCE) or self.pipe.recv() != what:
            raise TimeoutError(f"{self.name}: the other process does not answer")

    def round_trips(self, count: int, gap: float) -> list[float]:
        """us each. What gets lost is counted and left out."""
        self.order("echo")
        while self.link.receive(BEAT):
            pass
        times = []
        for _ in range(count):
            if gap:
                time.sleep(gap)
            began = time.perf_counter()
            self.link.send(LARGE, 0)
            if self._await(began + LOST_AFTER):
                times.append((time.perf_counter() - began) * 1e6)
            else:
                self.lost += 1
        return times

    def _await(self, deadline: float) -> int:
        while not (found := self.link.receive(LOST_AFTER)):
            if time.perf_counter() > deadline:
                return 0
        return found

    def throughput(self, size: str, seconds: float) -> float:
        """Messages confirmed each second."""
        self.order("sink")
        while self.link.receive(BEAT):
            pass
        sent = confirmed = given_up = 0
        began = last = time.perf_counter()
        while (going := time.perf_counter() < began + seconds) or sent > confirmed + given_up:
            if going and sent - confirmed - given_up < 2:
                self.link.send_burst(size, sent % 2 * BURST)
                sent += 1
            elif found := self._await(time.perf_counter() + LOST_AFTER):
                confirmed += found
                last = time.perf_counter()
            else:
                given_up = sent - confirmed
        self.lost += given_up
        return confirmed * BURST / (last - began) if confirmed else 0.0


@contextmanager
def _router(endpoint: str) -> Iterator[None]:
    """A router in a process of its own, as `vrg play` starts it; it ends with this process."""
    command = [sys.executable, "-m", "vrg", "node", "router", "--router", endpoint, "--leash"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        with open_session(endpoint, patience=PATIENCE):
            pass  # it answers
        yield
    finally:
        process.terminate()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()


@contextmanager
def _system(name: str, address: str) -> Iterator[System]:
    """Both ends of one system, connected."""
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe()
    child = context.Process(target=pong, args=(name, address, theirs), daemon=True)
    child.start()
    theirs.close()
    link = KINDS[name]("ping", address)
    try:
        link.open()
        _expect(mine, "open", name)
        link.find()
        _expect(mine, "ready", name)
        yield System(name, link, mine)
    finally:
        mine.close()
        link.close()
        child.join(5.0)
        if child.is_alive():
            child.kill()


def _expect(pipe: Connection, word: str, name: str) -> None:
    if not pipe.poll(PATIENCE + 5.0) or pipe.recv() != word:
        raise TimeoutError(f"{name}: the other process did not get to {word!r}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def measure(systems: list[System], rounds: int, trips: int, seconds: float) -> None:
    """Every system in turn; each measurement follows a bare one of the same kind closely. Turns go both ways."""
    for round_ in range(rounds):
        order = systems if round_ % 2 == 0 else systems[::-1]
        for system in order:
            system.busy.append(system.round_trips(trips, 0.0))
        for system in order:
            system.idle.append(system.round_trips(trips // 4, GAP))
        for system in order:
            system.small.append(system.throughput(SMALL, seconds))
        for system in order:
            system.large.append(system.throughput(LARGE, seconds))


def _rows(systems: list[System]) -> list[dict[str, Any]]:
    bare = next(s for s in systems if s.name == "zenoh")
    rows = []
    for s in systems:
        row: dict[str, Any] = {"system": s.name}
        for kind in ("busy", "idle"):
            rounds, beside = getattr(s, kind), getattr(bare, kind)
            row[f"{kind} p50, us"] = median([quantile(times, 0.5) for times in rounds])
            row[f"{kind} p99"] = median([quantile(times, 0.99) for times in rounds])
            ratio = median([quantile(a, 0.5) / quantile(b, 0.5) for a, b in zip(rounds, beside, strict=True)])
            row[f"{kind} x zenoh"] = round(ratio, 2)
        for kind, size in (("small", SMALL), ("large", LARGE)):
            rates, beside = getattr(s, kind), getattr(bare, kind)
            row[f"{size}, msg/s"] = median(rates)
            row[f"{size} x zenoh"] = round(median([a / b for a, b in zip(rates, beside, strict=True)]), 2)
        row["lost"] = s.lost
        rows.append(row)
    return rows


def _verdict(rows: list[dict[str, Any]]) -> list[str]:
    ours = next(row for row in rows if row["system"] == "vrg.bus")
    notes = []
    for kind in ("busy", "idle"):
        ratio = ours[f"{kind} x zenoh"]
        met = "met" if ratio <= AIM else "missed"
        notes.append(f"aim: a round trip within {AIM} x bare zenoh on the same path; {kind}: {ratio:.2f}, {met}")
    return notes


def main() -> None:
    """Run the benchmark, and print its table."""
    options = arguments(__doc__).parse_args()
    sys.setswitchinterval(1e-3)
    port = _free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    addresses = {"vrg.bus": endpoint, "zenoh": endpoint, "pyzmq": f"127.0.0.1:{_free_port()}", "cyclonedds": "-"}
    notes = [f"{LARGE} = {len(PAYLOADS[LARGE])} B and {SMALL} = {len(PAYLOADS[SMALL])} B on the wire"]
    with ExitStack() as stack:
        stack.enter_context(_router(endpoint))
        systems = []
        for name, module in (("vrg.bus", "zenoh"), ("zenoh", "zenoh"), ("pyzmq", "zmq"), ("cyclonedds", "cyclonedds")):
            if importlib.util.find_spec(module) is None:
                notes.append(f"{name}: not installed (pip install -e .[bench])")
                continue
            systems.append(stack.enter_context(_system(name, addresses[name])))
        measure(systems, 1, 100, 0.1)
        systems = [System(s.name, s.link, s.pipe) for s in systems]  # without the warm-up
        measure(systems, 2 if options.quick else 10, 400 if options.quick else 2000, 0.3 if options.quick else 1.0)
        rows = _rows(systems)
    show("The bus between two processes", rows, [*_verdict(rows), *notes], as_json=options.json)


if __name__ == "__main__":
    main()
