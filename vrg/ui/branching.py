"""The choices of a replay's user to continue a match "from here on": a player, and its other strategy. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

from vrg.ui.scene import clock_text
from vrg.ui.timeline import Timeline
from vrg.ui.window.explaining import Card, Explain

HINT: Final = "UP and DOWN choose, ENTER takes it, ESC does not"
_ROWS: Final = 14
"""The number of names that are shown at once."""


@dataclass(frozen=True)
class Taken:
    """A match that was continued.

    Args:
        timeline: of the new recording. note: what the user must know of it, in a sentence.
        explain: works out why its calls were made.
    """

    timeline: Timeline
    note: str
    explain: Explain


class Brancher(Protocol):
    """Continues a match without letting the window wait.

    Attributes:
        players: the names of the players. strategies: those that can be chosen.
        cannot: why this match cannot be taken up, in words; empty if it can.
    """

    players: Sequence[str]
    strategies: Sequence[str]
    cannot: str

    def begin(self, time: float, player: str, strategy: str) -> None:
        """Begin to play from a match time, s, with another strategy for a player."""

    def look(self) -> Taken | str | None:
        """The continued match; or a message: how far it is, or why it failed; None if idle."""

    @property
    def busy(self) -> bool:
        """True if something was begun that has not ended."""

    def close(self) -> None:
        """Break off what was begun. Idempotent."""


@dataclass(frozen=True)
class Choice:
    """The state of choosing. Each method returns the next state.

    Args:
        time: the match time, s. players, strategies: what can be chosen.
        player: what was chosen, or empty. at: the number of the name that is marked.
    """

    time: float
    players: Sequence[str]
    strategies: Sequence[str]
    player: str = ""
    at: int = 0

    @property
    def names(self) -> Sequence[str]:
        """The names that can be chosen now."""
        return self.strategies if self.player else self.players

    def move(self, step: int) -> "Choice":
        """Mark the next name, or the one before."""
        return replace(self, at=(self.at + step) % max(1, len(self.names)))

    def take(self) -> "Choice | tuple[str, str]":
        """Take the marked name: go on to the strategies, or return the player and its strategy."""
        name = self.names[self.at]
        return (self.player, name) if self.player else replace(self, player=name, at=0)

    @property
    def card(self) -> Card:
        """The card that the window shows."""
        asked = f"{self.player} plays which strategy?" if self.player else "who plays another strategy?"
        first = min(max(0, self.at - _ROWS // 2), max(0, len(self.names) - _ROWS))
        rows = [
            f"{'▶' if number == self.at else '   '} {self.names[number]}"
            for number in range(first, min(first + _ROWS, len(self.names)))
        ]
        return Card(f"From {clock_text(self.time)} on, {asked}", (*rows, HINT))
