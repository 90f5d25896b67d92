"""What browsers cost a match: processor time of the page's server and of the match, and missed ticks, by viewers.

One match over processes with a page, at rate 1, for which 0, 1 and 20 viewers, and an official who has the details of
a player open, look at it in turns, several rounds, so that all see the same match on the same machine. A viewer is a
WebSocket of aiohttp's client in a process of its own, which reads and acknowledges each batch as the page does; it
draws nothing. Numbers of ticks and of missed ticks are from the pulses of the nodes. CPU is the share of one core, from
/proc. The details come with the plug-in vrg-views.
"""

import asyncio
import contextlib
import multiprocessing
import re
import subprocess
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import aiohttp
from common import Costs, arguments, endpoint_of, median, playing, quantile, show, write_match

from vrg.bus.session import open_session
from vrg.bus.topics import Keys

OFFICIAL = "official"
VIEWERS = {"0": 0, "1": 1, "20": 20, OFFICIAL: 1}
"""Who looks, and how many these are."""
PATIENCE = 60.0
"""s of real time for the match to start."""


async def _view(link: str, who: str, gaps: list[float], sizes: list[int]) -> None:
    """Look at the page until cancelled, and note the times between batches, s, and their sizes, bytes."""
    page, _, token = link.partition("#")
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{page}socket") as socket:
        await socket.send_json({"t": "hello", "token": token if who == OFFICIAL else ""})
        if who == OFFICIAL:
            await socket.send_json({"t": "inspect", "drawer": "details", "player": "shark1"})
        batches, before = 0, time.monotonic()
        async for message in socket:
            now = time.monotonic()
            gaps.append(now - before)
            sizes.append(len(message.data))
            batches, before = batches + 1, now
            if batches % 3 == 0:
                await socket.send_str(f'{{"t":"ack","count":{batches}}}')


def _viewers(link: str, who: str, seconds: float, out: Any) -> None:
    """Let these look for so long."""
    count = VIEWERS[who]
    gaps: list[float] = []
    sizes: list[int] = []

    async def work() -> None:
        tasks = [asyncio.create_task(_view(link, who, gaps, sizes)) for _ in range(count)]
        await asyncio.sleep(seconds)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(work())
    out.put((gaps[5 * count :], sizes[5 * count :]))


@contextlib.contextmanager
def _match(folder: Path, robots: int) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """A match with a page: its launcher, and the official's link."""
    write_match(folder, robots, engine="pybullet", lasers=True, name="web-benchmark")
    link = r"official +(http://\S+)"
    with playing(folder, "--headless", "--web", "--no-record", until=link, patience=PATIENCE) as launcher:
        found = re.search(link, (folder / "output.txt").read_text())
        yield launcher, found[1] if found else ""


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, default=16, help="robots in the match")
    options = parser.parse_args()
    rounds, seconds = (1, 3.0) if options.quick else (3, 8.0)
    web: dict[str, list[float]] = defaultdict(list)
    rest: dict[str, list[float]] = defaultdict(list)
    missed: dict[str, int] = defaultdict(int)
    ticks: dict[str, int] = defaultdict(int)
    gaps: dict[str, list[float]] = defaultdict(list)
    sizes: dict[str, list[int]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as made, _match(Path(made), options.robots) as (launcher, link):
        keys = Keys("web-benchmark")
        with open_session(endpoint_of(launcher.pid)) as session:
            costs = Costs(launcher.pid, session, keys, "web")
            time.sleep(5.0)
            for turn in range(rounds * len(VIEWERS)):
                who = list(VIEWERS)[turn % len(VIEWERS)]
                answers: Any = multiprocessing.Queue()
                viewers = multiprocessing.Process(target=_viewers, args=(link, who, seconds + 2.0, answers))
                viewers.start()
                time.sleep(1.5)
                server, others, done, lost = costs.over(seconds)
                found = answers.get(timeout=PATIENCE)
                viewers.join()
                web[who].append(server)
                rest[who].append(others)
                ticks[who] += done
                missed[who] += lost
                gaps[who] += found[0]
                sizes[who] += found[1]
    rows = [
        {
            "viewers": who,
            "page's server, % of a core": 100 * median(web[who]),
            "rest of the match, %": 100 * median(rest[who]),
            "ticks of its nodes": ticks[who],
            "missed": missed[who],
            "batches/s a viewer": len(gaps[who]) / sum(gaps[who]) if gaps[who] else None,
            "gap p99, ms": 1e3 * quantile(gaps[who], 0.99) if gaps[who] else None,
            "batch, bytes": median(sizes[who]) if sizes[who] else None,
            "mean batch, bytes": sum(sizes[who]) / len(sizes[who]) if sizes[who] else None,
        }
        for who in VIEWERS
    ]
    note = f"{options.robots} robots, PyBullet with lasers, {rounds} times {seconds:g} s each"
    show("A match with a page", rows, [note], as_json=options.json)


if __name__ == "__main__":
    main()
