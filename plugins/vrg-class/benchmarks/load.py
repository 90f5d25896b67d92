"""A class of many students, some of them hostile, on a server that is killed: how soon tries are seen, what is lost.

Each student tries every EVERY seconds, the first step of the lesson and the whole match in turn, and hands each fifth
version in. The hostile ones try endless loops, much output, eight gigabytes, the files of others, and code of 5 MB,
and join again and again. At the end each version that the server has confirmed as handed in is looked for in the
folder of the class.

    python plugins/vrg-class/benchmarks/load.py                             # 20 students once a minute, for 5 minutes
    python plugins/vrg-class/benchmarks/load.py --every 8 --for 360 --hostile 5 --kills 2      # 45 minutes in 6
"""

import argparse
import asyncio
import contextlib
import json
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import aiohttp

VRG = str(Path(sys.executable).with_name("vrg"))
GOOD = """\
from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        print("at", view.position)
        return Twist(0.6, {turn})


# {number}
"""
HOSTILE = {
    "loop": "while True: pass",
    "output": "while True: print('x' * 10_000)",
    "memory": "bytearray(8 << 30)",
    "files": "import pathlib; print(next(pathlib.Path({folder!r}).glob('students/*/code.py')).read_text())",
    "size": "'{long}'",
}
STEP = "01-drive"
PATIENCE = 60.0
"""The real time in s after which a try that was not answered counts as lost."""


@dataclass
class Found:
    """The real times in s until the first picture and the end of each try; the code that was handed in, by name."""

    first: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    handed: dict[str, str] = field(default_factory=dict)
    answers: Counter[str] = field(default_factory=Counter)


class Server:
    """The class in a process, which may be killed and started again."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.start()

    def start(self) -> None:
        """Start the class, and read its links."""
        self.process = subprocess.Popen(
            [VRG, "class", "start", str(self.folder)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("students"):
                self.base, _, self.joining = line.split()[1].partition("/#join=")
            if line.startswith("teacher"):
                return
        raise RuntimeError("the class did not start")

    def kill(self) -> None:
        """End the process at once, as a fault of the computer would."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """End the class as Ctrl-C does."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(30.0)


async def asked(http: aiohttp.ClientSession, server: Server, path: str, token: str, **body: Any) -> tuple[int, Any]:
    """The status and the answer to a request."""
    headers = {"Authorization": f"Bearer {token}"}
    async with http.post(server.base + path, headers=headers, json=body) as answer:
        text = await answer.text()
        return answer.status, json.loads(text) if answer.status == 200 else text


async def tried(http: aiohttp.ClientSession, server: Server, token: str, code: str, step: str, found: Found) -> None:
    """Try code in a step of the lesson, or in the whole match, and wait for its end."""
    async with http.ws_connect(server.base.replace("http", "ws", 1) + "/feed", max_msg_size=0) as socket:
        await socket.send_str(token)
        began = time.monotonic()
        status, answer = await asked(http, server, "/try", token, code=code, step=step, against=0)
        found.answers[f"try {status}"] += 1
        if status != 200:
            return
        first = None
        new = False
        while True:
            message = await asyncio.wait_for(socket.receive(), PATIENCE)
            if message.type is not aiohttp.WSMsgType.TEXT:
                raise aiohttp.ClientError("the feed has ended")
            for one in json.loads(message.data):
                # The one before is shown again to a page that comes.
                new |= one["t"] == "begin" and one["version"] == answer["version"]
                if new and one["t"] == "at" and first is None:
                    first = time.monotonic() - began
                if new and one["t"] == "end":
                    if first is not None:
                        found.first.append(first)
                        found.whole.append(time.monotonic() - began)
                    return


async def student(
    http: aiohttp.ClientSession, server: Server, number: int, found: Found, times: tuple[float, float, float], deed: str
) -> None:
    """One student, from joining to the end of the lesson."""
    start, every, end = times
    _, joined = await asked(http, server, "/join", server.joining, name=f"Student {number}")
    token, name = joined["token"], joined["name"]
    await asyncio.sleep(start)
    tries = 0
    while time.monotonic() < end:
        begun = time.monotonic()
        tries += 1
        code = GOOD.format(turn=number / 100, number=f"{number} {tries}")
        if deed:
            text = HOSTILE[deed].format(folder=str(server.folder), long="x" * 5_000_000 if deed == "size" else "")
            code = code.replace("        return", f"        {text}\n        return")
        try:
            await tried(http, server, token, code, STEP if tries % 2 else "", Found() if deed else found)
            if deed:
                await asked(http, server, "/join", server.joining, name=f"Guest {number} {tries}")
            elif tries % 5 == 0:
                await asyncio.sleep(0.6)
                status, _ = await asked(http, server, "/hand-in", token, code=code)
                found.answers[f"hand-in {status}"] += 1
                if status == 200:
                    found.handed[name] = code
        except (aiohttp.ClientError, TimeoutError, OSError) as error:
            found.answers[type(error).__name__ + (" of a hostile student" if deed else "")] += 1
            await asyncio.sleep(2.0)
        await asyncio.sleep(max(0.6, every - (time.monotonic() - begun)))


async def lesson(server: Server, args: argparse.Namespace) -> Found:
    """All students, and the one who kills the server."""
    found = Found()
    end = time.monotonic() + args.seconds
    async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as http:
        students = [
            student(
                http, server, number, found, (number * args.every / args.students, args.every, end),
                list(HOSTILE)[number % len(HOSTILE)] if number < args.hostile else "",
            )
            for number in range(args.students)
        ]  # fmt: skip
        working = asyncio.gather(*students)
        for _ in range(args.kills):
            await asyncio.sleep(args.seconds / (args.kills + 1))
            server.kill()
            await asyncio.to_thread(server.start)
        await working
    return found


def main() -> None:
    """Measure, and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--students", type=int, default=20)
    parser.add_argument("--hostile", type=int, default=0)
    parser.add_argument("--every", type=float, default=60.0, help="seconds between two tries of a student")
    parser.add_argument("--for", dest="seconds", type=float, default=300.0)
    parser.add_argument("--kills", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        server = Server(Path(place) / "class")
        try:
            found = asyncio.run(lesson(server, args))
        finally:
            with contextlib.suppress(ProcessLookupError):
                server.stop()
        kept = {}
        for file in (server.folder / "students").glob("*/student.json"):
            known = json.loads(file.read_text())
            if known["handed"]:
                kept[known["name"]] = (server.folder / "entries" / f"{known['folder']}.py").read_text()
        games = server.folder / "league" / "games.jsonl"
        played = len(games.read_text().splitlines()) if games.exists() else 0
    first, whole = sorted(found.first), sorted(found.whole)
    print(f"{len(whole)} tries of honest students; answers: {dict(found.answers)}")
    for what, numbers in (("first picture", first), ("whole try", whole)):
        middle, late = statistics.median(numbers), numbers[int(0.95 * len(numbers))]
        print(f"{what}: median {middle:.2f} s, 95 % {late:.2f} s, at the worst {numbers[-1]:.2f} s")
    lost = [name for name, code in found.handed.items() if kept.get(name) != code]
    print(f"handed in by {len(found.handed)} students, lost: {len(lost)}; games of the league: {played}")


if __name__ == "__main__":
    main()
