"""The command `python -m vrg.testing.can_faults`."""

import argparse
import logging
import math
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from multiprocessing import Pool

from vrg.errors import ConfigError
from vrg.hal.can.protocols import PROTOCOLS
from vrg.testing import can_faults
from vrg.testing.can_faults.life import EPISODES, Counterexample, Life, live


def main(arguments: Sequence[str] | None = None) -> int:
    """Live many lives; the status is 1 if anything was found."""
    parser = argparse.ArgumentParser(
        prog="python -m vrg.testing.can_faults", description=(can_faults.__doc__ or "").split("\n", 1)[0]
    )
    parser.add_argument("--protocol", action="append", help="several are possible; all if missing")
    parser.add_argument(
        "--sequences", type=_positive, help="how many in all; without it one life is printed step by step"
    )
    parser.add_argument("--seed", type=int, default=0, help="the first one")
    parser.add_argument("--jobs", type=_positive, default=1, help="processes")
    options = parser.parse_args(arguments)
    protocols = options.protocol or PROTOCOLS.names()
    try:
        for name in protocols:
            PROTOCOLS.get(name)
    except ConfigError as error:
        parser.error(str(error))
    logger = logging.getLogger("vrg")
    level = logger.level
    logger.setLevel(logging.CRITICAL)  # every fault is logged, too
    lived, wrong = 0, 0
    try:
        for finding in _many(protocols, options) if options.sequences else _told(protocols, options.seed):
            lived, wrong = lived + 1, wrong + (finding is not None)
            if finding is not None:
                print(finding, flush=True)
    except KeyboardInterrupt:
        print("interrupted")
    finally:
        logger.setLevel(level)
    print(f"{EPISODES * lived} sequences of faults; lives in which something is wrong: {wrong}")
    return 1 if wrong else 0


def _positive(text: str) -> int:
    """A number of at least 1.

    Raises:
        ArgumentTypeError: it is less. ValueError: it is no number.
    """
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"expected at least 1, got {text}")
    return number


def _told(protocols: Sequence[str], seed: int) -> Iterator[Counterexample | None]:
    """One life of each protocol, printed step by step."""
    for name in protocols:
        print(f"{name}, seed {seed}:")
        yield Life(name, seed, lambda words: print(f"    {words}")).run()


def _many(protocols: Sequence[str], options: argparse.Namespace) -> Iterator[Counterexample | None]:
    """Many lives, and now and then how far it is."""
    lives = math.ceil(options.sequences / EPISODES / len(protocols))
    cases = [(name, seed) for seed in range(options.seed, options.seed + lives) for name in protocols]
    began = printed = time.monotonic()
    # Processes of the pool end with this one, however it ends.
    with Pool(options.jobs) if options.jobs > 1 else nullcontext() as pool:
        for number, finding in enumerate(map(live, cases) if pool is None else pool.imap(live, cases, chunksize=4), 1):
            yield finding
            if time.monotonic() - printed > 5.0:
                printed = time.monotonic()
                rate = 60 * EPISODES * number / (printed - began)
                print(f"{EPISODES * number} sequences, {rate:.0f} a minute", file=sys.stderr, flush=True)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # processes of a pool would outlive this one
    sys.exit(main())
