"""A recorded match in three dimensions, with a bar of time and a few buttons in the small panel."""

import time
from collections.abc import Callable
from typing import Any, Final

from vrg.ui.playback import SPEEDS, Playback
from vrg.ui.timeline import Timeline
from vrg_views.three.theatre import Theatre

FRAME: Final = 1 / 30
"""The real time in s between two frames."""
MAX_FRAME_TIME: Final = 0.25
"""s of real time that a frame counts for at most, so that the match does not jump after the computer has slept."""
_HELD: Final = 0.6
"""s of real time in which the bar stays where it was moved by a person."""
_PLAY, _BEFORE, _NEXT = "Play/Pause", "Previous call", "Next call"
_MOVES: Final[dict[str, Callable[[Playback], Playback]]] = {
    _PLAY: Playback.toggle, _BEFORE: Playback.previous_call, _NEXT: Playback.next_call,
}  # fmt: skip


class ThreeReplay:
    """Shows a recorded match to browsers. All of them see the same instant, and each may choose it.

    Args:
        theatre: what browsers see. timeline: of the match.

    Attributes:
        playback: where the replay stands.
    """

    def __init__(self, theatre: Theatre, timeline: Timeline) -> None:
        self._theatre, self._timeline = theatre, timeline
        self.playback = Playback.of(timeline.instants, [call.time for call in timeline.calls], timeline.end)

    def run(self, wait: Callable[[float], bool]) -> None:
        """Serve it until `wait`, which waits for this many s, returns True.

        Raises:
            LaunchError: the port cannot be opened.
        """
        self._theatre.open()
        try:
            self._controls()
            self._theatre.show(self._timeline.at(self.playback.time), FRAME)
            before, shown = time.monotonic(), -1.0
            while not wait(FRAME):
                now = time.monotonic()
                seconds, before = min(now - before, MAX_FRAME_TIME), now
                if not self._theatre.watched:
                    continue
                self.playback = self.playback.advance(seconds)
                self._theatre.show(self._timeline.at(self.playback.time, self.playback.speed), seconds)
                if now - max(shown, self._moved + _HELD) > 0.2:
                    self._bar.value = round(self.playback.time, 1)
                    shown = now
        finally:
            self._theatre.close()

    def _controls(self) -> None:
        gui = self._theatre.gui
        self._moved = -_HELD
        begin, end = self._timeline.begin, self._timeline.end
        with gui.add_folder("Replay"):
            buttons = gui.add_button_group("", list(_MOVES))
            # viser publishes its values as if they could only be read.
            self._bar: Any = gui.add_slider(
                "Time", round(begin, 1), max(round(end, 1), begin + 0.1), 0.1, round(begin, 1)
            )
            speed = gui.add_dropdown("Speed", [f"{value:g}x" for value in SPEEDS], initial_value="1x")

        # These run on threads of viser; each assigns a new value, which is one step.
        @buttons.on_click
        def _(_event: Any) -> None:
            self.playback = _MOVES[buttons.value](self.playback)

        @self._bar.on_update
        def _(event: Any) -> None:
            if event.client is not None:
                self._moved = time.monotonic()
                self.playback = self.playback.to(self._bar.value)

        @speed.on_update
        def _(_event: Any) -> None:
            wanted = float(speed.value.removesuffix("x"))
            while self.playback.speed != wanted:
                self.playback = self.playback.faster() if self.playback.speed < wanted else self.playback.slower()
