"""Since when each body of a world has been at rest. This module uses no bus and no clock."""

from vrg.bus.messages import at_rest
from vrg.types import Twist


class Rests:
    """The match time since which each body has been at rest without a break."""

    def __init__(self) -> None:
        self._since: dict[str, float] = {}

    def since(self, name: str, twist: Twist, now: float, *, known: bool = True) -> float | None:
        """Take in a body's velocity at a tick, and return since when it has been at rest; None if it is not.

        Asking again at the same tick changes nothing.

        Args:
            twist: its velocity. now: the match time of the tick, s.
            known: False if its present motion is not known.
        """
        if not known or not at_rest(twist):
            self._since.pop(name, None)
            return None
        return self._since.setdefault(name, now)
