"""How robots stop when something goes wrong: a match of processes with twenty faults, and its stop certificate.

One shark and four minnows cross a field of 190 m with the engine `planar`. While all minnows drive, one fault happens
at a time; the next one follows when all minnows drive again. The faults: a player is killed (SIGKILL) or frozen
(SIGSTOP), so are the referee, the world and the router, an official halts play, and the emergency stop is engaged. The
table is made of result.json alone, as `vrg run stops RUN` makes it. A stop counts from the newest message of a process
that died, from the referee's decision to halt, or from the order of an emergency stop.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
from common import arguments, quantile, show

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message, Official, OfficialAction
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys, Topic

PATIENCE = 60.0
"""The real time in s for which a condition is waited for."""
DRIVES = 0.4
"""The speed in m/s above which a robot counts as driving."""
MINNOWS = ("ann", "bob", "cid", "dee")
NAME = "stops"
MATCH = """
name = "stops"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = 3

[rules]
x = [-40.0, 40.0]
y = [-95.0, 95.0]
zone_depth = 6.0
pass_limit = 3000.0
"""
FAULTS = (
    "kill ann", "freeze bob", "halt", "kill cid", "estop", "kill referee", "kill dee", "kill world", "freeze ann",
    "kill router", "kill bob", "halt", "freeze referee", "kill cid", "estop", "freeze dee", "kill world", "kill ann",
    "freeze world", "kill router",
)  # fmt: skip


def main() -> None:
    """Play the match, and print the tables."""
    parser = arguments(__doc__)
    options = parser.parse_args()
    faults = FAULTS[:3] if options.quick else FAULTS
    with tempfile.TemporaryDirectory() as folder, _match(Path(folder)) as match:
        for number, fault in enumerate(faults, 1):
            if not options.json:
                print(f"{number} of {len(faults)}: {fault}", file=sys.stderr)
            match.suffer(fault)
        told = match.end()
    rows = [_row(kind, told) for kind in sorted({_kind(incident) for incident in told["incidents"]})]
    robots = [stop for incident in told["incidents"] for stop in incident["robots"].values()]
    notes = [
        told["sentence"],
        f"{len(faults)} faults, {len(told['incidents'])} incidents, {len(robots)} robots that had to stand; times are "
        f"match time at rate 1, good to {told['resolution']:.2f} s",
        f"{told['refused']} messages under a wrong key were refused, none was handed to a node",
        *told["notes"],
    ]
    show(f"Stops after {len(faults)} faults", rows, notes, as_json=options.json)


def _kind(incident: dict[str, Any]) -> str:
    """What kind of fault an incident is, for the table."""
    if incident["kind"] == "halt":
        return "HALT by an official" if "called by" in incident["what"] else "HALT after a death"
    if incident["kind"] == "estop":
        return "emergency stop"
    who = "player" if incident["process"] in MINNOWS else incident["process"]
    return f"{who} {'frozen' if incident['what'].endswith('killed') else 'killed'}"


def _row(kind: str, told: dict[str, Any]) -> dict[str, Any]:
    incidents = [incident for incident in told["incidents"] if _kind(incident) == kind]
    stops = [stop for incident in incidents for stop in incident["robots"].values()]
    moved = [stop for stop in stops if stop["outcome"] not in ("stood already", "was not recorded")]
    seconds = [stop["seconds"] for stop in moved if stop["outcome"] == "stopped"]
    distances = [stop["distance"] for stop in moved]
    return {
        "kind": kind,
        "incidents": len(incidents),
        "moved": len(moved),
        "p50, s": quantile(seconds, 0.5) if seconds else None,
        "worst, s": max(seconds, default=None),
        "p50, m": quantile(distances, 0.5) if distances else None,
        "worst, m": max(distances, default=None),
        "moved again": sum(stop["again"] is not None for stop in moved),
        "did not stand": sum(stop["outcome"] != "stopped" and stop["again"] is None for stop in moved),
    }


class _Match:
    """A running match, heard and hurt."""

    def __init__(self, launcher: "subprocess.Popen[bytes]", session: Session, folder: Path) -> None:
        self._launcher = launcher
        self._session = session
        self._folder = folder
        self._keys = Keys(NAME)
        self._mailbox = Mailbox("official/benchmark")
        self._poses = self._mailbox.subscribe(self._keys.poses)
        self._state = self._mailbox.subscribe(self._keys.referee_state)
        session.attach(self._mailbox)
        self._wait(self._all_drive, "the minnows to drive")

    def suffer(self, fault: str) -> None:
        """Let a fault happen, and get all minnows to drive again."""
        what, *who = fault.split()
        if what == "halt":
            self._say(self._keys.official, Official(action=OfficialAction.HALT, by="benchmark"))
            self._wait(self._halted, "a halt")
        elif what == "estop":
            self._say(self._keys.estop, Estop(by="benchmark"))
            self._wait(lambda: self._estopped() and self._all_stand(), "all robots to stand")
            self._say(self._keys.estop_release, EstopRelease(by="benchmark"))
        else:
            process = self._process(who[0])
            process.send_signal(signal.SIGKILL if what == "kill" else signal.SIGSTOP)
            self._wait(lambda: not _lives(process), f"the end of {who[0]}")
        time.sleep(1.0)  # so that the next fault is not a part of this one
        self._wait(self._all_drive, f"the minnows to drive after {fault}", resume=True)
        time.sleep(1.0)

    def end(self) -> dict[str, Any]:
        """End the match, and return its certificate."""
        self._launcher.send_signal(signal.SIGINT)
        self._launcher.wait(PATIENCE)
        [result] = self._folder.glob("runs/*/result.json")
        told: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
        logs = "".join(log.read_text(encoding="utf-8", errors="replace") for log in result.parent.glob("logs/*.log"))
        if "dropped a bad message" in logs:
            line = next(line for line in logs.splitlines() if "dropped a bad message" in line)
            raise RuntimeError(f"a node was handed a message that was not meant for it: {line}")
        refused = sum(sum(keys.values()) for keys in told["refused"].values())
        return {**told["stops"], "refused": refused}

    def _process(self, name: str) -> psutil.Process:
        name = "coordinator" if name == "referee" else name
        for child in psutil.Process(self._launcher.pid).children(recursive=True):
            with contextlib.suppress(psutil.Error):
                words = " ".join(child.cmdline()).split()
                if words[:1] == ["vrg"] and name in words[1:3]:
                    return child
        raise RuntimeError(f"no process of {name} runs")

    def _say(self, topic: Topic[Any], message: Message) -> None:
        self._mailbox.publish(topic, message)
        out = self._mailbox.collect()
        self._session.wait_for_listener(topic.key, topic.qos, PATIENCE)
        self._session.send(out)

    def _halted(self) -> bool:
        return self._state.latest is not None and self._state.latest.body.halted is not None

    def _estopped(self) -> bool:
        return self._state.latest is not None and self._state.latest.body.estop

    def _speeds(self) -> list[float]:
        poses = self._poses.latest
        return [] if poses is None else [abs(body.twist.v) for body in poses.body.bodies if body.name in MINNOWS]

    def _all_drive(self) -> bool:
        return not self._halted() and bool(self._speeds()) and min(self._speeds()) > DRIVES

    def _all_stand(self) -> bool:
        return max(self._speeds()) == 0.0

    def _wait(self, condition: Callable[[], bool], what: str, *, resume: bool = False) -> None:
        deadline, asked = time.monotonic() + PATIENCE, 0.0
        while True:
            self._session.receive()
            self._mailbox.handover(0.0)
            if condition():
                return
            now = time.monotonic()
            if now > deadline or self._launcher.poll() is not None:
                raise RuntimeError(f"waited {PATIENCE:g} s for {what}")
            if resume and now - asked > 0.5 and self._halted():
                asked = now
                self._say(self._keys.official, Official(action=OfficialAction.RESUME, by="benchmark"))
            time.sleep(0.01)


def _lives(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


@contextlib.contextmanager
def _match(folder: Path) -> Iterator[_Match]:
    players = "".join(
        f'[[players]]\nname = "{name}"\nrole = "minnow"\nx = {20.0 * n - 30}\ny = 92.0\nheading = -90.0\n'
        for n, name in enumerate(MINNOWS)
    )
    file = folder / "match.toml"
    shark = '[[players]]\nname = "shark"\nrole = "shark"\nx = 38.0\ny = -92.0\nheading = 90.0\n'
    file.write_text(MATCH + shark + players, encoding="utf-8")
    environment = {**os.environ, "XDG_STATE_HOME": f"{folder}/state"}
    launcher = subprocess.Popen(
        [sys.executable, "-P", "-m", "vrg", "play", str(file), "--headless", "--runs", str(folder / "runs")],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment,
        start_new_session=True,
    )  # fmt: skip
    try:
        with open_session(_router(folder / "state", launcher)) as session:
            yield _Match(launcher, session, folder)
    finally:
        launcher.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            launcher.wait(PATIENCE)
        launcher.kill()


def _router(state: Path, launcher: "subprocess.Popen[bytes]") -> str:
    """The endpoint of the match's router, as the launcher has listed it."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and launcher.poll() is None:
        for entry in state.glob("vrg/*.json"):
            return str(json.loads(entry.read_text(encoding="utf-8"))["router"])
        time.sleep(0.05)
    raise RuntimeError("the match did not start")


if __name__ == "__main__":
    main()
