"""The actuators of a robot at digital outputs of its drives: which outputs are on. It has no clock and no bus."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vrg.hal.can.axis import NEVER


@dataclass(frozen=True, slots=True)
class Output:
    """One actuator at a digital output.

    Args:
        node: the id of the drive. bit: the number of its output.
        lasts: for how long it stays on after a use, s; infinite for one that stays on until it is switched off.
        pause: the time from a use until it can be used again, s.
    """

    node: int
    bit: int
    lasts: float
    pause: float = 0.0


class Outputs:
    """Which outputs are on. Times are monotonic, s.

    Args:
        wired: the outputs by the names of the actuators.
    """

    def __init__(self, wired: Mapping[str, Output]) -> None:
        self.wired = dict(wired)
        self.reset()

    def reset(self) -> None:
        """All are off."""
        self._until = dict.fromkeys(self.wired, NEVER)
        self._ready = dict.fromkeys(self.wired, NEVER)

    def release(self) -> None:
        """Switch off all but those that stay on until they are switched off, as a gripper keeps what it holds."""
        self._until = {name: until if until == math.inf else NEVER for name, until in self._until.items()}

    def use(self, name: str, value: float, now: float) -> None:
        """Switch an output on for as long as it lasts, or off if the value is 0; a kick that has begun is not cut."""
        output = self.wired[name]
        if value <= 0.0:
            if not output.pause:
                self._until[name] = NEVER
        elif now >= self._ready[name]:
            self._until[name], self._ready[name] = now + output.lasts, now + output.pause

    def bits(self, now: float) -> dict[int, int]:
        """The bits of each drive's outputs that are on, by its node."""
        return self._sum({name: now < until for name, until in self._until.items()})

    @property
    def masks(self) -> dict[int, int]:
        """The bits of each drive's outputs that are wired, by its node."""
        return self._sum(dict.fromkeys(self.wired, True))

    def _sum(self, on: Mapping[str, bool]) -> dict[int, int]:
        found: dict[int, int] = {}
        for name, output in self.wired.items():
            found[output.node] = found.get(output.node, 0) | on[name] << output.bit
        return found
