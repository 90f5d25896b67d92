"""The state of a match of pursuit-evasion."""

from typing import TypeVar

from msgspec import field, structs

from vrg.bus.messages import Sighting
from vrg.coordinator.rulebook import GameState
from vrg.games.pursuit_evasion import CROSSING

V = TypeVar("V")

EVIDENCE = 8
"""The number of sightings of an intruder that are published."""
APART = 0.3
"""The time in s between two sightings that are published."""


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. There is one round.

    Args:
        entered: the intruders that have been inside the area.
        detected: the first two times at which each intruder was seen, as they were told, match time, s.
        seen: the time of play at which an intruder was last seen, s.
        evidence: sightings of each intruder, oldest first.
        dispatched: the pursuer that was sent to each intruder, and when (time of play, s).
    """

    entered: list[str] = field(default_factory=list)
    detected: dict[str, list[float]] = field(default_factory=dict)
    seen: dict[str, float] = field(default_factory=dict)
    evidence: dict[str, list[Sighting]] = field(default_factory=dict)
    dispatched: dict[str, tuple[str, float]] = field(default_factory=dict)

    def crossing(self) -> list[str]:
        """The intruders in play, by name."""
        return sorted(self.in_state(CROSSING))

    def detections(self, intruder: str) -> int:
        """The number of times at which an intruder was seen, at most 2."""
        return len(self.detected.get(intruder, []))

    def with_sighting(self, intruder: str, sighting: Sighting, clock: float) -> "State":
        """The same after an intruder was seen. Sightings at the same instant are one detection.

        Args:
            clock: the time of play, s.
        """
        times = self.detected.get(intruder, [])
        if len(times) < 2 and all(abs(sighting.time - time) > 1e-6 for time in times):
            times = [*times, sighting.time]
        evidence = self.evidence.get(intruder, [])
        # The first two may be near each other in time, because two are enough.
        early = len(evidence) < 2 and all(abs(sighting.time - each.time) > 1e-6 for each in evidence)
        if early or (evidence and sighting.time >= evidence[-1].time + APART):
            evidence = sorted([*evidence, sighting], key=lambda s: s.time)[-EVIDENCE:]
        return structs.replace(
            self,
            seen={**self.seen, intruder: clock},
            detected={**self.detected, intruder: times},
            evidence={**self.evidence, intruder: evidence},
        )

    def unseen(self, intruder: str) -> "State":
        """The same, but as if an intruder had never been seen and had never been inside."""
        return structs.replace(
            self,
            entered=[name for name in self.entered if name != intruder],
            detected=_without(self.detected, intruder),
            seen=_without(self.seen, intruder),
            evidence=_without(self.evidence, intruder),
        )


def _without(table: dict[str, V], name: str) -> dict[str, V]:
    return {key: value for key, value in table.items() if key != name}
