"""Plays whole matches by `vrg.play`, which every version of VRG has, and prints what each has cost, as lines of JSON.

`speed.py --against` runs it in two versions in turns. It reads the keyword arguments of `vrg.play` from its input, as
JSON, with `seeds` in place of a seed; a first match, which does not count, fills caches.
"""

import hashlib
import json
import sys
import tempfile
import time
from typing import Any

import vrg


def play(options: dict[str, Any], seed: int) -> dict[str, Any]:
    """Play one match: its processor time and match time, s, and the digests of its journal and its evidence."""
    with tempfile.TemporaryDirectory() as folder:
        before = time.process_time()
        run = vrg.play(**options, seed=seed, record=False, runs=folder)
        cost = time.process_time() - before
        journal = (run.path / "journal.jsonl").read_bytes()
        evidence = (run.path / "evidence.bin").read_bytes()
        seconds = json.loads(journal.splitlines()[-1])["time"]
    digests = [hashlib.sha256(data).hexdigest()[:16] for data in (journal, evidence)]
    return {"cost": cost, "seconds": seconds, "digests": digests}


def main() -> None:
    """Play the matches."""
    options = json.load(sys.stdin)
    seeds = options.pop("seeds")
    play(options, seeds[0])
    for seed in seeds:
        print(json.dumps(play(options, seed)), flush=True)


if __name__ == "__main__":
    main()
