"""The fields of the goto panel, as text that a person types. This needs no window."""

import math
from dataclasses import dataclass, field
from typing import Final

from vrg_views.hud import words
from vrg_views.hud.helm import Goal

SIGNS: Final = frozenset("0123456789+-.")
FIELD_LENGTH: Final = 9
"""The number of characters in a field."""


@dataclass
class Form:
    """The three fields, and which of them is being typed into.

    Attributes:
        texts: what stands in the fields x, y (m) and heading (degrees). focus: the number of the field that is typed
            into; None while none is.
    """

    texts: list[str] = field(default_factory=lambda: ["", "", ""])
    focus: int | None = None
    _fresh: bool = False

    def enter(self, index: int) -> None:
        """Begin to type into a field. The first character replaces what stands there."""
        self.focus, self._fresh = index, True

    def step(self, by: int) -> None:
        """Go on to the next field, or back."""
        self.enter(0 if self.focus is None else (self.focus + by) % len(self.texts))

    def leave(self) -> None:
        """Type into no field any more."""
        self.focus = None

    def type(self, sign: str) -> str | None:
        """Take in one character. Return why it is refused, in words, or None."""
        if self.focus is None:
            return None
        if sign not in SIGNS:
            return words.NOT_A_SIGN.format(field=words.FIELDS[self.focus][0], got=sign)
        kept = "" if self._fresh else self.texts[self.focus]
        self.texts[self.focus], self._fresh = (kept + sign)[:FIELD_LENGTH], False
        return None

    def erase(self) -> None:
        """Take the last character away."""
        if self.focus is not None:
            self.texts[self.focus], self._fresh = self.texts[self.focus][:-1], False

    def show(self, goal: Goal) -> None:
        """Write a goal into the fields."""
        heading = "" if goal.heading is None else f"{math.degrees(goal.heading) + 0.0:.0f}"
        self.texts = [f"{round(goal.x, 2) + 0.0:.2f}", f"{round(goal.y, 2) + 0.0:.2f}", heading]

    def read(self) -> Goal | str:
        """The goal that stands in the fields, or what is wrong with them, in words. Only the heading may be empty."""
        numbers: list[float | None] = []
        for text, (name, unit) in zip(self.texts, words.FIELDS, strict=True):
            if not text and unit == "°":
                numbers.append(None)
                continue
            try:
                number = float(text)
            except ValueError:
                return words.NOT_A_NUMBER.format(field=name, unit=words.UNITS[unit], got=text)
            numbers.append(number)
        x, y, heading = numbers
        assert x is not None
        assert y is not None
        return Goal(x, y, None if heading is None else math.radians(math.remainder(heading, 360.0)))
