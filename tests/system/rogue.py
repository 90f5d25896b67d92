"""A process that does with its seat, or without one, what it was told, and tells what came of it.

Usage: `rogue.py ENDPOINT FOLDER`, with the folder of a seat's keys. It reads one JSON object from its standard input:

    {"put": [[KEY, HEX], ...], "listen": [KEY, ...], "be": [KEY, ...], "answer": [[KEY, HEX], ...], "until": [KEY, ...]}

It publishes again and again until it has heard something on each key of `until`, and some more rounds, then it prints
how many messages it has heard on each key, and ends.
"""

import json
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import zenoh
import zenoh.ext

from vrg.bus.configuration import client_settings
from vrg.bus.session import configuration
from vrg.seats.credentials import Credentials

ROUNDS, PAUSE, LONGEST = 20, 0.05, 400


def main() -> None:
    """Do it."""
    endpoint, folder = sys.argv[1], Path(sys.argv[2])
    told: dict[str, Any] = json.load(sys.stdin)
    heard: Counter[str] = Counter()
    session = zenoh.open(configuration(client_settings(endpoint, Credentials(folder, folder.name))))
    undeclared: list[Any] = []

    def on_sample(sample: zenoh.Sample) -> None:
        heard[str(sample.key_expr)] += 1

    def reply(payload: bytes, key: str) -> Any:
        return lambda query: query.reply(key, payload)

    try:
        for key in dict.fromkeys([*told.get("listen", []), *told["until"]]):
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            undeclared.append(zenoh.ext.declare_advanced_subscriber(session, key, on_sample, history=history))
        undeclared += [session.liveliness().declare_token(key) for key in told.get("be", [])]
        for key, payload in told.get("answer", []):
            undeclared.append(session.declare_queryable(f"{key}/@adv/**", reply(bytes.fromhex(payload), key)))
        publishers = [(session.declare_publisher(key), key, bytes.fromhex(data)) for key, data in told.get("put", [])]
        pause, after = threading.Event(), 0
        for _ in range(LONGEST):
            for publisher, key, payload in publishers:
                publisher.put(payload)
                session.put(key, payload)
            after += heard.keys() >= set(told["until"])
            if after > ROUNDS:
                break
            pause.wait(PAUSE)
        undeclared += [publisher for publisher, _, _ in publishers]
    finally:
        for item in undeclared:
            item.undeclare()
        session.close()  # type: ignore[no-untyped-call]
    print(json.dumps(heard))


if __name__ == "__main__":
    main()
