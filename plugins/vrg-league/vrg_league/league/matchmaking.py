"""The choice of who plays next: the two strategies whose games make the ratings certain fastest.

A game of the strategies i and j, which i wins with the probability p, adds w = p (1 - p) to the information about their
difference d = e_i - e_j. By the formula of Sherman and Morrison the covariance C of all strengths then loses

    w (C d) (C d)' / (1 + w d' C d)

So the sum of the variances of some ratings, each the distance A from the mean of all, loses

    w |A C d|^2 / (1 + w d' C d)

That is much where both are uncertain, and about as strong as each other; it is little where the winner is known before.

They are chosen among those whose turn it is: nobody plays again before everybody else has played as often.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from vrg_league.games import Pairing
from vrg_league.standings import Fit

GAMES = 2
"""The games of a pair: both sides of one seed."""
_DIGITS = 9
"""Gains that agree in so many digits are the same: which of them is the larger would be an accident of arithmetic."""


def next_pairing(
    found: Fit, among: Sequence[str], planned: Iterable[Pairing] = (), turns: Mapping[str, int] = {}
) -> Pairing | None:
    """The two strategies whose turn it is and whose next pair of games most reduces the variances of the ratings.

    It depends on its arguments alone. Among several that are as good, it is the first in the order of `among`.

    Args:
        found: the ratings by the games so far.
        among: the strategies that may play, whose ratings are to become certain.
        planned: the games that are being played, the result of which is not known yet.
        turns: how often each has played; one that is missing has not. Those that have played least are paired.

    Returns:
        None if fewer than two may play.
    """
    if len(among) < 2:
        return None
    index = {label: n for n, label in enumerate(found.labels)}
    covariance, certainty = found.covariance, found.certainty
    for pairing in planned:
        i, j = index[pairing.first], index[pairing.second]
        moved = covariance[:, i] - covariance[:, j]
        covariance = covariance - np.outer(moved, moved) / (1.0 / certainty[i, j] + moved[i] - moved[j])
    own = [index[label] for label in among]
    moved = (found.centred @ covariance)[np.ix_(own, own)]
    squares = moved.T @ moved
    reduced = np.diag(squares)[:, None] + np.diag(squares)[None, :] - 2.0 * squares
    variances = covariance[np.ix_(own, own)]
    of_difference = np.diag(variances)[:, None] + np.diag(variances)[None, :] - 2.0 * variances
    weight = GAMES * certainty[np.ix_(own, own)]
    played = np.array([turns.get(label, 0) for label in among])
    due = played[:, None] + played[None, :] == np.sort(played)[:2].sum()
    gains = np.triu(np.where(due, weight * reduced / (1.0 + weight * of_difference), 0.0), 1)
    first, second = divmod(int(np.argmax(np.round(gains / gains.max(), _DIGITS))), len(own))
    return Pairing(among[first], among[second])
