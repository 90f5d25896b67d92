"""What a person's hands hold, and how fast they want a robot to be. This needs no window and no gamepad."""

from dataclasses import dataclass
from typing import Final

LEASE: Final = 0.25
"""The match time in s that a driving command holds. If this process dies, its player stops and plays on by itself."""
SLOW: Final = 0.5
"""The part of a robot's speed that it is driven with while the turbo button is not held."""


@dataclass(frozen=True)
class Hands:
    """What a person's hands hold at one instant.

    Args:
        forward, turn: -1 to 1: ahead, and to the left.
        enabled: the deadman button is held. Without it the driven player stands.
        turbo: the turbo button is held.
    """

    forward: float = 0.0
    turn: float = 0.0
    enabled: bool = False
    turbo: bool = False

    @property
    def shares(self) -> tuple[float, float]:
        """The parts of the robot's top speed and of its top turn rate that are asked for, each -1 to 1."""
        share = 0.0 if not self.enabled else 1.0 if self.turbo else SLOW
        return max(-1.0, min(1.0, self.forward)) * share, max(-1.0, min(1.0, self.turn)) * share
