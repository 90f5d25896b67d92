"""How far one robot pushes another in 5 s, in each engine: 40 pushes (tests/hal/pushes.py).

A robot of one model drives with its top speed at a robot of the same or the other model: at its front, its side, its
rear, and obliquely. The pushed robot has locked wheels, stands with powered wheels, or drives ahead at 0.2 m/s. What
counts is how far it ends off the way that it would have driven alone.
"""

import sys
from pathlib import Path

from common import arguments, show

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.hal.engine_bench import ENGINE_NAMES
from tests.hal.pushes import PUSHES, SECONDS


def main() -> None:
    """Run the benchmark, and print its table."""
    options = arguments(__doc__).parse_args()
    rows = [
        {
            "pushed": f"{push.pushed} {push.state}",
            "by": push.pusher,
            "at its": push.side,
            **{f"{engine}, m": round(push.off_way(engine), 3) for engine in ENGINE_NAMES},
        }
        for push in (PUSHES[:4] if options.quick else PUSHES)
    ]
    show(f"{len(rows)} pushes of {SECONDS:g} s", rows, [], as_json=options.json)


if __name__ == "__main__":
    main()
