"""A league of twenty strategies of which five are hostile: what these reach, and whether others are disturbed.

The hostile ones behave until match time FROM, so that they pass the check, which is shorter. Then one reads a secret and
tries to publish it, one forks without end, one sends UDP, one takes 8 GB, and one never answers.

    python benchmarks/league.py --for 300
"""

import argparse
import filecmp
import json
import shlex
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import psutil

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


def main() -> int:
    """Play the league, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--for", dest="seconds", type=float, default=300.0, help="real time in s in which games begin")
    parser.add_argument("--keep", type=Path, help="a folder that does not exist yet, for the league")
    arguments = parser.parse_args()
    place = arguments.keep or Path(tempfile.mkdtemp(prefix="vrg-league-"))
    entries = place / "class"
    entries.mkdir(parents=True)
    secret, leak = place / "home" / ".ssh" / "id_rsa", place / "leak.txt"
    secret.parent.mkdir(parents=True)
    secret.write_text("the secret of the teacher")
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(0.1)
    for number in range(15):
        (entries / f"student {number + 1:02}.py").write_text(HONEST.format(effort=6 + number))
    for name, deed in DEEDS.items():
        text = deed.format(secret=str(secret), leak=str(leak), port=receiver.getsockname()[1])
        (entries / f"{name}.py").write_text(HOSTILE.format(since=FROM, deed=text))
    vrg = str(Path(sys.executable).with_name("vrg"))
    command = [vrg, "league", "play", str(entries), "--match", "sharks-and-minnows", "--no-lasers"]
    began = time.monotonic()
    process = subprocess.Popen([*command, "--for", str(arguments.seconds)])
    most = {"processes": 0, "memory": 0.0}
    packets = 0

    def watch() -> None:
        nonlocal packets
        while process.poll() is None:
            most["processes"] = max(most["processes"], len(psutil.pids()))
            most["memory"] = max(most["memory"], psutil.virtual_memory().used / 1e9)
            try:
                receiver.recv(100)
                packets += 1
            except TimeoutError:
                pass

    watcher = threading.Thread(target=watch)
    before = len(psutil.pids()), psutil.virtual_memory().used / 1e9
    watcher.start()
    status = process.wait()
    watcher.join()
    took = time.monotonic() - began
    league = entries / "league"
    rows = [json.loads(line) for line in (league / "games.jsonl").read_text().splitlines()]
    print(f"status {status}; {took:.0f} s, {len(rows)} games")
    print(
        f"processes: {before[0]} before, {most['processes']} at most; memory {before[1]:.1f}, {most['memory']:.1f} GB"
    )
    words = b"the secret of the teacher"
    found = [path for path in place.rglob("*") if path.is_file() and path != secret and words in path.read_bytes()]
    print(f"files with the secret: {len(found)}; the leak: {leak.exists()}; packets: {packets}")
    honest, hostile = [], {name: [] for name in DEEDS}
    for row in rows:
        names = {row["game"]["pairing"][who].rpartition(".")[0] for who in ("first", "second")}
        for name in names & set(DEEDS):
            hostile[name].append(row)
        if not names & set(DEEDS):
            honest.append(row)
    irregular = [row for row in honest if row["played"]["ended"] != "game over" or row["played"]["failures"]]
    print(f"{len(honest)} games without a hostile one, of which {len(irregular)} were irregular")
    for name, of_name in hostile.items():
        own = [f for row in of_name for f in row["played"]["failures"]]
        others = [
            f
            for row in of_name
            for f in row["played"]["failures"]
            if row["teams"][f.partition(": ")[0]] != side_of(row, name)
        ]
        endings = sorted({row["played"]["ended"] for row in of_name})
        walls = [row["played"]["wall_time"] for row in of_name]
        mean = sum(walls) / len(walls) if walls else 0.0
        print(
            f"{name}: {len(of_name)} games, {endings}, {mean:.1f} s each, {len(own)} failures ({len(others)} of others)"
        )
        print(f"    such as {own[0] if own else '-'}")
    if honest:
        print(f"the others: {sum(row['played']['wall_time'] for row in honest) / len(honest):.1f} s each")
    same = 0
    for row in honest[:: max(1, len(honest) // 5)]:
        game = row["game"]
        same += again(vrg, place, league, game)
        print(f"played again: {same} the same", end="\r")
    print()
    return status


def side_of(row: dict, name: str) -> str:
    """The team that an entry plays in a game."""
    game = row["game"]
    return game["first_team"] if game["pairing"]["first"].rpartition(".")[0] == name else game["second_team"]


def again(vrg: str, place: Path, league: Path, game: dict) -> bool:
    """Play a game again, and find out whether its journal is the same."""
    labels = game["pairing"]["first"], game["pairing"]["second"]
    order = labels if game["first_team"] == "sharks" else labels[::-1]
    name = ".vs.".join(order)
    runs = place / "again"
    match = str(league / "matches" / name / "match.toml")
    options = shlex.split("--lockstep --headless --no-record --runs")
    command = [vrg, "play", match, *options, str(runs), "--seed", str(game["seed"])]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    newest = max(runs.iterdir(), key=lambda path: path.stat().st_mtime)
    return filecmp.cmp(newest / "journal.jsonl", league / "kept" / f"{name}-{game['number']}" / "journal.jsonl", False)


if __name__ == "__main__":
    sys.exit(main())
