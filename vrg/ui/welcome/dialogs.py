"""What the configurator asks in the middle of its window, and the names that it offers for a field. Pure values."""

from dataclasses import dataclass, replace
from enum import Enum

from vrg.ui.typed import Typed


class Question(Enum):
    """What is asked."""

    NAME = "name"
    REPLACE = "replace"
    LEAVE = "leave"


@dataclass(frozen=True)
class Dialog:
    """A question that must be answered before anything else.

    Args:
        says: the question in words. typed: the answer, where one is typed; None where the answer is yes or no.
        play: the match is to be played once it is saved. wrong: why the answer was not taken.
    """

    question: Question
    says: str
    typed: Typed | None = None
    play: bool = False
    wrong: str = ""


@dataclass(frozen=True)
class Offer:
    """The names that a field can have, one of which is marked."""

    names: tuple[str, ...]
    at: int = 0

    def move(self, step: int) -> "Offer":
        """Mark the next name, or the one before."""
        return replace(self, at=(self.at + step) % len(self.names))
