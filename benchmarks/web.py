"""What browsers cost a match: processor time of the page's server and of the match, and missed ticks, by viewers.

One match over processes with a page, at rate 1, for which 0, 1 and 20 viewers look at it in turns, several rounds, so
that all see the same match on the same machine. A viewer is a WebSocket of aiohttp's client in a process of its own,
which reads and acknowledges each batch as the page does; it draws nothing. Numbers of ticks and of missed ticks are
from the pulses of the nodes. CPU is the share of one core, from /proc.
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

VIEWERS = (0, 1, 20)
PATIENCE = 60.0
"""s of real time for the match to start."""


async def _view(link: str, gaps: list[float], sizes: list[int]) -> None:
    """Look at the page until cancelled, and note the times between batches, s, and their sizes, bytes."""
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{link}socket") as socket:
        await socket.send_str('{"t":"hello"}')
        batches, before = 0, time.monotonic()
        async for message in socket:
            now = time.monotonic()
            gaps.append(now - before)
            sizes.append(len(message.data))
            batches, before = batches + 1, now
            if batches % 3 == 0:
                await socket.send_str(f'{{"t":"ack","count":{batches}}}')


def _viewers(link: str, count: int, seconds: float, out: Any) -> None:
    """Let so many viewers look for so long."""
    gaps: list[float] = []
    sizes: list[int] = []

    async def work() -> None:
        tasks = [asyncio.create_task(_view(link, gaps, sizes)) for _ in range(count)]
        await asyncio.sleep(seconds)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(work())
    out.put((gaps[5 * count :], sizes[5 * count :]))


@contextlib.contextmanager
def _match(folder: Path, robots: int) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """A match with a page: its launcher, and the viewers' link."""
    write_match(folder, robots, engine="pybullet", lasers=True, name="web-benchmark")
    link = r"watch +(http://\S+)"
    with playing(folder, "--headless", "--web", "--no-record", until=link, patience=PATIENCE) as launcher:
        found = re.search(link, (folder / "output.txt").read_text())
        yield launcher, found[1] if found else ""


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, default=16, help="robots in the match")
    options = parser.parse_args()
    rounds, seconds = (1, 3.0) if options.quick else (5, 8.0)
    web: dict[int, list[float]] = defaultdict(list)
    rest: dict[int, list[float]] = defaultdict(list)
    missed: dict[int, int] = defaultdict(int)
    ticks: dict[int, int] = defaultdict(int)
    gaps: dict[int, list[float]] = defaultdict(list)
    sizes: dict[int, list[int]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as made, _match(Path(made), options.robots) as (launcher, link):
        keys = Keys("web-benchmark")
        with open_session(endpoint_of(launcher.pid)) as session:
            costs = Costs(launcher.pid, session, keys, "web")
            time.sleep(5.0)
            for turn in range(rounds * len(VIEWERS)):
                count = VIEWERS[turn % len(VIEWERS)]
                answers: Any = multiprocessing.Queue()
                viewers = multiprocessing.Process(target=_viewers, args=(link, count, seconds + 2.0, answers))
                viewers.start()
                time.sleep(1.5)
                server, others, done, lost = costs.over(seconds)
                found = answers.get(timeout=PATIENCE)
                viewers.join()
                web[count].append(server)
                rest[count].append(others)
                ticks[count] += done
                missed[count] += lost
                gaps[count] += found[0]
                sizes[count] += found[1]
    rows = [
        {
            "viewers": count,
            "page's server, % of a core": 100 * median(web[count]),
            "rest of the match, %": 100 * median(rest[count]),
            "ticks of its nodes": ticks[count],
            "missed": missed[count],
            "batches/s a viewer": len(gaps[count]) / sum(gaps[count]) if gaps[count] else None,
            "gap p99, ms": 1e3 * quantile(gaps[count], 0.99) if gaps[count] else None,
            "batch, bytes": median(sizes[count]) if sizes[count] else None,
        }
        for count in VIEWERS
    ]
    note = f"{options.robots} robots, PyBullet with lasers, {rounds} times {seconds:g} s each"
    show("A match with a page", rows, [note], as_json=options.json)


if __name__ == "__main__":
    main()
