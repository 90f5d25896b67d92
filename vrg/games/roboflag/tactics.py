"""The jobs of a team's players: attackers, escorts of the carrier, and defenders (thesis 4.4.3 and 4.4.4).

Every player of a team comes to the same result by itself, because all look at the same state of the referee.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from vrg.games.roboflag import TAGGED
from vrg.games.roboflag.situation import Situation


class Tactic(ABC):
    """A way to share the work in a team.

    Attributes:
        flanks: the number of groups in which the attackers go.
        together: True if the attackers form up and cross the midline at the same time; False if each goes by itself.
        bold: True if attackers that have formed up take every risk; False if they go with the same care as one alone.
        chases: False if those who defend tag only the one that carries their flag.
    """

    flanks = 1
    together = False
    bold = True
    chases = True

    @abstractmethod
    def attackers(self, s: Situation) -> Sequence[str]:
        """The players that go for the opponents' flag while none of the team has it, in the order of their bids."""

    def escorts(self, s: Situation) -> Sequence[str]:
        """The players that shield the carrier: those who would attack."""
        return [name for name in self.attackers(s) if name != s.carrier]


class OneAttacker(Tactic):
    """The player with the lowest bid goes, and all others guard the flag. None shields the carrier."""

    def attackers(self, s: Situation) -> Sequence[str]:
        """The winner of the auction."""
        return s.ranked[:1]

    def escorts(self, s: Situation) -> Sequence[str]:
        """None: the carrier of the flag is the one that was sent."""
        return []


class Everybody(Tactic):
    """All go for the flag together, and when one has it, all others shield it.

    Args:
        flanks: the number of groups in which they go.
    """

    together = True

    def __init__(self, flanks: int = 1) -> None:
        self.flanks = flanks

    def attackers(self, s: Situation) -> Sequence[str]:
        """Everybody."""
        return s.ranked


class ByNumbers(Tactic):
    """One goes, and one more for each opponent that is tagged and so cannot defend; one at least stays."""

    def attackers(self, s: Situation) -> Sequence[str]:
        """The lowest bids."""
        tagged = sum(opponent.state == TAGGED for opponent in s.opponents)
        ranked = s.ranked
        return ranked[: min(1 + tagged, max(1, len(ranked) - 1))]


class Pair(OneAttacker):
    """Two go, one along each border: they wait for each other and cross at the same time. None shields."""

    flanks = 2
    together = True
    bold = False

    def attackers(self, s: Situation) -> Sequence[str]:
        """The two lowest bids."""
        return s.ranked[:2]


class GuardFlag(Tactic):
    """All stay about their flag, and tag its carrier (the priority Team Flag)."""

    chases = False

    def attackers(self, s: Situation) -> Sequence[str]:
        """None."""
        return []


class Purge(Tactic):
    """All tag the opponents on their own half (the priority Tag Defense)."""

    def attackers(self, s: Situation) -> Sequence[str]:
        """None."""
        return []


class ShieldCarrier(ByNumbers):
    """All shield the carrier (the priority Flagged Safety). Until one has the flag, the team plays by numbers."""

    def escorts(self, s: Situation) -> Sequence[str]:
        """Everybody else."""
        return [name for name in s.ranked if name != s.carrier]
