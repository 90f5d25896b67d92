"""The sightings of players in a plot, and what they sketched when calls were made."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from msgspec import structs

from vrg.bus.messages import Sighting
from vrg.games.game import Moment
from vrg.recording.reader import RecordedCall, Thought, sightings_of, thoughts_of
from vrg.recording.recorded import RecordedMatch
from vrg.ui.plots.plotted import Colour, Labels

_DASHES: Final = (0, (2, 2))
_SOON: Final = 1.0
"""The match time in s within which a sketch belongs to a call that was made before."""


@dataclass(frozen=True)
class Thoughts:
    """The sightings and the sketches of the players of a match.

    Args:
        sightings: by player. sketches: in the order of time.
    """

    sightings: Mapping[str, Sequence[Sighting]] = field(default_factory=dict)
    sketches: Sequence[Thought] = ()

    @classmethod
    def of(cls, recorded: RecordedMatch) -> "Thoughts":
        """Those of a recorded match."""
        return cls(sightings_of(recorded), thoughts_of(recorded))

    def turned(self) -> "Thoughts":
        """The same, a quarter turn clockwise about the origin."""
        seen = {
            name: [structs.replace(s, x=s.y, y=-s.x) for s in of_player] for name, of_player in self.sightings.items()
        }
        return Thoughts(
            seen,
            [
                replace(
                    thought,
                    strokes=[
                        structs.replace(stroke, points=tuple((y, -x) for x, y in stroke.points))
                        for stroke in thought.strokes
                    ],
                )
                for thought in self.sketches
            ],
        )

    def legend(self, moments: Iterable[Moment]) -> Iterator[Line2D]:
        """The lines of the legend that explain what is drawn, if calls are marked in these ways."""
        grey = "0.35"
        if any(self.sightings.values()):
            yield Line2D([], [], color=grey, marker=".", markersize=4, linestyle="", label="sighting, by its player")
        if any(m.thought for m in moments) and any(thought.strokes for thought in self.sketches):
            yield Line2D([], [], color=grey, linestyle=_DASHES, label="what a player expected then")

    def draw_sightings(self, axes: Axes, colours: Mapping[str, Colour], begin: float, end: float) -> None:
        """Draw what was seen from match time `begin` to `end`, s."""
        for name, seen in self.sightings.items():
            here = [s for s in seen if name in colours and begin <= s.time <= end]
            x, y = [s.x for s in here], [s.y for s in here]
            axes.plot(x, y, ".", color=colours.get(name), markersize=3.5, alpha=0.6, zorder=2.5)

    def draw_at(
        self, axes: Axes, call: RecordedCall, moment: Moment, colours: Mapping[str, Colour], labels: Labels
    ) -> None:
        """Draw what the first player of a call sketched when the call was made, where the game asks for that."""
        thought = self._at(call) if moment.thought else None
        if thought is None or thought.player not in colours:
            return
        colour = colours[thought.player]
        for stroke in thought.strokes:
            if len(stroke.points) > 1:
                xs, ys = [point[0] for point in stroke.points], [point[1] for point in stroke.points]
                axes.plot(xs, ys, linestyle=_DASHES, color=colour, linewidth=1.2, zorder=3.5)
            if stroke.label:
                end = stroke.points[-1]
                axes.plot(*end, "+", color=colour, markersize=10, markeredgewidth=1.6, zorder=6)
                labels.write(axes, stroke.label, end, colour, bold=False)

    def _at(self, call: RecordedCall) -> Thought | None:
        """The first sketch after a call that has a label, which explains the most; or else the first one."""
        then = [
            t
            for t in self.sketches
            if call.players and t.player == call.players[0] and t.strokes and -1e-6 <= t.time - call.time <= _SOON
        ]
        return next((t for t in then if any(stroke.label for stroke in t.strokes)), then[0] if then else None)
