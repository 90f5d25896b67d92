"""What a tournament has shown: who beats whom, and by how much, as a table."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrg.evaluation.ratings import Rating
from vrg.evaluation.report import Finding, Table, percent


@dataclass(frozen=True)
class Cross:
    """How much of the points each strategy has won against each other one.

    Args:
        labels: the strategies, in the order of rows and columns.
        shares: the share of the points, 0 to 1, that the strategy of the row has won against that of the column; None
            where they have not played.
        decided: whether a difference was found between them.
    """

    labels: list[str]
    shares: list[list[float | None]]
    decided: list[list[bool]]

    @classmethod
    def of(cls, labels: Sequence[str], findings: Sequence[Finding]) -> "Cross":
        """The table of some findings."""
        by_pairing = {(finding.pairing.first, finding.pairing.second): finding.standing for finding in findings}
        shares: list[list[float | None]] = []
        decided: list[list[bool]] = []
        for row in labels:
            shares.append([])
            decided.append([])
            for column in labels:
                here, mirrored = by_pairing.get((row, column)), by_pairing.get((column, row))
                standing = here or mirrored
                share = None if standing is None else standing.share if here is not None else 1.0 - standing.share
                shares[-1].append(share)
                decided[-1].append(standing is not None and standing.decided)
        return cls(list(labels), shares, decided)

    def cells(self) -> Table:
        """The cells as texts. A star says that a difference was found."""
        return [
            [
                "" if share is None else percent(share) + (" *" if sure else "")
                for share, sure in zip(*line, strict=True)
            ]
            for line in zip(self.shares, self.decided, strict=True)
        ]

    def table(self, rated: Sequence[Rating]) -> Table:
        """The cross table with the ratings, in the same order."""
        head = ["share of the points of", *(f"against {label}" for label in self.labels), "mu", "sigma"]
        return [
            head,
            *(
                [rating.label, *line, f"{rating.mu:.1f}", f"{rating.sigma:.1f}"]
                for rating, line in zip(rated, self.cells(), strict=True)
            ),
        ]


def ranking(rated: Sequence[Rating]) -> str:
    """The strategies in the order of their ratings, in one line."""
    return ", ".join(f"{number}. {rating.label}" for number, rating in enumerate(rated, 1))
