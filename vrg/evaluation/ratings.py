"""Ratings of strategies from the games that they have played against each other."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from openskill.models import PlackettLuce

from vrg.evaluation.games import Row


@dataclass(frozen=True)
class Rating:
    """How strong a strategy is: a normal distribution with the mean `mu` and the standard deviation `sigma`.

    Attributes:
        label: the label of the strategy.
    """

    label: str
    mu: float
    sigma: float


def ratings(labels: Sequence[str], rows: Iterable[Row]) -> list[Rating]:
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
