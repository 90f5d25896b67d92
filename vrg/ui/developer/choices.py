"""The choices of the developers' view's user. This needs no window."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field

from vrg.ui.acts import Act, Press


class Layer(enum.Enum):
    """A layer of the field besides the robots."""

    SCANS = "scans"
    SENSORS = "sensors"
    SIGHTINGS = "sightings"
    SKETCHES = "sketches"
    MEASURED = "measured"
    TRAILS = "trails"
    NAMES = "names"


class Tab(enum.Enum):
    """A content of the panel's lower part."""

    REFEREE = "referee"
    PLAYER = "player"
    STREAMS = "streams"
    PROCESSES = "processes"


@dataclass
class ViewState:
    """The user's choices.

    Attributes:
        tab: what the lower part of the panel shows. selected: the player whose details are shown, or None.
        shown: the overlays that are on.
        sort: the heading by which the streams are sorted, and whether downwards; None puts the bad ones first.
        scrolled: by how many rows each tab is scrolled, and, under None, the list of players.
    """

    tab: Tab = Tab.REFEREE
    selected: str | None = None
    shown: set[Layer] = field(default_factory=lambda: set(Layer) - {Layer.SENSORS})
    sort: tuple[str, bool] | None = None
    scrolled: dict[Tab | None, int] = field(default_factory=dict)

    def press(self, press: Press, players: Sequence[str]) -> bool:
        """Take in that a key went down; whether it meant something here.

        Args:
            players: those that can be selected, in the order in which N goes through them.
        """
        overlays, tabs = tuple(Layer), tuple(Tab)
        if press.act is Act.LAYER and press.number < len(overlays):
            self.toggle(overlays[press.number])
        elif press.act is Act.TAB:
            self.tab = tabs[press.number]
        elif press.act is Act.SELECT and players:
            step = -1 if press.back else 1
            at = players.index(self.selected) + step if self.selected in players else (0 if step > 0 else -1)
            self.selected = players[at % len(players)]
        else:
            return False
        return True

    def toggle(self, overlay: Layer) -> None:
        """Switch an overlay on or off."""
        self.shown ^= {overlay}

    def select(self, player: str | None) -> None:
        """Show the details of a player; a click on the one that is selected selects none."""
        self.selected = None if player == self.selected else player

    def sort_by(self, heading: str) -> None:
        """Sort the streams by a heading: downwards at first, then upwards, then the bad ones first again."""
        if self.sort is None or self.sort[0] != heading:
            self.sort = heading, True
        else:
            self.sort = (heading, False) if self.sort[1] else None
        self.scrolled[Tab.STREAMS] = 0

    def scroll(self, part: Tab | None, steps: int, last: int) -> None:
        """Move a list by so many rows, at most to `last`."""
        self.scrolled[part] = min(max(0, self.scrolled.get(part, 0) + steps), max(0, last))
