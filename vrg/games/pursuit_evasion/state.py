"""The state of a match of pursuit-evasion."""

from collections.abc import Iterable

from msgspec import field, structs

from vrg.bus.messages import Sighting
from vrg.coordinator.rulebook import GameState
from vrg.games.pursuit_evasion import CROSSING

EVIDENCE = 8
"""The number of sightings of an intruder that are published."""
APART = 0.3
"""The time in s between two sightings that are published."""


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. There is one round.

    Args:
        states: the state of each player.
        entered: the intruders that have been inside the area.
        detections: the number of times at which each intruder was seen. detected: the latest of these, match time, s.
        seen: the time of play at which an intruder was last seen, s.
        evidence: sightings of each intruder, oldest first.
        dispatched: the pursuer that was sent to each intruder, and when (time of play, s).
        captured, escaped: how many.
    """

    states: dict[str, str]
    entered: list[str] = field(default_factory=list)
    detections: dict[str, int] = field(default_factory=dict)
    detected: dict[str, float] = field(default_factory=dict)
    seen: dict[str, float] = field(default_factory=dict)
    evidence: dict[str, list[Sighting]] = field(default_factory=dict)
    dispatched: dict[str, tuple[str, float]] = field(default_factory=dict)
    captured: int = 0
    escaped: int = 0

    def with_state(self, names: Iterable[str], state: str) -> "State":
        """The same, but with these players in state `state`."""
        return structs.replace(self, states={**self.states, **dict.fromkeys(names, state)})

    def in_state(self, *states: str) -> list[str]:
        """The players in one of these states that are not disqualified."""
        return [name for name, state in self.states.items() if state in states and name not in self.disqualified]

    def crossing(self) -> list[str]:
        """The intruders in play, by name."""
        return sorted(self.in_state(CROSSING))

    def with_sighting(self, intruder: str, sighting: Sighting, clock: float) -> "State":
        """The same after an intruder was seen. Sightings at the same instant are one detection.

        Args:
            clock: the time of play, s.
        """
        state = structs.replace(self, seen={**self.seen, intruder: clock})
        last = self.detected.get(intruder)
        if last is not None and sighting.time <= last + 1e-6:
            return state
        state = structs.replace(
            state,
            detections={**self.detections, intruder: self.detections.get(intruder, 0) + 1},
            detected={**self.detected, intruder: sighting.time},
        )
        before = self.evidence.get(intruder, [])
        if len(before) > 1 and sighting.time < before[-1].time + APART:
            return state
        return structs.replace(state, evidence={**self.evidence, intruder: [*before, sighting][-EVIDENCE:]})
