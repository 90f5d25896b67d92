"""Estimates a strategy's share of the points, with an interval that holds at every look.

Each pair of games gives one number from 0 to 1, the mean of the strategy's points in both games. The pairs are taken to
be independent draws with one unknown mean, the share. A usual interval is right only if the number of games was decided
before the first one. An experimenter who looks again and again, and stops as soon as the interval leaves one half out,
is wrong far more often than the interval says. So this module computes a confidence sequence: with the probability
`confidence`, *all* intervals, after every number of pairs, hold the share. One may stop at any of them, for any reason.

The method is betting (I. Waudby-Smith, A. Ramdas, "Estimating means of bounded random variables by betting", Journal of
the Royal Statistical Society B 86, 2024). To test whether the share could be m, a gambler begins with a capital of 1
and stakes in each pair the part g of it that the pair's number x is above m:

    K(m) = mean over g of product over x of (1 + g (x / m - 1)),    0 < g < 1

If the share is m, or less, the bets are not in the gambler's favour. Then, by Ville's inequality, the capital ever
reaches 2 / a with a probability of at most a / 2. So every m at which it does is too low to be the share. For too high
values the same bets are made on 1 - x. Together they are wrong with a probability of at most a = 1 - confidence.

K(m) falls as m grows, because every factor does. So the values that are left are an interval, and bisection finds its
ends. The mean of the pairs is always in it: there every product is at most 1, as 1 + y is at most exp(y). The order of
the pairs does not matter. With the evenly spaced stakes g below, differences of 5 to 20 % of the points are found with
fewer games than with the stakes that the paper calls predictable plug-ins.
"""

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping

import numpy as np

STAKES = (np.arange(20) + 0.5) / 20
"""The parts g of the capital that are staked. The mean over them is a bet, too, so none has to be chosen."""
_HALVINGS = 50


class ShareEstimate:
    """The estimate of one strategy's share by the pairs of games so far. Without pairs the share may be anything.

    Args:
        confidence: the probability with which all intervals together hold the share, such as 0.95.
    """

    def __init__(self, confidence: float) -> None:
        self._confidence = confidence
        self._counts: Counter[float] = Counter()

    def add(self, value: float) -> None:
        """Add a pair.

        Args:
            value: the mean of the strategy's points in the two games, 0 to 1.
        """
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"expected a mean of points from 0 to 1, got {value}")
        self._counts[value] += 1

    @property
    def pairs(self) -> int:
        """The number of pairs."""
        return self._counts.total()

    @property
    def share(self) -> float | None:
        """The strategy's share of the points in these pairs; None if there is no pair."""
        return sum(value * n for value, n in self._counts.items()) / self.pairs if self.pairs else None

    def interval(self) -> tuple[float, float]:
        """The interval (low, high) that holds the share, 0 to 1."""
        return _least(self._counts, self._confidence), 1.0 - _least(self._mirrored, self._confidence)

    def missing(self, most: int) -> int | None:
        """The number of further pairs, at most `most`, after which the interval leaves one half out if they are as
        those so far; None if more are missing, or if the share is one half."""
        share = self.share
        if share is None or share == 0.5:
            return None
        counts: Mapping[float, float] = self._counts if share > 0.5 else self._mirrored
        wanted = _wanted(self._confidence)

        def decided(more: int) -> bool:
            scale = 1.0 + more / self.pairs
            return _log_capital({value: n * scale for value, n in counts.items()}, 0.5) >= wanted

        # The logarithm is a convex function of the scale, and 0 at 0. So once it is large enough it stays so.
        more = bisect_left(range(most + 1), True, key=decided)
        return more if more <= most else None

    @property
    def _mirrored(self) -> dict[float, int]:
        return {1.0 - value: n for value, n in self._counts.items()}


def _wanted(confidence: float) -> float:
    """The logarithm of the capital at which a share is ruled out."""
    return math.log(2.0 / (1.0 - confidence))


def _least(counts: Mapping[float, float], confidence: float) -> float:
    """The low end of the interval."""
    n = sum(counts.values())
    high = sum(value * k for value, k in counts.items()) / n if n else 0.0
    wanted = _wanted(confidence)
    low = 0.0
    for _ in range(_HALVINGS if high > 0.0 else 0):
        middle = (low + high) / 2
        if _log_capital(counts, middle) >= wanted:
            low = middle
        else:
            high = middle
    return low


def _log_capital(counts: Mapping[float, float], share: float) -> float:
    """The logarithm of K(share)."""
    logs = sum(n * np.log1p(STAKES * (value / share - 1.0)) for value, n in counts.items())
    return float(np.logaddexp.reduce(logs) - math.log(STAKES.size))
