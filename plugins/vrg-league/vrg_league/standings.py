"""The standings of a tournament: the ratings of the strategies, and their results against each other, as a table."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vrg_league.games import GameRecord, Pairing
from vrg_league.report import TextTable, percent
from vrg_league.series import Series, SeriesResult

MEAN, SPREAD = 1500.0, 350.0
"""The mean and the standard deviation of ratings before any game: those of chess federations."""
_POINTS = 400.0 / math.log(10.0)
"""The points of a rating that multiply the odds of winning by e: 400 of them make these ten times as good."""
_SETTLED = 1e-9
"""The change of the natural logarithm of the odds below which the ratings are found."""


@dataclass(frozen=True)
class Rating:
    """The rating of a strategy, on the scale of chess: 400 points more win ten games of eleven.

    Attributes:
        label: the label of the strategy. value: the rating. sigma: its standard deviation.
    """

    label: str
    value: float
    sigma: float


@dataclass(frozen=True)
class Fit:
    """The model of Bradley and Terry, fitted to games.

    Attributes:
        labels: the labels of the strategies, in the order of the arrays.
        strengths: the logarithms of the odds of winning against a strategy of rating MEAN, of shape (n,).
        covariance: of the strengths, of shape (n, n). games: the number of games of each two, of shape (n, n).
    """

    labels: Sequence[str]
    strengths: NDArray[np.float64]
    covariance: NDArray[np.float64]
    games: NDArray[np.float64]

    @property
    def certainty(self) -> NDArray[np.float64]:
        """The information that one game of each two has about the difference of their strengths, of shape (n, n)."""
        expected = _expected(self.strengths)
        return expected * (1.0 - expected)

    @property
    def centred(self) -> NDArray[np.float64]:
        """The matrix that takes the mean of all strengths away, of shape (n, n)."""
        n = len(self.labels)
        return np.eye(n) - 1.0 / max(1, n)


def fit(labels: Sequence[str], rows: Iterable[GameRecord]) -> Fit:
    """Fit the model of Bradley and Terry to games; the order of the games does not matter.

    The strengths are those under which the results are most likely, with a normal prior of MEAN and SPREAD; a draw is
    half a win. Games of a strategy against itself tell nothing about it, and are left out.
    """
    index = {label: n for n, label in enumerate(labels)}
    won = np.zeros((len(labels), len(labels)))
    for row in rows:
        first, second = index[row.game.pairing.first], index[row.game.pairing.second]
        if first != second:
            won[first, second] += row.points
            won[second, first] += 1.0 - row.points
    games, prior = won + won.T, (_POINTS / SPREAD) ** 2
    strengths, step = np.zeros(len(labels)), np.ones(len(labels))
    information = np.zeros_like(won)
    while np.abs(step).max(initial=0.0) > _SETTLED:
        expected = _expected(strengths)
        certainty = games * expected * (1.0 - expected)
        information = np.diag(certainty.sum(axis=1) + prior) - certainty
        # Newton's method on a concave function; a short step cannot lead astray.
        step = np.linalg.solve(information, (won - games * expected).sum(axis=1) - prior * strengths).clip(-1.0, 1.0)
        strengths += step
    return Fit(labels, strengths, np.linalg.inv(information).astype(np.float64), games)


def _expected(strengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """The expected points of the strategy of each row against that of each column."""
    return 1.0 / (1.0 + np.exp(strengths[None, :] - strengths[:, None]))


def ratings(labels: Sequence[str], rows: Iterable[GameRecord]) -> list[Rating]:
    """Rate strategies by `fit`, the strongest first.

    The standard deviations are those of the distances from the mean of all ratings, which is MEAN.
    """
    return rated(fit(labels, rows))


def rated(found: Fit) -> list[Rating]:
    """The ratings of a fit, the strongest first."""
    sigmas = _POINTS * np.sqrt(np.diag(found.centred @ found.covariance @ found.centred))
    lines = zip(found.labels, found.strengths, sigmas, strict=True)
    return sorted((Rating(n, MEAN + _POINTS * float(s), float(d)) for n, s, d in lines), key=_strongest)


def _strongest(rating: Rating) -> tuple[float, str]:
    return -round(rating.value, 3), rating.label


def ranks(rated: Sequence[Rating]) -> list[int]:
    """The rank of each strategy, in the order of `rated`. Those whose ratings are the same to a point share one."""
    shown = [round(rating.value) for rating in rated]
    return [shown.index(value) + 1 for value in shown]


def ranking(rated: Sequence[Rating]) -> str:
    """The strategies in the order of their ratings, in one line."""
    return ", ".join(f"{rank}. {rating.label}" for rank, rating in zip(ranks(rated), rated, strict=True))


def crossed(labels: Sequence[str], series: Mapping[Pairing, Series]) -> list[list[SeriesResult | None]]:
    """The result of the strategy of each row against that of each column; None where they have not played.

    Args:
        labels: the strategies, in the order of rows and columns.
    """
    known = {pairing: found.standing for pairing, found in series.items()}
    mirrored = {Pairing(p.second, p.first): None if now is None else now.mirrored for p, now in known.items()}
    standings = mirrored | known
    return [[standings.get(Pairing(row, column)) for column in labels] for row in labels]


def cells(standings: Sequence[Sequence[SeriesResult | None]]) -> TextTable:
    """The shares of the points as texts. A star marks a difference that is proved."""
    return [
        ["" if now is None else percent(now.share) + (" *" if now.decided else "") for now in line]
        for line in standings
    ]


def table(rated: Sequence[Rating], shares: TextTable) -> TextTable:
    """The cross table with the ratings.

    Args:
        shares: the cells, in the order of `rated`.
    """
    head = ["share of the points of", *(f"against {rating.label}" for rating in rated), "rating", "sigma"]
    lines = zip(rated, shares, strict=True)
    return [head, *([rating.label, *line, f"{rating.value:.0f}", f"{rating.sigma:.0f}"] for rating, line in lines)]


def board(
    rated: Sequence[Rating], rows: Sequence[GameRecord], more: Mapping[str, Mapping[str, str]] | None = None
) -> TextTable:
    """The leaderboard: a row for each strategy, in the order of `rated`, with `+-` for twice sigma.

    Args:
        rows: the games that count. Those of a strategy against itself are left out, and so are those of others.
        more: the cells of further columns by the label of the strategy, by the head of the column.
    """
    columns = more or {}
    table = [["rank", "strategy", "rating", "+-", "points", "won", "drawn", "lost", "games", *columns]]
    results: dict[str, list[float]] = {rating.label: [] for rating in rated}
    for row in rows:
        first, second = row.game.pairing.first, row.game.pairing.second
        if first != second:
            results.get(first, []).append(row.points)
            results.get(second, []).append(1.0 - row.points)
    for rank, rating in zip(ranks(rated), rated, strict=True):
        points = results[rating.label]
        won, drawn, lost = (str(points.count(kind)) for kind in (1.0, 0.5, 0.0))
        numbers = [f"{sum(points):g}", won, drawn, lost, str(len(points))]
        further = [cells.get(rating.label, "") for cells in columns.values()]
        place = [str(rank) if points else "-", rating.label, f"{rating.value:.0f}", f"{2 * rating.sigma:.0f}"]
        table.append([*place, *numbers, *further])
    return table


def thinking(rows: Sequence[GameRecord]) -> Mapping[str, Mapping[str, str]]:
    """The column of the leaderboard with the most real time that the code of a player took in a game, for `board`."""
    found: dict[str, float] = {}
    for row in rows:
        for name, seconds in row.played.thinking.items():
            if (label := row.label(row.teams.get(name, ""))) is not None:
                found[label] = max(seconds, found.get(label, 0.0))
    return {"thinking, s": {label: f"{seconds:.1f}" for label, seconds in found.items()}}


def to_play(series: Mapping[Pairing, Series]) -> Mapping[str, Mapping[str, str]]:
    """The column of the leaderboard with the most games that each strategy has still to play, for `board`."""
    left = Counter[str]()
    for pairing, of_pairing in series.items():
        if pairing.first != pairing.second:
            left.update({pairing.first: of_pairing.left, pairing.second: of_pairing.left})
    return {"to play": {label: str(number) for label, number in left.items()}}
