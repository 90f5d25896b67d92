"""A league of twenty strategies of which five are hostile: what these reach, and whether others are disturbed.

The hostile ones behave until match time FROM, so that they pass the check, which is shorter. Then one reads a secret
and tries to publish it, one forks without end, one sends UDP, one takes 8 GB, and one never answers.

    python plugins/vrg-league/benchmarks/league.py --for 300
"""

import argparse
import contextlib
import filecmp
import json
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import psutil

Row = dict[str, Any]
VRG = str(Path(sys.executable).with_name("vrg"))
SECRET = "the secret of the teacher"
FROM = 33.0
"""The match time in s from which the hostile ones misbehave."""
HONEST = """\
from vrg.agents import STILL
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Mine(SharksAndMinnowsPlayer):
    ticks = 0

    def act(self, view):
        self.ticks += 1
        twist = super().act(view)
        return twist if self.ticks % 20 < {effort} else STILL
"""
HOSTILE = """\
import os, socket

from vrg.agents import Action
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Mine(SharksAndMinnowsPlayer):
    done = False

    def act(self, view):
        twist = super().act(view)
        if view.time < {since} or self.done:
            return twist
        self.done = True
        {deed}
        return twist
"""
DEEDS = {
    "leak": """found = ""
        for path in ({secret!r}, os.path.expanduser("~/.ssh/id_rsa"), "/etc/shadow"):
            try:
                found += open(path).read()
            except OSError as error:
                print(error)
        for path in ({leak!r}, os.path.join(os.path.dirname(__file__), "found.txt")):
            try:
                open(path, "w").write(found or "nothing")
            except OSError as error:
                print(error)
        raise ValueError("found: " + found)""",
    "fork": """while True:
            os.fork()""",
    "udp": """for family, kind in ((socket.AF_INET, socket.SOCK_DGRAM), (socket.AF_INET, socket.SOCK_STREAM)):
            try:
                with socket.socket(family, kind) as sender:
                    sender.connect(("127.0.0.1", {port}))
                    sender.send(b"here I am")
            except OSError as error:
                print(error)
        raise ValueError("sent")""",
    "memory": """kept = [bytearray(b"x") * (1 << 28) for _ in range(32)]""",
    "loop": """while True:
            pass""",
}


def make(place: Path, port: int) -> Path:
    """Write the entries, and return their folder.

    Args:
        port: at which UDP is waited for on this machine.
    """
    entries, secret = place / "class", place / "home" / "id_rsa"
    entries.mkdir(parents=True)
    secret.parent.mkdir()
    secret.write_text(SECRET)
    for number in range(15):
        (entries / f"student {number + 1:02}.py").write_text(HONEST.format(effort=6 + number))
    for name, deed in DEEDS.items():
        text = deed.format(secret=str(secret), leak=str(place / "leak.txt"), port=port)
        (entries / f"{name}.py").write_text(HOSTILE.format(since=FROM, deed=text))
    return entries


class Watch(threading.Thread):
    """Watches this machine while a process runs: the most processes, the most memory in GB, and packets of UDP."""

    def __init__(self, process: subprocess.Popen[bytes], receiver: socket.socket) -> None:
        super().__init__()
        self.processes, self.memory, self.packets = self.now()[0], 0.0, 0
        self._process, self._receiver = process, receiver

    @staticmethod
    def now() -> tuple[int, float]:
        """The number of processes and the memory in GB of this machine."""
        return len(psutil.pids()), psutil.virtual_memory().used / 1e9

    def run(self) -> None:
        """Watch until the process has ended."""
        while self._process.poll() is None:
            processes, memory = self.now()
            self.processes, self.memory = max(self.processes, processes), max(self.memory, memory)
            with contextlib.suppress(TimeoutError):
                self._receiver.recv(100)
                self.packets += 1


def main() -> int:
    """Play the league, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--for", dest="seconds", type=float, default=300.0, help="real time in s in which games begin")
    parser.add_argument("--keep", type=Path, help="a folder that does not exist yet, for the league")
    arguments = parser.parse_args()
    place = arguments.keep or Path(tempfile.mkdtemp(prefix="vrg-league-"))
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(0.1)
    entries = make(place, receiver.getsockname()[1])
    before, began = Watch.now(), time.monotonic()
    command = [VRG, "league", "play", str(entries), "--match", "sharks-and-minnows", "--no-lasers"]
    process = subprocess.Popen([*command, "--for", str(arguments.seconds)])
    watch = Watch(process, receiver)
    watch.start()
    status = process.wait()
    took = time.monotonic() - began
    watch.join()
    rows = [json.loads(line) for line in (entries / "league" / "games.jsonl").read_text().splitlines()]
    print(f"status {status}; {took:.0f} s, {len(rows)} games")
    print(f"processes: {before[0]} before, {watch.processes} at most")
    print(f"memory: {before[1]:.1f} GB before, {watch.memory:.1f} GB at most")
    files = [path for path in place.rglob("*") if path.is_file() and path.parent.name != "home"]
    found = [path for path in files if SECRET.encode() in path.read_bytes()]
    print(f"files with the secret: {len(found)}; the leak: {(place / 'leak.txt').exists()}; packets: {watch.packets}")
    tell(rows)
    honest = [row for row in rows if not entries_of(row) & {*DEEDS}]
    chosen = honest[:: max(1, len(honest) // 5)]
    same = sum(again(place, entries / "league", row["game"]) for row in chosen)
    print(f"games played again: {len(chosen)}, of which {same} have the same journal")
    return status


def tell(rows: Sequence[Row]) -> None:
    """Print what each hostile strategy did, and what became of the others."""
    honest = [row for row in rows if not entries_of(row) & {*DEEDS}]
    wrong = [row for row in honest if row["played"]["ended"] != "game over" or row["played"]["failures"]]
    seconds = [row["played"]["wall_time"] for row in honest] or [0.0]
    print(f"{len(honest)} games of the others, {sum(seconds) / len(seconds):.1f} s each; irregular: {len(wrong)}")
    for name in DEEDS:
        of_name = [row for row in rows if name in entries_of(row)]
        if not of_name:
            continue
        seconds = [row["played"]["wall_time"] for row in of_name]
        failures = [
            (entry_of(row, player), words)
            for row in of_name
            for player, words in zip(row["played"]["failing"], row["played"]["failures"], strict=True)
        ]
        whose = Counter(entry for entry, _ in failures)
        words = next((words for entry, words in failures if entry == name), "-")
        others = {entry: number for entry, number in whose.items() if entry not in DEEDS}
        ended = sorted({row["played"]["ended"] for row in of_name})
        print(f"{name}: {len(of_name)} games, {sum(seconds) / len(seconds):.1f} s each, {', '.join(ended)}")
        print(f"    {whose[name]} failures, those of honest opponents: {others or 'none'}; {words}")


def entries_of(row: Row) -> set[str]:
    """The entries that play a game."""
    return {row["game"]["pairing"][who].rpartition(".")[0] for who in ("first", "second")}


def entry_of(row: Row, player: str) -> str:
    """The entry by which a player plays."""
    game = row["game"]
    who = "first" if row["teams"][player] == game["first_team"] else "second"
    return str(game["pairing"][who].rpartition(".")[0])


def again(place: Path, league: Path, game: Row) -> bool:
    """Play a game again, and find out whether its journal is the same."""
    labels = game["pairing"]["first"], game["pairing"]["second"]
    name = ".vs.".join(labels if game["first_team"] == "sharks" else labels[::-1])
    runs = place / "again"
    command = [VRG, "play", str(league / "matches" / name / "match.toml"), "--lockstep", "--headless", "--no-record"]
    subprocess.run([*command, "--runs", str(runs), "--seed", str(game["seed"])], check=True, stdout=subprocess.DEVNULL)
    newest = max(runs.iterdir(), key=lambda path: path.stat().st_mtime)
    kept = league / "kept" / f"{name}-{game['number']}" / "journal.jsonl"
    return filecmp.cmp(newest / "journal.jsonl", kept, shallow=False)


if __name__ == "__main__":
    sys.exit(main())
