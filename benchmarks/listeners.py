"""What slow listeners do to a match: RoboFlag of eight robots over processes, heard for five minutes by three of them.
Each subscribes to everything, which is 165 kB a second.

    rate     behind a relay that lets 60 kB a second through
    slow     its callback takes 0.2 s for each message
    frozen   its process is stopped (SIGSTOP)

A listener whose link is never lost hears the clock somewhat late: `delay` is for how long the newest clock message that
it has was heard before by one who is not slow. A gap is the time between two clock messages at the latter.
"""

import contextlib
import itertools
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from common import arguments, endpoint_of, playing, quantile, show

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.config.loading import match_path
from vrg.hosts import host_of, port_of

SECONDS = 300.0
BYTES_PER_SECOND = 60_000
CALLBACK_SECONDS = 0.2
LOST = "the link to the router was lost"
KEYS = Keys("roboflag")
CHUNK = 1500
"""The bytes that the relay lets through at a time."""


class Relay:
    """Passes TCP connections on to a router, and what comes back at a rate, in a thread for each direction."""

    def __init__(self, endpoint: str) -> None:
        self._router = host_of(endpoint), int(port_of(endpoint))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self.passed = self.links = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            client, _ = self._listener.accept()
            router = socket.socket()
            router.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16_384)
            router.connect(self._router)
            client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16_384)
            self.links += 1
            for source, target, rate in ((client, router, 0), (router, client, BYTES_PER_SECOND)):
                threading.Thread(target=self._pass, args=(source, target, rate), daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket, rate: int) -> None:
        due = time.monotonic()
        with contextlib.suppress(OSError):
            while data := source.recv(CHUNK):
                if rate:
                    self.passed += len(data)
                    due = max(due, time.monotonic()) + len(data) / rate
                    time.sleep(max(0.0, due - time.monotonic()))
                target.sendall(data)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


def listen(role: str, endpoint: str) -> None:
    """Be a listener, and print real time and match time of the newest clock message twenty times a second."""
    with open_session(endpoint) as session:
        mailbox = Mailbox()
        clock = mailbox.subscribe(KEYS.clock)
        pause = CALLBACK_SECONDS if role == "slow" else 0.0
        session.watch_raw(f"{KEYS.root}/**", lambda *_: time.sleep(pause))
        session.attach(mailbox)
        while True:
            time.sleep(0.05)
            session.receive()
            mailbox.handover(0.0)
            for message in clock.take():
                print(time.monotonic(), message.stamp, flush=True)


@contextlib.contextmanager
def listener(role: str, endpoint: str, folder: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """A process of a listener. It prints and logs into files."""
    with (folder / f"{role}.txt").open("wb") as out, (folder / f"{role}.log").open("wb") as err:
        process = subprocess.Popen([sys.executable, __file__, "--be", role, endpoint], stdout=out, stderr=err)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def main() -> None:
    """Play the match, and print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--be", nargs=2, help="be a listener")
    options = parser.parse_args()
    if options.be:
        listen(*options.be)
        return
    seconds = 20.0 if options.quick else options.seconds
    heard: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        text = match_path("roboflag").read_text().replace("[rules]", '[rules]\ncaptures = 1000\nlineup = "place"')
        (folder / "match.toml").write_text(text)
        launcher = stack.enter_context(playing(folder, "--headless"))
        endpoint = endpoint_of(launcher.pid)
        session = stack.enter_context(open_session(endpoint))
        clocks = Mailbox()
        inlet = clocks.subscribe(KEYS.clock, alarm=lambda clock: heard.append((time.monotonic(), clock.stamp)))
        assert inlet.topic.type is Clock
        session.attach(clocks)
        while not heard:
            time.sleep(0.1)
        time.sleep(5.0)
        relay = Relay(endpoint)
        began = time.monotonic()
        for role in ("rate", "slow", "frozen"):
            process = stack.enter_context(listener(role, relay.endpoint if role == "rate" else endpoint, folder))
        time.sleep(5.0)
        os.kill(process.pid, signal.SIGSTOP)
        time.sleep(seconds)
        passed = relay.passed / (time.monotonic() - began)
        times = [at for at, _ in heard if at >= began]
        gaps = [after - before for before, after in itertools.pairwise(times)]
        gaps.append(time.monotonic() - times[-1])
        first: dict[float, float] = {}
        for at, stamp in heard:
            first.setdefault(stamp, at)
        rows = []
        for role in ("rate", "slow", "frozen"):
            lines = [line.split() for line in (folder / f"{role}.txt").read_text().splitlines()]
            late = [float(at) - first[float(stamp)] for at, stamp in lines if float(stamp) in first]
            rows.append({
                "listener": role,
                "links lost": (folder / f"{role}.log").read_text().count(LOST),
                "clocks a second": len(lines) / (time.monotonic() - began),
                "delay p50, s": quantile(late, 0.5) if late else None,
                "worst, s": max(late, default=None),
            })  # fmt: skip
        logs = {log.stem: log.read_text(errors="replace") for log in folder.glob("runs/*/logs/*.log")}
        lost = {stem: text.count(LOST) for stem, text in sorted(logs.items()) if LOST in text}
        stops = {stem: text.count("the world's clock has stopped") for stem, text in sorted(logs.items())}
        notes = [
            f"{seconds:g} s: longest gap of the clock {max(gaps):.2f} s, {sum(gap > 0.5 for gap in gaps)} above 0.5 s",
            f"links lost by processes of the match: {lost or 'none'}; clocks that stopped: {sum(stops.values())}",
            f"the relay has passed {passed / 1000:.0f} kB/s, over {relay.links} links",
        ]
    show("Slow listeners", rows, notes, as_json=options.json)


if __name__ == "__main__":
    main()
