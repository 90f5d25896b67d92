"""A text that a person is typing, as a value. This needs no window."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Typed:
    """A text that is being typed.

    Args:
        text: as far as it is typed. fresh: the first character replaces what stands there.
    """

    text: str = ""
    fresh: bool = True

    def type(self, sign: str, longest: int) -> "Typed":
        """Take in one character, if there is room for it."""
        return Typed((("" if self.fresh else self.text) + sign)[:longest], False)

    def erase(self) -> "Typed":
        """Take the last character away."""
        return replace(self, text=self.text[:-1], fresh=False)
