"""How long an emergency stop and a seat wait at the router while strangers without keys connect to its port.

A match with seats (`courtyard`, engine `planar`) runs on this machine, and strangers come over loopback: 1,500 at once,
or 30 a second. They close their connection at once, stay silent, send rubbish, begin a handshake and leave in its
middle, or begin one and stay silent.

- Estop: the time of the whole command `vrg estop`, which ends when the referee has confirmed it.
- Seat: from the first try of a player's process to connect until the clock of the match arrives there.
"""

import resource
import secrets
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

from common import arguments, show

sys.path.insert(0, str(Path(__file__).parents[1]))

from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.errors import BusError
from vrg.hosts import host_of, port_of
from vrg.launch.running import RunningMatch, running
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind

CROWD = 1500
"""Strangers that come at once."""
RATE = 30.0
"""Strangers that come in a second, otherwise."""
AHEAD = 0.5
"""s that the strangers come before the seat and the official."""
LONGEST = 60.0
"""s to wait for an emergency stop or a seat."""


@cache
def hello() -> bytes:
    """The first message of a TLS handshake."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    outgoing = ssl.MemoryBIO()
    try:
        context.wrap_bio(ssl.MemoryBIO(), outgoing).do_handshake()
    except ssl.SSLWantReadError:
        return outgoing.read()
    raise AssertionError("a handshake ended without an answer")


def _stay(_connection: socket.socket) -> None:
    pass


def _leave(connection: socket.socket) -> None:
    connection.close()


def _rubbish(connection: socket.socket) -> None:
    connection.sendall(secrets.token_bytes(300))


def _begin(connection: socket.socket) -> None:
    connection.sendall(hello())


def _break_off(connection: socket.socket) -> None:
    connection.settimeout(LONGEST)
    connection.sendall(hello())
    connection.recv(1)
    connection.close()


STRANGERS: dict[str, Callable[[socket.socket], None]] = {
    "close at once": _leave,
    "stay silent": _stay,
    "send rubbish": _rubbish,
    "break a handshake off": _break_off,
    "begin a handshake": _begin,
}


def come(host: str, port: int, kind: str, rate: float) -> None:
    """Be strangers: CROWD at once, or `rate` a second, until standard input is closed."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 16384), most))
    act, kept, gone = STRANGERS[kind], [], threading.Event()

    def one() -> None:
        try:
            kept.append(socket.create_connection((host, port), timeout=LONGEST))
            act(kept[-1])
        except OSError:
            pass

    def several(number: int) -> None:
        for _ in range(number):
            one()

    hello()  # the strangers take no more of this machine's time than they must
    print("here", flush=True)
    threading.Thread(target=lambda: (sys.stdin.read(), gone.set()), daemon=True).start()
    if rate:
        while not gone.wait(1 / rate):
            threading.Thread(target=one, daemon=True).start()
        return
    for _ in range(50):
        threading.Thread(target=several, args=(CROWD // 50,), daemon=True).start()
    gone.wait()


@contextmanager
def strangers(endpoint: str, kind: str, rate: float) -> Iterator[None]:
    """Let strangers come as long as the context lasts."""
    command = [sys.executable, __file__, "--come", host_of(endpoint), port_of(endpoint), kind, str(rate)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(AHEAD)
        yield
        process.stdin.close()
        process.kill()


@contextmanager
def match(folder: Path) -> Iterator[RunningMatch]:
    """A match with seats that runs."""
    command = [sys.executable, "-m", "vrg", "play", "sharks-and-minnows", "--engine", "planar", "--seats", "--headless"]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL
    ) as process:
        try:
            deadline = time.monotonic() + LONGEST
            while not (found := [m for m in running() if m.pid == process.pid]):
                assert time.monotonic() < deadline, "expected a match that runs, found none"
                time.sleep(0.1)
            seat_time(found[0])
            yield found[0]
        finally:
            process.terminate()


def seat_time(running_match: RunningMatch, patience: float = LONGEST) -> float | None:
    """The time in s until a player's process hears the match; None if it does not in `patience` seconds."""
    heard = threading.Event()
    credentials = find_credentials(Path(running_match.keys), [Seat(SeatKind.PLAYER, "player1")])
    start = time.monotonic()
    try:
        with open_session(running_match.router, patience=patience, credentials=credentials) as session:
            session.watch_raw(Keys(running_match.match).clock.key, lambda _key, _data: heard.set())
            return time.monotonic() - start if heard.wait(patience) else None
    except BusError as error:
        print(error, file=sys.stderr)
        return None


def estop_time(running_match: RunningMatch) -> float | None:
    """The time in s of `vrg estop`; None if it fails."""
    start = time.monotonic()
    # Not by its name, because other matches of that name may run.
    where = [running_match.match, "--router", running_match.router, "--keys", running_match.keys]
    ended = subprocess.run([sys.executable, "-m", "vrg", "estop", *where], check=False, capture_output=True, text=True)
    taken = time.monotonic() - start
    if ended.returncode:
        print(f"after {taken:.1f} s: {ended.stderr.strip()}", file=sys.stderr)
        return None
    return taken


def main() -> None:
    """Let each kind of strangers come in both ways, and print one table."""
    parser = arguments(__doc__)
    parser.add_argument("--come", nargs=4, help="for the benchmark's own processes")
    options = parser.parse_args()
    if options.come:
        host, port, kind, rate = options.come
        come(host, int(port), kind, float(rate))
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder, match(Path(folder)) as found:
        cases = [("none", 0.0), *((kind, rate) for kind in STRANGERS for rate in (0.0, RATE))]
        for kind, rate in cases[:3] if options.quick else cases:
            row: dict[str, object] = {"strangers": kind, "how many": f"{rate:g}/s" if rate else f"{CROWD} at once"}
            for name, measure in (("estop s", estop_time), ("seat s", seat_time)):
                with ExitStack() as stack:
                    if kind != "none":
                        stack.enter_context(strangers(found.router, kind, rate))
                    taken = measure(found)
                row[name] = None if taken is None else round(taken, 2)
                seat_time(found, 10 * LONGEST)  # the strangers of one measurement are no part of the next
            rows.append(row)
            print(row, file=sys.stderr)
    show("strangers at the router's port", rows, ["- is a failure"], as_json=options.json)


if __name__ == "__main__":
    main()
