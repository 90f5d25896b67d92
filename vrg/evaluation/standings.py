"""The standings of a tournament: the ratings of the strategies, and their results against each other, as a table."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from openskill.models import PlackettLuce

from vrg.evaluation.games import GameRecord, Pairing
from vrg.evaluation.report import TextTable, percent
from vrg.evaluation.series import Series, SeriesResult


@dataclass(frozen=True)
class Rating:
    """The rating of a strategy: a normal distribution with the mean `mu` and the standard deviation `sigma`.

    Attributes:
        label: the label of the strategy.
    """

    label: str
    mu: float
    sigma: float


def ratings(labels: Sequence[str], rows: Iterable[GameRecord]) -> list[Rating]:
    """Rate strategies by the model of Plackett and Luce (openskill), the strongest first.

    Everybody begins with 25 +- 8.3. The model looks at one game after the other, so the order of the games matters. It
    is that of `rows`. Games of a strategy against itself tell nothing about it, and are left out.
    """
    # Between two games of one strategy nothing is learned or forgotten, so no uncertainty is added: tau is 0.
    model = PlackettLuce(tau=0.0)
    found = {label: model.rating(name=label) for label in labels}
    for row in rows:
        first, second = row.game.pairing.first, row.game.pairing.second
        if first != second:
            [[found[first]], [found[second]]] = model.rate(
                [[found[first]], [found[second]]], scores=[row.points, 1.0 - row.points]
            )
    rated = [Rating(label, rating.mu, rating.sigma) for label, rating in found.items()]
    return sorted(rated, key=lambda rating: (-rating.mu, rating.label))


def ranking(rated: Sequence[Rating]) -> str:
    """The strategies in the order of their ratings, in one line."""
    return ", ".join(f"{number}. {rating.label}" for number, rating in enumerate(rated, 1))


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
    head = ["share of the points of", *(f"against {rating.label}" for rating in rated), "mu", "sigma"]
    lines = zip(rated, shares, strict=True)
    return [head, *([rating.label, *line, f"{rating.mu:.1f}", f"{rating.sigma:.1f}"] for rating, line in lines)]


def board(rated: Sequence[Rating], rows: Sequence[GameRecord], series: Mapping[Pairing, Series]) -> TextTable:
    """The leaderboard: a row for each strategy, in the order of `rated`. Strategies with equal ratings share a rank.

    Args:
        rows: the games that count. Those of a strategy against itself are left out.
    """
    table = [["rank", "strategy", "rating", "points", "won", "drawn", "lost", "games", "to play"]]
    results: dict[str, list[float]] = {rating.label: [] for rating in rated}
    left = Counter[str]()
    for row in rows:
        first, second = row.game.pairing.first, row.game.pairing.second
        if first != second:
            results[first].append(row.points)
            results[second].append(1.0 - row.points)
    for pairing, of_pairing in series.items():
        if pairing.first != pairing.second:
            left.update({pairing.first: of_pairing.left, pairing.second: of_pairing.left})
    rank = 1
    for number, rating in enumerate(rated, 1):
        rank = rank if number > 1 and rating.mu == rated[number - 2].mu else number
        points = results[rating.label]
        won, drawn, lost = (str(points.count(kind)) for kind in (1.0, 0.5, 0.0))
        numbers = [f"{sum(points):g}", won, drawn, lost, str(len(points)), str(left[rating.label])]
        table.append([str(rank) if points else "-", rating.label, f"{rating.mu:.1f}", *numbers])
    return table
