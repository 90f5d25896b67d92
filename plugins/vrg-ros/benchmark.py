"""The cost of ROS 2 for a match: processor time of the publisher and of the match, and missed ticks.

One match over processes with `--ros`, at rate 1, which none, one like rviz2 and one that wants every topic listen to in
turns, several rounds, so that all hear the same match on the same machine; and before it that match without `--ros`. A
listener is a process that takes the messages and counts them; it decodes none. CPU is the share of one core, from
/proc; ticks and missed ticks are from the pulses of the nodes.
"""

import multiprocessing
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

from common import Costs, arguments, endpoint_of, median, playing, show, write_match

from vrg.bus.session import open_session
from vrg.bus.topics import Keys

NAME = "ros_benchmark"
ALONE = "match without ROS"
LISTENERS = {
    "none": [],
    "like rviz2": ["0/tf/**", "0/tf_static/**", *(f"0/{NAME}/{t}/**" for t in ("map", "markers", "shark1/scan"))],
    "every topic": ["0/**"],
}
"""The key expressions of what each listens to."""
PATIENCE = 60.0
"""s of real time for the match to start."""


def _listen(endpoint: str, wanted: list[str], seconds: float, out: Any) -> None:
    """Count the messages and their bytes for so long."""
    count = size = 0
    with open_session(endpoint) as session:
        takes = [session.collect_raw(expression, 10_000) for expression in wanted]
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            time.sleep(0.1)
            found = [payload for take in takes for _, payload in take()]
            count, size = count + len(found), size + sum(map(len, found))
    out.put((count / seconds, size / seconds))


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, default=16, help="robots in the match")
    options = parser.parse_args()
    rounds, seconds = (1, 3.0) if options.quick else (3, 8.0)
    spawning = multiprocessing.get_context("spawn")  # a copy of this process would have a dead session of zenoh's
    found: dict[str, list[tuple[float, float, int, int]]] = defaultdict(list)
    heard: dict[str, list[tuple[float, float]]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write_match(folder, options.robots, engine="pybullet", lasers=True, name=NAME)
        alone = playing(folder, "--headless", "--no-record", patience=PATIENCE)
        with alone as launcher, open_session(endpoint_of(launcher.pid)) as session:
            time.sleep(5.0)
            costs = Costs(launcher.pid, session, Keys(NAME), "ros")
            time.sleep(5.0)
            found[ALONE] = [costs.over(seconds) for _ in range(rounds)]
            heard[ALONE] = [(0.0, 0.0)]
        with playing(folder, "--headless", "--ros", "--no-record", until="in ROS 2", patience=PATIENCE) as launcher:
            endpoint = endpoint_of(launcher.pid)
            with open_session(endpoint) as session:
                costs = Costs(launcher.pid, session, Keys(NAME), "ros")
                time.sleep(5.0)
                for _ in range(rounds):
                    for name, wanted in LISTENERS.items():
                        answers: Any = spawning.Queue()
                        work = (endpoint, wanted, seconds + 2.0, answers)
                        listener = spawning.Process(target=_listen, args=work)
                        listener.start()
                        time.sleep(1.5)
                        found[name].append(costs.over(seconds))
                        heard[name].append(answers.get(timeout=PATIENCE))
                        listener.join()
    rows = [
        {
            "listener": name,
            "publisher, % of a core": 100 * median([one for one, _, _, _ in found[name]]),
            "rest of the match, %": 100 * median([rest for _, rest, _, _ in found[name]]),
            "ticks of its nodes": sum(ticks for _, _, ticks, _ in found[name]),
            "missed": sum(missed for _, _, _, missed in found[name]),
            "messages/s": median([count for count, _ in heard[name]]),
            "kB/s": 1e-3 * median([size for _, size in heard[name]]),
        }
        for name in (ALONE, *LISTENERS)
    ]
    note = f"{options.robots} robots, PyBullet with lasers, {rounds} times {seconds:g} s each"
    show("A match that ROS 2 sees", rows, [note], as_json=options.json)


if __name__ == "__main__":
    main()
