"""The acts of a replay's user: play, pause, change the speed, and go to another instant.

This knows no window and no clock: the caller passes the real time.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Match seconds per real second that can be chosen."""
SKIP: Final = 5.0
"""s of match time that one skip goes on or back."""
_GRACE: Final = 1.0
"""s of real time after a call in which the call before it is still the previous one, so that one can go on back."""


@dataclass(frozen=True)
class Playback:
    """The state of a replay. Each method returns the next state.

    Args:
        instants: the match times at which something was recorded, s, rising, at least one.
        calls: the match times of the referee's calls, s, rising.
        end: the last match time, s; that of the last instant, or later.
        time: the match time that is shown, s.
        speed: match seconds per real second, one of SPEEDS.
        playing: False while it is paused. held: the user holds the knob of the time bar, so that time stands still.
    """

    instants: Sequence[float] = field(repr=False)
    calls: Sequence[float] = field(repr=False)
    end: float
    time: float
    speed: float = 1.0
    playing: bool = True
    held: bool = False

    @classmethod
    def of(cls, instants: Sequence[float], calls: Sequence[float], end: float) -> "Playback":
        """A replay that plays from the first instant. The arguments are those of the class."""
        return cls(instants=instants, calls=calls, end=end, time=instants[0])

    @property
    def begin(self) -> float:
        """The first match time, s."""
        return self.instants[0]

    @property
    def over(self) -> bool:
        """True if the last instant is shown."""
        return self.time >= self.end

    def advance(self, seconds: float) -> "Playback":
        """Advance by this real time, s. At the end the replay pauses."""
        if not self.playing or self.held:
            return self
        moved = self.to(self.time + self.speed * seconds)
        return replace(moved, playing=not moved.over)

    def to(self, time: float) -> "Playback":
        """Go to a match time, s, or as near as there is anything."""
        return replace(self, time=min(max(time, self.begin), self.end))

    def toggle(self) -> "Playback":
        """Pause or go on; at the end, begin again."""
        if not self.playing and self.over:
            return replace(self.to_begin(), playing=True)
        return replace(self, playing=not self.playing)

    def step_on(self) -> "Playback":
        """Pause at the next instant that was recorded."""
        index = bisect_right(self.instants, self.time)
        later = self.instants[index] if index < len(self.instants) else self.end
        return replace(self.to(later), playing=False)

    def step_back(self) -> "Playback":
        """Pause at the instant before."""
        index = bisect_left(self.instants, self.time)
        return replace(self.to(self.instants[max(0, index - 1)]), playing=False)

    def faster(self) -> "Playback":
        """Play at the next higher speed."""
        return replace(self, speed=SPEEDS[min(SPEEDS.index(self.speed) + 1, len(SPEEDS) - 1)])

    def slower(self) -> "Playback":
        """Play at the next lower speed."""
        return replace(self, speed=SPEEDS[max(SPEEDS.index(self.speed) - 1, 0)])

    def skip_on(self) -> "Playback":
        """Go on by SKIP."""
        return self.to(self.time + SKIP)

    def skip_back(self) -> "Playback":
        """Go back by SKIP."""
        return self.to(self.time - SKIP)

    def next_call(self) -> "Playback":
        """Go to the next call. After the last one this changes nothing."""
        index = bisect_right(self.calls, self.time)
        return self.to(self.calls[index]) if index < len(self.calls) else self

    def previous_call(self) -> "Playback":
        """Go to the call before, or to the first instant if there is none."""
        grace = _GRACE * self.speed if self.playing else 0.0
        index = bisect_left(self.calls, self.time - grace)
        return self.to(self.calls[index - 1]) if index else self.to_begin()

    def to_begin(self) -> "Playback":
        """Go to the first instant."""
        return self.to(self.begin)

    def to_end(self) -> "Playback":
        """Go to the last instant."""
        return self.to(self.end)

    def grab(self, time: float) -> "Playback":
        """The user takes the knob of the time bar and puts it at a match time, s."""
        return replace(self.to(time), held=True)

    def drag(self, time: float) -> "Playback":
        """The user moves the knob, if it is held."""
        return self.to(time) if self.held else self

    def release(self) -> "Playback":
        """The user lets go of the knob. The replay goes on if it played before."""
        return replace(self, held=False)
