"""Random numbers of many matches, each with a stream of its own, so that no match depends on the others."""

import math
from typing import Any

import numpy as np

from vrg.portable.scalars import cos, log
from vrg_learn.batch.records import Record, Records, records

_STEP = np.uint64(0x9E3779B97F4A7C15)
"""What SplitMix64 adds to the state of a stream for each number: 2**64 divided by the golden ratio."""


def streams(matches: int) -> Records:
    """The streams of this many matches, which `seed` sets. The field `word` is the state of each."""
    return records(matches, word=(np.uint64,))


def seed(chance: Records, number: int) -> None:
    """Set the streams of all matches by a seed: that of a match depends on the seed and its place alone."""
    with np.errstate(over="ignore"):
        words = np.arange(1, len(chance) + 1, dtype=np.uint64) + np.uint64(number % 2**32) * _STEP
        chance.word[:] = mixed(words)


def mixed(z: Any) -> Any:
    """SplitMix64's finaliser (Steele, Lea and Flood 2014), which makes neighbouring words independent."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform(chance: Record) -> float:
    """The next number of a match's stream, uniform in [0, 1)."""
    chance.word = chance.word + _STEP
    return float(mixed(chance.word) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


def whole(chance: Record) -> int:
    """The next number of a match's stream, a whole one from 0 to 2**63 - 1."""
    chance.word = chance.word + _STEP
    return int(mixed(chance.word) >> np.uint64(1))


def between(chance: Record, low: float, high: float) -> float:
    """The next number of a match's stream, uniform between two numbers."""
    return low + (high - low) * uniform(chance)


def normal(chance: Record) -> float:
    """The next number of a match's stream, standard normal (Box and Muller)."""
    radius = math.sqrt(-2.0 * log(1.0 - uniform(chance)))
    return radius * cos(2.0 * math.pi * uniform(chance))
