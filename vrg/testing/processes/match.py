"""Real matches of real processes, each with an observer on its bus.

Waits have deadlines in real time and conditions on what was observed; how long something took is told in match time
only, from the stamps of messages.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import psutil

from vrg.bus.messages import Stage
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.hal.can.link import Link
from vrg.launch.process import process_of
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind
from vrg.testing.can.vcan import UDP
from vrg.testing.processes.observer import Observer
from vrg.testing.processes.programs import SCREENS
from vrg.testing.waiting import DEADLINE, wait_until

FRESH_FOR = 90.0
"""s of play after which a shared match is too near its end for another test."""

START_PATIENCE = 120.0
"""s for play to begin: in a kernel with one CPU, drives may answer a player only at its second start."""
MINNOWS = ("ann", "bob", "cid")
PLAYERS = ("shark", *MINNOWS)


def match_text(
    name: str,
    *,
    length: float,
    width: float,
    zone: float,
    rules: str = "",
    rate: float = 1.0,
    wiring: dict[str, tuple[int, int]] | None = None,
    link: Link = UDP,
    can: str = "emulate = true",
) -> str:
    """A match file: one shark and three minnows, one pass, on open ground; they drive along y.

    Args:
        wiring: the nodes, left and right, of players whose robots are on a CAN bus. link: that bus.
        can: more of that backend's settings.
    """
    wiring = wiring or {}
    half, side = length / 2, width / 2
    places = {
        "shark": (0.0, zone / 2 - half, 90.0),
        "ann": (1.2 - side, half - zone / 2, -90.0),
        "bob": (0.0, half - zone / 2, -90.0),
        "cid": (side - 1.2, half - zone / 2, -90.0),
    }
    head = f"""
name = "{name}"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
rate = {rate}
seed = 5

[rules]
x = [{-side}, {side}]
y = [{-half}, {half}]
zone_depth = {zone}
{rules}
"""
    if wiring:
        head += f'\n[backends.can]\ninterface = "{link.interface}"\nchannel = "{link.channel}"\n{can}\n'
    for player, (left, right) in wiring.items():
        head += f"\n[backends.can.robots.{player}]\nleft = [{left}]\nright = [{right}]\nratio = 50.0\n"
    players = [
        f'[[players]]\nname = "{player}"\nrole = "{"shark" if player == "shark" else "minnow"}"\n'
        f'backend = "{"can" if player in wiring else "sim"}"\nx = {x}\ny = {y}\nheading = {heading}\n'
        for player, (x, y, heading) in places.items()
    ]
    return "\n".join([head, *players])


def long_match(name: str) -> str:
    """Two minutes pass before a shark and a minnow can meet."""
    return match_text(name, length=190.0, width=60.0, zone=6.0)


def patient(text: str) -> str:
    """A match that is halted, and can be resumed, where a player is away for so long that it would be taken out.

    On a slow machine a player that is started again may be.
    """
    return 'on_fault = "halt"\n' + text


def short_match(name: str, pass_limit: float = 10.0, rate: float = 2.0) -> str:
    """Over after one short pass, whoever wins."""
    rules = f"pass_limit = {pass_limit}"
    return match_text(name, length=13.0, width=9.0, zone=2.5, rules=rules, rate=rate)


def on_small_disk(folder: Path) -> list[str]:
    """What stands before a command to which a folder is a file system of 2 MB of its own."""
    return ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=2m tmpfs "$0" && exec "$@"', str(folder)]


class LauncherEndedError(AssertionError):
    """The launcher has ended although the test waits for something in the match."""


class LiveMatch:
    """A match that `vrg play` runs as processes; a context manager that leaves none of them behind.

    Args:
        folder: a fresh one for this match's files and state.
        text: of the match file.
        environment: added to this process' own.
        window: with a spectator's window.
        small_disk: a folder for its runs, which it alone sees as a file system of 2 MB.
        movers: players that move as soon as play goes on; none for a match that may be over soon.
        here: the launcher's working folder.
        seats: the match is played with seats: with keys for this run alone, or with those in this folder.
        options: more options of `vrg play`.

    Attributes:
        abused: True once a test has published what no node publishes.
    """

    def __init__(
        self,
        folder: Path,
        text: str,
        *,
        environment: dict[str, str] | None = None,
        window: bool = False,
        small_disk: Path | None = None,
        movers: Sequence[str] = MINNOWS,
        here: Path | None = None,
        seats: bool | Path = False,
        options: Sequence[str] = (),
    ) -> None:
        self.movers = movers
        self.abused = False
        self._observers: list[Observer] = []
        self.file = folder / "match.toml"
        self.file.write_text(text, encoding="utf-8")
        self.output = folder / "output.txt"
        self._small_disk = small_disk
        self._runs = small_disk or folder / "runs"
        self._state_home = folder / "state"
        self._state_home.mkdir()
        self._environment = {k: v for k, v in os.environ.items() if k not in SCREENS} | (environment or {})
        self._environment |= {"XDG_STATE_HOME": str(self._state_home), "PYTHONUNBUFFERED": "1"}
        command = [sys.executable, "-P", "-m", "vrg", "play", str(self.file), "--runs", str(self._runs)]
        secured = ["--keys", str(seats)] if isinstance(seats, Path) else ["--seats"] if seats else []
        wrap = [] if small_disk is None else on_small_disk(small_disk)
        with self.output.open("wb") as output:
            self.launcher = subprocess.Popen(
                [*wrap, *command, *([] if window else ["--headless"]), *secured, *options],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=self._environment,
                cwd=here,
                start_new_session=True,
            )
        self._resources = contextlib.ExitStack()
        self._closed = False

    def __enter__(self) -> "LiveMatch":
        try:
            self._connect()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _connect(self) -> None:
        registry = self._state_home / "vrg"
        wait_until(lambda: list(registry.glob("*.json")), "the match to register itself", self.check_launcher)
        entry = json.loads(next(registry.glob("*.json")).read_text())
        assert entry["pid"] == self.launcher.pid
        self.endpoint: str = entry["router"]
        self.keys = Keys(entry["match"])
        self.seats = Path(entry["keys"]) if entry["keys"] else None
        run = Path(entry["run"])
        if self._small_disk is not None:
            run = Path(f"/proc/{self.launcher.pid}/root{run}")
        self.run = RunFolder(run)
        self.observer = self.join()
        # A short match may be over before this process, on a busy machine, has heard that it began.
        with contextlib.suppress(LauncherEndedError) if not self.movers else contextlib.nullcontext():
            self.observer.wait_until(lambda: self.observer.playing, "play to begin", START_PATIENCE)
            self.observer.wait_moving(*self.movers)

    def join(self, seat: Seat = Seat(SeatKind.OFFICIAL)) -> Observer:  # noqa: B008 - it cannot change
        """A further observer, from now on; in a match with seats, one that has this seat."""
        credentials = None if self.seats is None else find_credentials(self.seats, [seat])
        session = self._resources.enter_context(open_session(self.endpoint, credentials=credentials))
        self._observers.append(Observer(session, self.keys, self.check_launcher))
        return self._observers[-1]

    def check_launcher(self) -> None:
        """Make sure that the launcher runs."""
        if self.launcher.poll() is not None:
            raise LauncherEndedError(f"vrg play ended with status {self.launcher.returncode}:\n{self.said()}")

    def said(self) -> str:
        """What the launcher has printed so far, unwrapped."""
        return " ".join(self.output.read_text(encoding="utf-8", errors="replace").split())

    def log(self, name: str) -> str:
        """A process' log so far."""
        return (self.run.logs / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def child(self, name: str) -> psutil.Process:
        """The process of a player or tracker by its name, or `router`, `world`, `coordinator`, `recorder`, `drives`."""
        for process in psutil.Process(self.launcher.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                if _node(process.cmdline()) == name:
                    return process
        raise AssertionError(f"no process {name} runs; {self.said()}")

    def vrg(self, *arguments: str, timeout: float = DEADLINE) -> subprocess.CompletedProcess[str]:
        """Run another `vrg` command on this machine."""
        return subprocess.run(
            [sys.executable, "-m", "vrg", *arguments],
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
            stdin=subprocess.DEVNULL,
        )

    def command(self, *arguments: str) -> str:
        """Run another `vrg` command that succeeds; what it printed."""
        done = self.vrg(*arguments)
        assert done.returncode == 0, f"vrg {' '.join(arguments)}: status {done.returncode}: {done.stdout}{done.stderr}"
        return done.stdout

    def resume(self) -> None:
        """Continue after a halt."""
        self.observer.wait_until(lambda: self.observer.state.halted, "a halt")
        self.go_on()

    def go_on(self, *beside: "LiveMatch") -> None:
        """Wait until play goes on and everybody moves who may; whatever halts it, an official resumes it in time.

        Args:
            beside: other matches that have to go on as well.
        """
        observer = self.observer

        def goes_on() -> bool:
            observer.resume()
            for match in beside:
                match.observer.look()
                match.observer.resume()
            return all(match.observer.playing and match.observer.moving(*match.movers) for match in (self, *beside))

        observer.wait_until(goes_on, "play to go on, and players to move")

    def play_out(self, patience: float = 240.0, *, physical: bool = False) -> int:
        """Wait for the end of the game and of the launcher; play is resumed when the machine stood still.

        Args:
            physical: it has physical robots, which are recovered, too: their drives may be late on a slow machine.

        Returns:
            the launcher's exit status.
        """
        observer = self.observer

        def over() -> bool:
            if physical:
                observer.go_on()
            elif observer.stalled:
                observer.resume()
            return observer.state.stage is Stage.GAME_OVER

        # The launcher ends by itself, perhaps before this test has heard the end of the game.
        with contextlib.suppress(LauncherEndedError):
            observer.wait_until(over, "the game to be over", patience)
        return self.wait_ended()

    def lose_router(self) -> None:
        """Kill the router, and go on over the one that takes its place."""
        observer, old = self.observer, self.child("router")
        old.kill()
        self.wait_replaced("router", old)
        heard = len(observer.heard.clocks)
        observer.wait_until(lambda: len(observer.heard.clocks) > heard, "the clock over the new router")
        observer.time_passes(1.0, "with the new router")
        self.go_on()

    def wait_replaced(self, name: str, old: psutil.Process) -> psutil.Process:
        """Wait until another process has taken the place of one that died or hung; the old one is gone."""
        found: list[psutil.Process] = []

        def replaced() -> bool:
            with contextlib.suppress(AssertionError):
                found[:] = [self.child(name)]
            return bool(found) and found[0].pid != old.pid

        self.observer.wait_until(replaced, f"{name} to be started again")
        assert not old.is_running(), f"the old {name} still runs"
        return found[0]

    def survivors(self) -> list[psutil.Process]:
        """Every process that this match has started, the launcher included, and that runs."""
        mine = (str(self._state_home), str(self._runs))
        return [p for p in psutil.process_iter() if p.pid != os.getpid() and _lives_in(p, *mine)]

    def wait_said(self, words: str) -> None:
        """Wait until the launcher has printed this: it may do a thing before it tells so."""
        wait_until(lambda: words in self.said(), f"the launcher to say {words!r}")

    def wait_ended(self, patience: float = DEADLINE) -> int:
        """Wait for the launcher's end, and assert that no process is left; the launcher's exit status."""
        self._resources.close()
        status = self.launcher.wait(patience)
        left = self.survivors()
        assert not left, f"left behind: {[p.cmdline() for p in left]}"
        return status

    @property
    def healthy(self) -> bool:
        """Whether another test can use this match: play goes on, and long enough."""
        with contextlib.suppress(AssertionError):
            self.observer.look()
            self.observer.time_passes(0.3, "a sign of life")
            return self.observer.playing and self.observer.state.clock < FRESH_FOR
        return False

    def close(self) -> None:
        """End the match if it still runs. Idempotent.

        Raises:
            AssertionError: a process is left behind; it is killed.
        """
        if self._closed:
            return
        self._closed = True
        self._resources.close()
        if self.launcher.poll() is None:
            self.launcher.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.launcher.wait(DEADLINE)
        left = self.survivors()
        for process in left:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        if self.launcher.poll() is None:
            self.launcher.wait(DEADLINE)
        assert not left, f"left behind: {left}\n{self.said()}"
        if not self.abused:
            self._check_messages()

    def _check_messages(self) -> None:
        """Make sure that no node was handed what was not meant for it."""
        if not hasattr(self, "run"):
            return
        for log in self.run.logs.glob("*.log"):
            bad = [line for line in log.read_text(errors="replace").splitlines() if "dropped a bad message" in line]
            assert not bad, f"{log.name}: {bad}"
        assert not (wrong := [pair for observer in self._observers for pair in observer.heard.misrouted]), wrong


def _node(command: list[str]) -> str | None:
    """Which process of a match this is, by its command line or its title; None for any other."""
    if command[1:4] == ["-P", "-m", "vrg"]:  # python -P -m vrg node drives ...
        return "drives"
    if command[1:4] == ["-P", "-m", "vrg.launch.process_main"]:
        command = process_of(command[4]).title.split()
    words = " ".join(command).split()  # vrg player NAME in RUN
    if words[:1] != ["vrg"] or len(words) < 2:
        return None
    return words[2] if words[1] in ("player", "tracker") else words[1]


def _lives_in(process: psutil.Process, state_home: str, runs: str) -> bool:
    """Whether a process has inherited a match's state folder, or writes to a log of it: nobody else does."""
    with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied, OSError):
        if process.status() == psutil.STATUS_ZOMBIE:
            return False
        # A router reads what it prints itself; what it logs goes to its second descriptor.
        outputs = [os.readlink(f"/proc/{process.pid}/fd/{number}") for number in (1, 2)]
        return process.environ().get("XDG_STATE_HOME") == state_home or any(o.startswith(runs) for o in outputs)
    return False
