"""A class of many students, some of them hostile, on a server that is killed: how soon tries are seen, what is lost.

Each student tries every EVERY seconds, the first step of the lesson and the whole match in turn, and hands each fifth
version in. The hostile ones try endless loops, much output, eight gigabytes, the files of others, and code of 5 MB,
and join again and again. Connections that say nothing may be there beside them, and the disk may be full for a while:
with `--folder` on a small file system, such as a tmpfs, which is filled. At the end the code that the server has last
confirmed as saved, and each version that it has confirmed as handed in, is looked for in the folder of the class.

    python plugins/vrg-class/benchmarks/load.py                             # 20 students once a minute, for 5 minutes
    python plugins/vrg-class/benchmarks/load.py --every 8 --for 360 --hostile 5 --kills 2      # 45 minutes in 6
    python plugins/vrg-class/benchmarks/load.py --students 24 --for 2700 --hostile 5 --kills 2 --idle 1100 \\
        --folder /mnt/small --full 20
"""

import argparse
import asyncio
import contextlib
import json
import os
import resource
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
    """The real times in s until the first picture and the end of each try, and of halts; what was confirmed."""

    first: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    handed: dict[str, str] = field(default_factory=dict)
    saved: dict[str, str] = field(default_factory=dict)
    halts: list[float] = field(default_factory=list)
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
                self.teacher = line.split()[1].partition("#")[2]
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


async def tried(
    http: aiohttp.ClientSession, server: Server, who: tuple[str, str], code: str, step: str, found: Found
) -> None:
    """Try code in a step of the lesson, or in the whole match, and wait for its end; `who` is a name and a token."""
    name, token = who
    base = (await asked(http, server, "/me", token))[1]["revision"]
    async with http.ws_connect(server.base.replace("http", "ws", 1) + "/feed", max_msg_size=0) as socket:
        await socket.send_str(token)
        began = time.monotonic()
        status, answer = await asked(http, server, "/try", token, code=code, base=base, step=step, against=0)
        found.answers[f"try {status}"] += 1
        if status != 200:
            return
        found.saved[name] = code
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


async def joined(http: aiohttp.ClientSession, server: Server, name: str, found: Found) -> tuple[str, str]:
    """Join, as often as it takes, as a person does who reads that there is no connection: the token, and the name."""
    while True:
        try:
            status, answer = await asked(http, server, "/join", server.joining, name=name, device=name)
            if status == 200:
                return answer["token"], answer["name"]
            found.answers[f"join {status}"] += 1
        except (aiohttp.ClientError, OSError) as error:
            found.answers[f"join {type(error).__name__}"] += 1
        await asyncio.sleep(1.0)


async def student(
    http: aiohttp.ClientSession, server: Server, number: int, found: Found, times: tuple[float, float, float], deed: str
) -> None:
    """One student, from joining to the end of the lesson."""
    start, every, end = times
    await asyncio.sleep(start)
    token, name = await joined(http, server, f"Student {number}", found)
    tries = 0
    while time.monotonic() < end:
        begun = time.monotonic()
        tries += 1
        code = GOOD.format(turn=number / 100, number=f"{number} {tries}")
        if deed:
            text = HOSTILE[deed].format(folder=str(server.folder), long="x" * 5_000_000 if deed == "size" else "")
            code = code.replace("        return", f"        {text}\n        return")
        try:
            await tried(http, server, (name, token), code, STEP if tries % 2 else "", Found() if deed else found)
            if deed:
                await asked(http, server, "/join", server.joining, name=f"Guest {number} {tries}")
            elif tries % 5 == 0:
                await asyncio.sleep(0.6)
                base = (await asked(http, server, "/me", token))[1]["revision"]
                status, _ = await asked(http, server, "/hand-in", token, code=code, base=base)
                found.answers[f"hand-in {status}"] += 1
                if status == 200:
                    found.handed[name] = found.saved[name] = code
        except (aiohttp.ClientError, TimeoutError, OSError) as error:
            found.answers[type(error).__name__ + (" of a hostile student" if deed else "")] += 1
            await asyncio.sleep(2.0)
        await asyncio.sleep(max(0.6, every - (time.monotonic() - begun)))


async def idle(server: Server, count: int) -> None:
    """Keep connections open that say nothing; one that the server closes comes again."""
    host, port = server.base.removeprefix("http://").split(":")

    async def one() -> None:
        while True:
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection(host, int(port))
                with contextlib.suppress(OSError):
                    await reader.read(1)
                writer.close()
            await asyncio.sleep(5.0)

    await asyncio.gather(*(one() for _ in range(count)))


async def fill(folder: Path, seconds: float, start: float) -> None:
    """Fill the file system of the class for some seconds, from `start` on."""
    await asyncio.sleep(start)
    filler = folder.parent / "filler"
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    print(f"the disk is full: {os.statvfs(folder).f_bavail} blocks are free", flush=True)
    await asyncio.sleep(seconds)
    filler.unlink()


async def halts(http: aiohttp.ClientSession, server: Server, found: Found) -> None:
    """The teacher halts all tries, and lets them go on at once, each ten seconds."""
    while True:
        await asyncio.sleep(10.0)
        for halted in (True, False):
            begun = time.monotonic()
            with contextlib.suppress(aiohttp.ClientError, OSError):
                status, _ = await asked(http, server, "/teacher/decide", server.teacher, halted=halted)
                if status == 200:
                    found.halts.append(time.monotonic() - begun)


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
        others = [asyncio.create_task(idle(server, args.idle)), asyncio.create_task(halts(http, server, found))]
        if args.full:
            others.append(asyncio.create_task(fill(server.folder, args.full, args.seconds / 6)))
        for _ in range(args.kills):
            await asyncio.sleep(args.seconds / (args.kills + 1))
            server.kill()
            await asyncio.to_thread(server.start)
        try:
            await asyncio.wait_for(working, max(0.0, end - time.monotonic()) + 3 * PATIENCE)
        except TimeoutError:
            print("somebody still waits, long after the end: what follows is without that one", flush=True)
        for task in others:
            task.cancel()
    return found


def main() -> None:
    """Measure, and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--students", type=int, default=20)
    parser.add_argument("--hostile", type=int, default=0)
    parser.add_argument("--every", type=float, default=60.0, help="seconds between two tries of a student")
    parser.add_argument("--for", dest="seconds", type=float, default=300.0)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--idle", type=int, default=0, help="connections that say nothing")
    parser.add_argument("--folder", type=Path, help="where the class is made; a temporary folder if missing")
    parser.add_argument("--full", type=float, default=0.0, help="seconds for which the disk of --folder is full")
    args = parser.parse_args()
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 8192), hard))
    with tempfile.TemporaryDirectory(dir=args.folder) as place:
        server = Server(Path(place) / "class")
        try:
            found = asyncio.run(lesson(server, args))
        finally:
            with contextlib.suppress(ProcessLookupError):
                server.stop()
        kept, code = {}, {}
        for file in (server.folder / "students").glob("*/student.json"):
            known = json.loads(file.read_text())
            code[known["name"]] = (file.parent / "code.py").read_text() if (file.parent / "code.py").exists() else ""
            if known["handed"]:
                kept[known["name"]] = (server.folder / "entries" / f"{known['folder']}.py").read_text()
        games = server.folder / "league" / "games.jsonl"
        played = len(games.read_text().splitlines()) if games.exists() else 0
    first, whole = sorted(found.first), sorted(found.whole)
    print(f"{len(whole)} tries of honest students; answers: {dict(found.answers)}")
    for what, numbers in (("first picture", first), ("whole try", whole), ("halt", sorted(found.halts))):
        middle, late = statistics.median(numbers), numbers[int(0.95 * len(numbers))]
        print(f"{what}: median {middle:.2f} s, 95 % {late:.2f} s, at the worst {numbers[-1]:.2f} s")
    unsaved = [name for name, text in found.saved.items() if code.get(name) != text]
    print(f"saved by {len(found.saved)} students, lost: {len(unsaved)}")
    lost = [name for name, code in found.handed.items() if kept.get(name) != code]
    print(f"handed in by {len(found.handed)} students, lost: {len(lost)}; games of the league: {played}")


if __name__ == "__main__":
    main()
